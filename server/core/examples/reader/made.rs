//! Sentences of our own making: templates with readings, filled with names, relations, things and people.

use toponym_core::language::Name;
use toponym_core::language::reader::lexicon::{Implied, lexicon};

const TEMPLATES: &str = include_str!("../../lexicon/english/sentences.txt");
const PLACES: &str = include_str!("../../lexicon/english/places.txt");
const THINGS: &str = "printer fridge microwave first aid kit|bins|bikes|kettle|whiteboard|piano|spare chairs|fire extinguisher|\
    sofa|photocopier|milk|keys|ladder|fish tank|vending machine|projector|coats|parcels|dishwasher|safe|paint|wheelchairs";
const PEOPLE: &str = "nick|anna|the dean|kofi|dr patel|maria|the head teacher|priya|my boss|professor lin|sven|the nurse|tom|aisha";
const QUALITIES: &str = "closed|locked|noisy|dark|cold|busy|empty|out of order|off limits|flooded|haunted|cramped|open to everyone|\
    very quiet|full|under repair|being painted|too hot|for staff only|wheelchair accessible|dusty|freezing|huge";
const BEFORE: &str = "so|ok|okay|right|and|now|well|listen|hey robot|alright everyone|by the way|um|ok folks|right then|also|\
    excuse me|please|hello|yeah|as i said|let me see|oh|look";
const AFTER: &str = "please|thanks|mind your step|as you can see|okay|mate|you know|by the way|folks|everyone|i think|of course|\
    too|as well|sir|if you remember|careful on the step";

/// A die that falls alike each time.
pub struct Die(u64);

impl Die {
    fn roll(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % n.max(1)
    }

    fn of<'a>(&mut self, list: &'a str, by: char) -> &'a str {
        let n = list.split(by).count();
        list.split(by).nth(self.roll(n)).unwrap_or_default().trim()
    }
}

/// Sentences with their readings: each template so often.
pub fn sentences(times: usize) -> Vec<(String, String)> {
    let mut die = Die(2013);
    let mut all = Vec::new();
    for line in TEMPLATES.lines().filter(|l| !l.starts_with('#')) {
        let Some((reading, ways)) = line.split_once(" : ") else { continue };
        for way in ways.split(" | ") {
            for _ in 0..times {
                all.push(filled(reading, way, &mut die));
            }
        }
    }
    all
}

fn filled(reading: &str, way: &str, die: &mut Die) -> (String, String) {
    let names: Vec<String> =
        (0..4).map(|_| die.of(PLACES.split_once('\n').map_or("", |p| p.1), ';').to_owned()).collect();
    let relation = |die: &mut Die, implied: bool| loop {
        let all = lexicon().all_relations();
        let said = all[die.roll(all.len())];
        let odd = matches!(said.relation.notation(), "contains" | "between" | "to" | "on_level");
        let pointer = !matches!(said.implied, Some(Implied::Corner));
        if said.implied.is_some() == implied && !odd && pointer {
            return said;
        }
    };
    let (r, r2) = (relation(die, false), relation(die, false));
    let (i, i2) = (relation(die, true), relation(die, true));
    let landmark = |said: &toponym_core::language::reader::lexicon::Said| match said.implied {
        Some(Implied::Pointer(p)) => format!("{p:?}").to_lowercase(),
        _ => String::new(),
    };
    let mut text: Vec<String> = Vec::new();
    for word in way.split(' ') {
        let (bare, owned) = word.strip_suffix("'s").map_or((word, ""), |w| (w, "'s"));
        let bare = bare.trim_matches(['(', ')']);
        if word.starts_with('(') && die.roll(2) == 0 {
            continue;
        }
        let said = match bare {
            "N" => names[0].clone(),
            "M" => names[1].clone(),
            "K" => names[2].clone(),
            "M2" => names[3].clone(),
            "R" => r.words.join(" "),
            "R2" => r2.words.join(" "),
            "I" => i.words.join(" "),
            "I2" => i2.words.join(" "),
            "T" => die.of(THINGS, '|').to_owned(),
            "W" => die.of(PEOPLE, '|').to_owned(),
            "Q" => die.of(QUALITIES, '|').to_owned(),
            other => other.to_owned(),
        };
        text.push(said + owned);
    }
    let head = |name: &str| Name::new(name).map_or_else(|| name.to_owned(), |n| n.as_str().replace(' ', "_"));
    let mut parse = String::new();
    let mut at = 0;
    let bytes: Vec<char> = reading.chars().collect();
    while at < bytes.len() {
        let word: String = bytes[at..].iter().take_while(|c| c.is_alphanumeric()).collect();
        if word.is_empty() {
            parse.push(bytes[at]);
            at += 1;
            continue;
        }
        at += word.len();
        let said = match word.as_str() {
            "N" => head(&names[0]),
            "M" => head(&names[1]),
            "K" => head(&names[2]),
            "M2" => head(&names[3]),
            "R" => r.relation.notation().to_owned(),
            "R2" => r2.relation.notation().to_owned(),
            "I" => format!("{},{}", i.relation.notation(), landmark(i)),
            "I2" => format!("{},{}", i2.relation.notation(), landmark(i2)),
            "T" | "W" | "Q" => "so".to_owned(),
            _ => word,
        };
        parse.push_str(&said);
    }
    let question = reading.starts_with("ask");
    let mut text = text.join(" ");
    if die.roll(10) < 3 {
        text = format!("{} {text}", die.of(BEFORE, '|'));
    }
    if die.roll(10) < 2 && !question {
        text = format!("{text} {}", die.of(AFTER, '|'));
    }
    match die.roll(10) {
        0 => text = text.to_uppercase(),
        1..=4 => {
            text = text[..1].to_uppercase() + &text[1..] + if question { "?" } else { "." };
        }
        _ => {}
    }
    (text, parse)
}
