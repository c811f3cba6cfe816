//! The table: what is fed, and what must come of it. Each kind of input has its rows in a file of its own.

use crate::feed::{Came, Fed, Outcome, feed};
use crate::{files, journals, keys, logs, settings, wire_bincode, wire_json};
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Fewer rows than these are no table of what goes wrong.
const ROWS_MIN: usize = 150;

/// Rows by name that do not come out as they should; each says why where it stands. They are not asserted.
const KNOWN: [&str; 23] = [
    "json: a pose that is a list",
    "json: a stamp that is a list",
    "json: a message that is a list",
    "payload: a name twice",
    "settings: 2^63 - 1 short queries",
    "settings: 2^63 - 1 long queries",
    "settings: 2^63 - 1 commands",
    "settings: a payload of 10^9",
    "log: a stamp of 2^32 s before good ones",
    "log: a longest range of NaN",
    "log: lines that are indented",
    "log: no scan that servers take",
    "narration: an id of 65 bytes",
    "narration: a chance of 7",
    "narration: a text of 1001 characters",
    "narration: a time of 2^32 s",
    "narration: a mark of byte order",
    "sentence: a picture",
    "sentence: marks on nothing",
    "sentence: one word of 1000 letters",
    "segment: the last entry there is",
    "journal: a checkpoint of the last entry there is",
    "journal: a sector that stands there twice",
];

/// A row.
pub struct Case {
    /// What is wrong with the input.
    pub name: String,
    fed: Fed,
    want: Outcome,
}

/// A row; `told` is the field that a refusal names, or parts of what else is told, with " … " between them.
pub fn case(name: impl Into<String>, fed: Fed, came: Came, told: &str) -> Case {
    Case { name: name.into(), fed, want: Outcome { came, told: told.into() } }
}

impl Case {
    /// What is wrong with what comes of it; none if nothing is.
    fn wrong(&self) -> Option<String> {
        let (name, want) = (&self.name, &self.want);
        let Ok(got) = catch_unwind(AssertUnwindSafe(|| feed(&self.fed))) else {
            return Some(format!("{name}: panics, should be {want:?}"));
        };
        let told = match want.came {
            // A field is one, whole.
            Came::Invalid => got.told == want.told,
            _ => want.told.split(" … ").all(|part| got.told.contains(part)),
        };
        let right = got.came == want.came && told;
        (!right).then(|| format!("{name}: is {got:?}, should be {want:?}"))
    }
}

fn all() -> Vec<Case> {
    let kinds = [
        wire_bincode::cases(),
        wire_json::cases(),
        keys::cases(),
        settings::cases(),
        logs::cases(),
        files::cases(),
        journals::cases(),
    ];
    kinds.into_iter().flatten().collect()
}

/// Holds rows to what they say.
fn hold(cases: &[Case]) {
    let asserted = cases.iter().filter(|case| !KNOWN.contains(&case.name.as_str()));
    let wrong: Vec<String> = asserted.filter_map(Case::wrong).collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

#[test]
fn bincode_messages_are_refused_as_they_should() {
    hold(&wire_bincode::cases());
}

#[test]
fn json_messages_are_refused_as_they_should() {
    hold(&wire_json::cases());
}

#[test]
fn keys_and_selectors_are_refused_as_they_should() {
    hold(&keys::cases());
}

#[test]
fn settings_and_users_are_refused_as_they_should() {
    hold(&settings::cases());
}

#[test]
fn logs_narrations_and_sentences_are_refused_as_they_should() {
    hold(&logs::cases());
}

#[test]
fn records_are_refused_as_they_should() {
    hold(&files::cases());
}

#[test]
fn journals_are_refused_as_they_should() {
    hold(&journals::cases());
}

#[test]
fn the_table_is_long_and_says_nothing_twice() {
    let cases = all();
    println!("{} rows, {} of them known not to hold", cases.len(), KNOWN.len());
    let names: BTreeSet<&str> = cases.iter().map(|case| case.name.as_str()).collect();
    assert_eq!(names.len(), cases.len(), "two rows of one name");
    assert!(cases.len() - KNOWN.len() >= ROWS_MIN, "{} rows", cases.len());
    for known in KNOWN {
        let case = cases.iter().find(|case| case.name == known);
        let wrong = case.unwrap_or_else(|| panic!("{known}: no such row")).wrong();
        println!("known: {}", wrong.unwrap_or_else(|| format!("{known}: holds by now")));
    }
}
