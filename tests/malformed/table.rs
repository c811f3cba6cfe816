//! The table: what is fed, and what must come of it. Each kind of input has its rows in a file of its own.

use crate::feed::{Came, Fed, Outcome, feed};
use crate::{files, journals, keys, logs, settings, wire_bincode, wire_json};
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Fewer rows than these are no table of what goes wrong.
const ROWS_MIN: usize = 150;

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
    let wrong: Vec<String> = cases.iter().filter_map(Case::wrong).collect();
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
    println!("{} rows", cases.len());
    let names: BTreeSet<&str> = cases.iter().map(|case| case.name.as_str()).collect();
    assert_eq!(names.len(), cases.len(), "two rows of one name");
    assert!(cases.len() >= ROWS_MIN, "{} rows", cases.len());
}
