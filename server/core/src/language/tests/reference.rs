use crate::language::grammar::parse::parse;
use crate::language::reference::{resolve_it, topic};
use crate::language::words::words;

fn resolved(text: &str, before: Option<&str>) -> String {
    let mut parsed = parse(text);
    let before = before.map(parse);
    resolve_it(&mut parsed, before.as_ref().and_then(topic));
    words(parsed.acts(), |_| true)
}

#[test]
fn it_is_what_was_spoken_of_last() {
    for (text, before, want) in [
        ("The kitchen is down the hall. It is next to the gym.", None, "and the kitchen is next to the gym"),
        ("this is the kitchen, the gym is across from it", None, "the gym is across from the kitchen"),
        ("it is next to the gym", Some("the cafe is down the hall"), "the cafe is next to the gym"),
        ("it is next to the gym", Some("where is the cafe?"), "it is next to the gym"),
        ("it is next to the gym", None, "it is next to the gym"),
        (
            "The kitchen is down the hall. It is called the bistro.",
            None,
            "the kitchen is also called the bistro",
        ),
    ] {
        let got = resolved(text, before);
        assert!(got.contains(want), "{text} {before:?}: {got}");
    }
}
