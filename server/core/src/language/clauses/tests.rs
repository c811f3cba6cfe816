use super::*;
use proptest::prelude::*;

fn read(text: &str) -> Vec<String> {
    let chars: Vec<char> = text.chars().collect();
    let said = |s: &Option<Range<usize>>| s.clone().map_or(String::new(), |s| chars[s].iter().collect());
    clauses(text).iter().map(|c| [&c.figure, &c.verb, &c.relation, &c.landmark].map(said).join("|")).collect()
}

#[test]
fn routes_are_cut_into_clauses() {
    for (text, expected) in [
        (
            "Walk past the café and the printers, then turn left at the stairs.",
            vec!["|Walk|past|the café", "|Walk|past|the printers", "|turn left|at|the stairs"],
        ),
        (
            "Go straight down the hall until you see a mural on your right.",
            vec![
                "|Go straight|down|the hall",
                "|Go straight|until|you see a mural on your right",
                "you|see||a mural on your right",
            ],
        ),
        ("With the desk on your left, exit the room.", vec!["the desk||on your left|", "|exit||the room"]),
        ("When you reach the gym, take a right.", vec!["|take a right|When you reach|the gym"]),
        ("The lab is the second door on the left.", vec!["The lab|is||the second door on the left"]),
        ("", vec![]),
    ] {
        assert_eq!(read(text), expected, "{text}");
    }
}

proptest! {
    #[test]
    fn any_text_is_cut(text in "\\PC{0,200}") {
        let length = text.chars().count();
        for c in clauses(&text) {
            for span in [c.figure, c.verb, c.relation, c.landmark].into_iter().flatten() {
                prop_assert!(span.start < span.end && span.end <= length);
            }
        }
    }

    #[test]
    fn any_words_are_cut(
        words in prop::collection::vec(prop::sample::select(vec![
            "walk", "the", "door", "and", "you", "see", "until", "with", "on", "your", "left", ",", ".", "(", ")",
            "is", "when", "reach", "immediately", "to", "right", "straight", "you're", "keep", "take", "a", "all",
        ]), 0..60),
    ) {
        let _ = clauses(&words.join(" "));
    }
}
