use super::*;
use proptest::prelude::*;

fn glossary(lines: &str) -> Glossary {
    Glossary::read(lines).unwrap()
}

#[test]
fn words_are_put_in_the_place_of_others() {
    let g = glossary(
        "den|die flur * entlang = down *\nein|eine = a\nflur = hallway\n-zimmer = room\nflur hier = this hallway",
    );
    for (text, english) in [
        ("Ein Krankenzimmer, eine Tür.", "a kranken room, a Tür."),
        ("den Flur zwei Zimmer entlang!", "down zwei Zimmer!"),
        ("den Flur ein Krankenzimmer entlang", "down a kranken room"),
        ("der Flur hier", "der this hallway"),
        ("der Flur, hier", "der hallway, hier"),
        ("Zimmer", "Zimmer"),
        ("", ""),
        (" … ", " … "),
    ] {
        assert_eq!(g.english(text), english, "{text}");
    }
}

#[test]
fn a_line_that_says_nothing_is_told() {
    for (lines, line) in [
        ("a = b\nc", 2),
        ("= b", 1),
        ("* a = b", 1),
        ("a * b * c = d", 1),
        ("a = *", 1),
        ("\nname: ; the", 2),
        ("- = a", 1),
        ("(a) (b) (c) (d) (e) (f) (g) (h) (i) (k) = a", 1),
        ("(a b) c = d", 1),
    ] {
        assert_eq!(Glossary::read(lines).unwrap_err().line, line, "{lines}");
    }
    assert_eq!(Glossary::read(&"# \n".repeat(100_000)).unwrap_err().line, 0);
    assert_eq!(Glossary::read(&format!("a = b\na = {}", "b".repeat(1000))).unwrap_err().line, 2);
    let many = "a|b|c|d|e|f|g|h a|b|c|d|e|f|g|h a|b|c|d|e|f|g|h = x\n".repeat(300);
    assert_eq!(Glossary::read(&many).unwrap_err().line, 197);
    assert_eq!(glossary("# all of it is said\n\na = # nothing").english("a b"), " b");
}

#[test]
fn it_is_kept_as_its_lines() {
    let g = glossary("mensa = canteen\nname: Bertha");
    let bytes = bincode::serde::encode_to_vec(&g, bincode::config::standard()).unwrap();
    let (same, _): (Glossary, usize) =
        bincode::serde::decode_from_slice(&bytes, bincode::config::standard()).unwrap();
    assert_eq!(
        (same.english("mensa"), same.spelled(&Name::new("bertha").unwrap())),
        ("canteen".into(), Some("Bertha"))
    );
}

proptest! {
    #[test]
    fn any_lines_and_any_text_are_read(lines in "([a-c*|()= -]{0,12}\n){0,6}", text in "[a-cA-C ,.'’&*-]{0,40}") {
        if let Ok(g) = Glossary::read(&lines) {
            let _ = g.english(&text);
        }
    }

    #[test]
    fn what_no_line_knows_stays(text in "\\PC{0,60}") {
        prop_assert_eq!(glossary("zxzx yy = a").english(&text), text);
    }
}
