//! The house keeps its order: which room of `src` may name which, read from every `crate::` and `super::`
//! path, tests included. Rooms are files and folders; see "The house" in `server/ARCHITECTURE.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Rooms from the ground up: each may name those before it, and itself.
const ROOMS: [&str; 18] = [
    "wide",
    "geometry",
    "random",
    "event",
    "edge",
    "effects",
    "config",
    "scan",
    "smoothing",
    "track",
    "graph",
    "regions",
    "language",
    "filter",
    "talk",
    "answers",
    "trial",
    "mapper",
];
/// The same within `language`.
const LANGUAGE: [&str; 20] = [
    "measure",
    "relation",
    "lexicon",
    "spelling",
    "reply",
    "act",
    "notation",
    "words",
    "reference",
    "grammar",
    "reader",
    "likeness",
    "agreement",
    "understand",
    "phrases",
    "ellipsis",
    "glossary",
    "speech",
    "grounding",
    "clauses",
];
/// Files directly in `src`.
const FILES_MAX: usize = 12;

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("the sources are there") {
        let path = entry.expect("a folder can be read").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The module that a file is: `["filter", "mod"]` is `["filter"]`.
fn module(src: &Path, file: &Path) -> Vec<String> {
    let mut parts: Vec<String> = file
        .strip_prefix(src)
        .expect("a source is below src")
        .with_extension("")
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    if parts.last().is_some_and(|last| last == "mod" || last == "lib") {
        parts.pop();
    }
    parts
}

/// Every path of a text that begins with `crate::` or `super::`, from the crate's root on, groups
/// in braces taken apart.
fn paths(text: &str, module: &[String]) -> Vec<Vec<String>> {
    let mut code = String::new();
    for line in text.lines() {
        code.push_str(line.split("//").next().unwrap_or(""));
        code.push('\n');
    }
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = Vec::new();
    for start in ["crate::", "super::"] {
        for (at, _) in code.match_indices(start) {
            let before = &code[..at];
            if before.ends_with(is_name) || before.ends_with("::") {
                continue;
            }
            let mut rest = &code[at..];
            // `super` of an inline module is the file's own: what stands indented counts from there.
            let line_start = before.rfind('\n').map_or(0, |k| k + 1);
            let inline = code[line_start..].starts_with(' ');
            let mut base: Vec<String> = Vec::new();
            if start == "super::" {
                base = module.to_vec();
                let mut ups = 0;
                while let Some(next) = rest.strip_prefix("super::") {
                    rest = next;
                    ups += 1;
                }
                base.truncate(base.len().saturating_sub(ups - usize::from(inline && ups > 0)));
            } else {
                rest = &rest["crate::".len()..];
            }
            tree(rest, base, &mut found);
        }
    }
    found
}

/// The leaves of `a::{b, c::d}` behind a base.
fn tree(text: &str, mut base: Vec<String>, found: &mut Vec<Vec<String>>) {
    let mut rest = text;
    loop {
        if let Some(inner) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut from = 0;
            for (k, c) in inner.char_indices() {
                match c {
                    '{' => depth += 1,
                    '}' if depth > 0 => depth -= 1,
                    ',' | '}' if depth == 0 => {
                        tree(inner[from..k].trim(), base.clone(), found);
                        from = k + 1;
                        if c == '}' {
                            return;
                        }
                    }
                    _ => {}
                }
            }
            return;
        }
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        if end == 0 {
            break;
        }
        base.push(rest[..end].to_owned());
        match rest[end..].strip_prefix("::") {
            Some(next) => rest = next,
            None => break,
        }
    }
    if !base.is_empty() {
        found.push(base);
    }
}

/// Who names whom, of the rooms below a module: (from, to) with a file that does.
fn named(floor: &[&str]) -> BTreeMap<(String, String), String> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let depth = floor.len();
    let mut named = BTreeMap::new();
    for file in sources(&src) {
        let module = module(&src, &file);
        let within = module.len() > depth && module.iter().zip(floor).all(|(a, b)| a == b);
        if !within || module[depth] == "tests" {
            continue;
        }
        for path in paths(&std::fs::read_to_string(&file).expect("sources are text"), &module) {
            let here = path.len() > depth && path.iter().zip(floor).all(|(a, b)| a == b);
            if here && path[depth] != module[depth] {
                named.insert((module[depth].clone(), path[depth].clone()), file.display().to_string());
            }
        }
    }
    named
}

fn no_way_up(floor: &[&str], rooms: &[&str]) {
    let floor_of = |room: &str| rooms.iter().position(|r| *r == room);
    let mut wrong = Vec::new();
    for ((from, to), file) in named(floor) {
        match (floor_of(&from), floor_of(&to)) {
            (Some(a), Some(b)) if b < a => {}
            // What lib.rs re-exports is for users; the face may use it too.
            (Some(_), None) if from == "mapper" && to.starts_with(char::is_uppercase) => {}
            _ => wrong.push(format!("{from} names {to}: {file}")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn few_files_stand_in_the_hall() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let files = sources(&src).into_iter().filter(|f| f.parent() == Some(&src)).count();
    assert!(files <= FILES_MAX, "{files} files directly in server/core/src; find each a room");
}

#[test]
fn no_room_names_one_above_it() {
    no_way_up(&[], &ROOMS);
    no_way_up(&["language"], &LANGUAGE);
}

/// What follows from the order above is tested for the rooms' own files too.
#[test]
fn no_circle_stands_between_the_files_of_a_room() {
    for room in [&["filter"][..], &["talk"], &["answers"], &["track"], &["scan"], &["smoothing"]]
        .into_iter()
        .chain([&["language", "grammar"][..], &["language", "grounding"], &["language", "lexicon"]])
    {
        let mut named: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for ((from, to), _) in self::named(room) {
            named.entry(from).or_default().insert(to);
        }
        // Take away whoever names nobody that is left, until none can go.
        loop {
            let left: BTreeSet<String> = named.keys().cloned().collect();
            let before = named.len();
            named.retain(|_, to| to.iter().any(|t| left.contains(t)));
            if named.len() == before {
                break;
            }
        }
        assert!(named.is_empty(), "a circle in {room:?}: {named:?}");
    }
}

#[test]
fn paths_are_read_through_braces_and_from_inline_modules() {
    let text = "use crate::a::{b::C, d};\n    use super::e;\nuse super::super::f::g; // crate::no\n";
    let module = ["x", "y", "z"].map(String::from);
    let read: Vec<String> = paths(text, &module).into_iter().map(|p| p.join("::")).collect();
    assert_eq!(read, ["a::b::C", "a::d", "x::y::z::e", "x::f::g"]);
}
