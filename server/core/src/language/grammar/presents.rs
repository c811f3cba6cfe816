//! "There is …", "you will find …": shows something before it says where it lies.

use crate::language::grammar::copula::{EVEN, LIKELY};
use crate::language::grammar::cursor::Cursor;

/// Shows something that the listener need not know: how sure it is, and whether it is no longer there.
pub(crate) fn presents(at: &mut Cursor) -> Option<(f64, bool)> {
    let also = "also|actually|always|only|";
    if at.eat_each(&["there", "used to be"]) {
        return Some((1.0, true));
    }
    if at.eat_each(&["there", also, "might|may|could", "also|", "be"]) {
        return Some((EVEN, false));
    }
    if at.eat_each(&["there", also, "must|ought to|should|seems to|appears to", "also|", "be"]) {
        return Some((LIKELY, false));
    }
    let there = at.eat_each(&["there", also, "is|are|will be|happens to be|happen to be"])
        || at.eat_each(&["we|you|they", also, "have got|have|keep|store", "got|"])
        || at.eat_each(&[
            "we|you|they|one",
            also,
            "will|can|should|would|may|",
            also,
            "be able to|",
            FINDING,
        ])
        || at.eat_each(&[
            "we|you",
            "are",
            "now|just|",
            "passing|coming up on|coming up to|approaching|going past|going by|walking past",
        ]);
    there.then_some((1.0, false))
}

/// How "you" come upon a place.
const FINDING: &str = "find|see|notice|spot|come to|come across|come upon|run into|encounter|hit|get to|reach|pass by|pass|\
    have";
