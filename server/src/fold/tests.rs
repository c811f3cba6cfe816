use super::*;
use toponym_proto::answer::HeardStatus::{Read, Understood};
use toponym_proto::{Clock, End, Header};
use toponym_sim::hall;

const MS: u64 = 1_000_000;

fn fold() -> Fold {
    let config = toponym_core::Config { particles: 2, ..Default::default() };
    let card = Card { uuid: "u".into(), robot: "r1".into(), ..Card::default() };
    Fold::new(Mapper::new(config), card, Duration::from_millis(500))
}

fn header(seq: u64) -> Header {
    let stamp = Stamp { ns: 50_000_000 * seq as i64 };
    Header { robot: "r1".into(), boot: 1, seq, stamp, clock: Clock::Log }
}

fn say(id: &str, text: &str, began_ms: i64) -> Event {
    let say = Say {
        id: id.into(),
        text: text.into(),
        began: Some(Stamp { ns: began_ms * 1_000_000 }),
        ..Say::default()
    };
    Event::Say { boot: 1, say }
}

/// A drive through a hall of 12 m by 6 m, with two sentences, an entry each 50 ms.
fn entries() -> Vec<Entry> {
    let mut events = vec![Event::Message(hall::setup(header(0), "main"))];
    for step in 0..40_u64 {
        let x_m = 1.5 + 0.2 * step as f64;
        events.push(Event::Message(hall::odom(header(2 * step + 1), x_m)));
        events.push(Event::Message(hall::scan(header(2 * step + 2), x_m, 81)));
        match step {
            10 => events.push(say("a", "this is the kitchen", 700)),
            30 => events.push(say("b", "this is the gym", 2_900)),
            _ => {}
        }
    }
    events.push(Event::Message(Message::End(End { header: header(81) })));
    events.extend([Event::Gap { boot: 1, to: 90 }, Event::Tick, Event::Hold(200 * MS)]);
    events.extend(std::iter::repeat_n(Event::Tick, 20));
    (1..).zip(events).map(|(k, event)| Entry { at_ns: 50 * MS * k, event }).collect()
}

/// Folds entries; tells which sentences were heard, and how.
fn take(fold: &mut Fold, entries: impl IntoIterator<Item = Entry>) -> Vec<(String, HeardStatus)> {
    let mut heard = Vec::new();
    for entry in entries {
        fold.take(entry, &mut |outcome| {
            if let Outcome::Heard(h) = outcome {
                heard.push((h.id.clone(), h.status));
            }
        });
    }
    heard
}

#[test]
fn a_checkpoint_and_the_rest_make_the_same_map_to_the_bit() {
    let entries = entries();
    let mut whole = fold();
    take(&mut whole, entries.clone());
    let bytes = whole.save().unwrap();
    assert_eq!((whole.held(), whole.steps(), whole.card.watermark), (0, 84, Some((1, 89))));
    for cut in (0..entries.len()).step_by(7) {
        let mut begun = fold();
        take(&mut begun, entries[..cut].iter().cloned());
        let mut again = Fold::load(&begun.save().unwrap()).unwrap();
        take(&mut again, entries[cut..].iter().cloned());
        assert!(again.save().unwrap() == bytes, "cut at {cut}");
    }
}

#[test]
fn a_sentence_enters_where_it_began() {
    let mut fold = fold();
    let mut entered = Vec::new();
    for entry in entries() {
        fold.take(entry, &mut |outcome| match outcome {
            Outcome::Enters(Message::Say(say)) => entered.push(say.id.clone()),
            Outcome::Enters(message) => entered.extend(message.header().map(|h| h.seq.to_string())),
            _ => {}
        });
    }
    let after = |id: &str| entered[entered.iter().position(|e| e == id).unwrap() - 1].clone();
    // "a" began at .7 s, of which stamp seq 14 is.
    assert_eq!((after("a").as_str(), after("b").as_str()), ("14", "58"));
}

#[test]
fn a_sentence_that_comes_again_is_answered_again_and_counts_once() {
    let mut entries = entries();
    let again = Entry { at_ns: 1_000_000 * MS, event: say("a", "this is the kitchen", 4_000) };
    entries.insert(23, Entry { at_ns: entries[22].at_ns, ..again.clone() });
    entries.push(again);
    let mut fold = fold();
    let heard = take(&mut fold, entries);
    let of_a: Vec<_> = heard.iter().filter(|(id, _)| id == "a").map(|(_, status)| *status).collect();
    assert_eq!(of_a, [Read, Read, Understood, Understood]);
    assert_eq!(fold.steps(), 84);
}

#[test]
fn an_id_means_one_sentence() {
    let mut entries = entries();
    entries.push(Entry { at_ns: 1_000_000 * MS, event: say("a", "this is the lab", 4_000) });
    let heard = take(&mut fold(), entries);
    assert_eq!(heard.last(), Some(&("a".to_owned(), HeardStatus::Refused)));
}

#[test]
fn bytes_that_are_no_fold_are_refused() {
    let bytes = fold().save().unwrap();
    for cut in (0..bytes.len()).step_by(11) {
        assert!(Fold::load(&bytes[..cut]).is_err(), "cut to {cut}");
    }
}
