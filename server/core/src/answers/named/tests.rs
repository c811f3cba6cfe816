//! What is said in the wing of [`crate::answers::described::tests`].

use super::*;
use crate::answers::described::tests::{likeliest, wing};
use crate::filter::labels::DIRECT;
use crate::language::act::About;
use crate::language::{Content, Name, parse};

/// The wing with what is said in it: each sentence with the place of whose room it speaks, if it names one.
pub(crate) fn heard(sentences: &[(&str, Option<u32>)]) -> (Named, Ledger, Labels) {
    let (rooms, places) = wing();
    let (mut ledger, mut labels) = (Ledger::default(), Labels::default());
    for (k, &(text, place)) in sentences.iter().enumerate() {
        let parse = parse(text);
        // Not where it speaks of: without cells nobody knows in which room that is.
        let held = u32::from(place == Some(0));
        let (id, text) = (k.to_string(), text.to_owned());
        for name in ["kitchen", "bathroom", "library", "gym"].into_iter().filter(|name| text.contains(name)) {
            ledger.enter_name(&Name::new(name).unwrap());
        }
        let utterance =
            ledger.enter(Entry { id, stamp_ns: 0, text, parse, held, stands: true }, place.is_none());
        if let Some(place) = place {
            let name = sentences[k].0.trim_end_matches('.').rsplit(' ').next().unwrap();
            let label = ledger.label(name).unwrap();
            labels.add(Evidence::new(utterance, label, place, DIRECT, Source::Direct));
        }
    }
    let stamps = (0..places.len() as i64).collect();
    let named = Named::new(Arc::new(rooms), (places, stamps), &labels, &ledger);
    (named, ledger, labels)
}

/// The first place of a room.
pub(crate) fn first(room: usize) -> u32 {
    wing().0.regions[room].places[0]
}

#[test]
fn sentences_put_what_they_describe_and_questions_choose() {
    let (named, ledger, _) = heard(&[
        ("This is the kitchen.", Some(first(2))),
        ("This is the bathroom.", Some(first(1))),
        ("This is a bathroom.", Some(first(8))),
        ("The library is across from the kitchen.", None),
        ("The library is next to the gym.", None),
        ("The gym is between the kitchen and the library.", None),
    ]);
    let of = |name: &str| ledger.label(name).unwrap();
    assert_eq!(likeliest(&named.described(of("library"), &ledger).unwrap().which), 6);
    assert!(named.is_described(of("gym")) && !named.is_described(of("kitchen")));
    assert!(named.described(of("gym"), &ledger).is_some(), "by what was described itself");
    assert!(named.described(of("kitchen"), &ledger).is_none());
    let within = match &parse("where is the bathroom next to the kitchen?").acts()[0].content {
        Content::Ask { about: About::Phrase(phrase), .. } => phrase.within.clone(),
        other => panic!("{other:?}"),
    };
    let speaker = Speaker { pose: Pose2::new(20.0, 1.0, 0.0), place: 3, path_m: 50.0 };
    let so = named.narrowed(of("bathroom"), &within, &ledger, &speaker);
    assert!(so[1] > 5.0 * so[8], "{so:?}");
}
