//! Readings compared leniently: the same acts, figures, relations, landmarks; qualities and spellings don't matter.

/// An act as far as it counts.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    Two(&'static str, Head, Head),
    Located(Head, String, Vec<Head>),
    Attribute(Head),
    Not(Box<Act>),
    Mend(Option<Box<Act>>, Box<Act>),
    Ask(String, Result<Head, Box<Act>>),
    Generic(Head, String, Head, String),
    Route(Option<Box<Act>>),
    Any,
    Odd(String),
}

/// All that a phrase may be called.
pub type Head = Vec<String>;

/// The acts of a reading; none of `none`.
pub fn acts(reading: &str) -> Vec<Act> {
    let reading = reading.trim();
    if reading.is_empty() || reading.starts_with("none") {
        return Vec::new();
    }
    split(reading, "&").iter().map(|s| act(s)).collect()
}

/// Words of an act in writing that another has, too, as a share of all.
pub fn alike(a: &str, b: &str) -> f64 {
    let words = |text: &str| -> std::collections::BTreeSet<String> {
        let all = text.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
        all.map(|w| w.to_lowercase().trim_end_matches('s').to_owned()).collect()
    };
    let (a, b) = (words(a), words(b));
    a.intersection(&b).count() as f64 / a.union(&b).count().max(1) as f64
}

/// Whether they say the same.
pub fn same(a: &[Act], b: &[Act]) -> bool {
    let mut left: Vec<&Act> = b.iter().collect();
    a.len() == b.len()
        && a.iter().all(|x| left.iter().position(|y| equal(x, y)).map(|i| left.remove(i)).is_some())
}

/// Whether two acts are one.
pub fn equal(a: &Act, b: &Act) -> bool {
    match (a, b) {
        (Act::Two(k, a1, a2), Act::Two(l, b1, b2)) => {
            let swap = matches!(*k, "alias" | "same") && meet(a1, b2) && meet(a2, b1);
            k == l && (meet(a1, b1) && meet(a2, b2) || swap)
        }
        (Act::Located(f, r, l), Act::Located(g, s, m)) => {
            meet(f, g) && r == s && l.len() == m.len() && l.iter().zip(m).all(|(x, y)| meet(x, y))
        }
        (Act::Attribute(a), Act::Attribute(b)) => meet(a, b),
        (Act::Not(a), Act::Not(b)) => equal(a, b),
        (Act::Mend(a, x), Act::Mend(b, y)) => {
            let was = match (a, b) {
                (Some(a), Some(b)) => equal(a, b),
                _ => true,
            };
            was && equal(x, y)
        }
        (Act::Ask(k, a), Act::Ask(l, b)) => {
            k == l
                && match (a, b) {
                    (Ok(a), Ok(b)) => meet(a, b),
                    (Err(a), Err(b)) => equal(a, b),
                    _ => false,
                }
        }
        (Act::Generic(a, r, b, q), Act::Generic(c, s, d, p)) => meet(a, c) && r == s && meet(b, d) && q == p,
        (Act::Route(a), Act::Route(b)) => match (a, b) {
            (None, None) => true,
            (Some(a), Some(b)) => equal(a, b),
            _ => false,
        },
        (Act::Any, Act::Any) => true,
        (Act::Odd(a), Act::Odd(b)) => a == b,
        _ => false,
    }
}

fn meet(a: &Head, b: &Head) -> bool {
    let ends = |x: &str, y: &str| x.strip_suffix(y).is_some_and(|r| r.ends_with('_'));
    a.iter().any(|x| b.iter().any(|y| x == y || ends(x, y) || ends(y, x)))
}

/// Parts of a text between a sign, outside brackets.
pub fn split(text: &str, at: &str) -> Vec<String> {
    let (mut out, mut depth, mut now) = (Vec::new(), 0_i32, String::new());
    for c in text.chars() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 && at.starts_with(c) {
            out.push(std::mem::take(&mut now));
        } else {
            now.push(c);
        }
    }
    out.push(now);
    out
}

fn head(text: &str) -> Head {
    let text = text.trim().to_lowercase();
    let end = text.find(['[', '{']).unwrap_or(text.len());
    let kind = text[..end].trim().replace("?asr", "");
    let mut names = Vec::new();
    let mut qualities = Vec::new();
    let after = &text[end..];
    if after.starts_with('{') {
        for f in after[1..after.find('}').unwrap_or(after.len())].split(',') {
            match f.split_once('=') {
                Some(("name", n)) => names.push(n.to_owned()),
                None if !matches!(f, "plural" | "this" | "nearest" | "other" | "indef" | "") => {
                    qualities.push(f.to_owned());
                }
                _ => {}
            }
        }
    }
    let one = match kind.as_str() {
        "reception" | "front_desk" => "reception_desk",
        "staircase" | "stairwell" => "stairs",
        "lift" => "elevator",
        "corridor" | "hall" => "hallway",
        "toilet" | "restroom" | "ladies_room" | "mens_room" | "washroom" => "bathroom",
        "laboratory" => "lab",
        "canteen" => "cafeteria",
        "photocopier" | "copy_machine" => "copier",
        "store_room" | "storage" => "storage_room",
        "level" | "ground_floor" => "floor",
        k => k,
    };
    let mut all = vec![one.to_owned()];
    if !qualities.is_empty() {
        all.push(format!("{}_{kind}", qualities.join("_")));
    }
    if !names.is_empty() {
        all.push(format!("{}_{kind}", names.join("_")));
    }
    all.extend(names);
    all
}

fn relation(text: &str) -> String {
    let end = text.find('{').unwrap_or(text.len());
    match text[..end].trim() {
        "by" => "near",
        "beside" => "next_to",
        "opposite" | "facing" => "across_from",
        "under" | "underneath" => "below",
        "at_end" | "end_of" => "at_end_of",
        "inside" | "middle_of" => "in",
        "toward" => "towards",
        "after" => "past",
        "upstairs" => "level_up",
        r => r,
    }
    .to_owned()
}

fn act(text: &str) -> Act {
    let text = text.trim();
    let plain = text.split('~').next().unwrap_or_default();
    let end = plain.rfind(')').map_or(plain.len(), |i| i + 1);
    let whole = plain;
    let plain = &plain[..end];
    if let Some(rest) = whole.strip_prefix("route(") {
        let then = rest.split_once("->").map(|(_, t)| Box::new(act(t)));
        return Act::Route(then);
    }
    let Some((name, inner)) = plain.split_once('(').and_then(|(n, r)| Some((n, r.strip_suffix(')')?))) else {
        return if matches!(text, "any" | "last" | "all") { Act::Any } else { Act::Odd(text.to_owned()) };
    };
    let parts = split(inner, ",");
    let part = |i: usize| parts.get(i).map_or("", String::as_str);
    let two = |k| Act::Two(k, head(part(0)), head(part(1)));
    match name {
        "label" => two("label"),
        "alias" => two("alias"),
        "same" => two("same"),
        "other" => two("other"),
        "loc" => {
            Act::Located(head(part(0)), relation(part(1)), parts.iter().skip(2).map(|p| head(p)).collect())
        }
        "attr" => Act::Attribute(head(part(0))),
        "neg" => Act::Not(Box::new(act(inner))),
        "cor" => {
            let was = part(0).contains('(').then(|| Box::new(act(part(0))));
            Act::Mend(was, Box::new(act(part(1))))
        }
        "ask" => {
            let last = parts.last().map_or("", String::as_str);
            let is_act = ["label(", "loc(", "same(", "attr(", "alias("].iter().any(|a| last.starts_with(a));
            Act::Ask(part(0).to_owned(), if is_act { Err(Box::new(act(last))) } else { Ok(head(last)) })
        }
        "gen" => Act::Generic(head(part(0)), relation(part(1)), head(part(2)), part(3).to_owned()),
        _ => Act::Odd(text.to_owned()),
    }
}
