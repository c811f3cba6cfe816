//! Of the order of sentences and messages.

use super::*;
use crate::stream::{End, Header, Odom, Pose};
use proptest::prelude::*;

const HOLD: Duration = Duration::from_millis(500);

fn odom(seq: u64, ns: i64) -> Message {
    odom_of(0, seq, ns)
}

fn odom_of(boot: u64, seq: u64, ns: i64) -> Message {
    let header = Header { robot: "r1".into(), boot, seq, stamp: Stamp { ns }, ..Default::default() };
    Message::Odom(Odom { header, odom_from_body: Pose::default() })
}

fn say(id: usize, ns: i64) -> Say {
    Say { id: format!("s{id}"), text: "gym".into(), began: Some(Stamp { ns }), ..Default::default() }
}

/// The rule, word by word.
fn by_the_rule(stream: &[Message], mut says: Vec<Say>) -> Vec<Message> {
    says.sort_by_key(|s| (s.began, s.id.clone()));
    let mut slots: Vec<Vec<Message>> = vec![Vec::new(); stream.len() + 1];
    for say in says {
        let slot = stream.iter().position(|m| Some(order_stamp(m)) > say.began).unwrap_or(stream.len());
        slots[slot].push(Message::Say(say));
    }
    let mut all = slots.remove(0);
    for (m, slot) in stream.iter().zip(slots) {
        all.push(m.clone());
        all.extend(slot);
    }
    all
}

fn offline(stream: &[Message], says: Vec<Say>) -> Vec<Message> {
    let mut sentences = Sentences::default();
    for s in says {
        sentences.push(s, Stamp::default());
    }
    let mut all = Vec::new();
    for m in stream {
        while let Some(s) = sentences.pop_before(order_stamp(m)) {
            all.push(Message::Say(s));
        }
        all.push(m.clone());
    }
    while let Some(s) = sentences.pop() {
        all.push(Message::Say(s));
    }
    all
}

fn drain(hold: &mut HoldBack, now: Duration, into: &mut Vec<Message>) {
    while let Some(m) = hold.pop(now) {
        into.push(m);
    }
}

proptest! {
    #[test]
    fn offline_follows_the_rule(
        stamps in prop::collection::vec(0..30_i64, 0..20),
        begans in prop::collection::vec(-3..33_i64, 0..8),
    ) {
        let stream: Vec<_> = stamps.iter().enumerate().map(|(i, s)| odom(i as u64, *s)).collect();
        let says: Vec<_> = begans.iter().enumerate().map(|(i, b)| say(i, *b)).collect();
        prop_assert_eq!(offline(&stream, says.clone()), by_the_rule(&stream, says));
    }

    /// Each sentence arrives anywhere from before its place up to a hold after it: the
    /// networked order is the offline one.
    #[test]
    fn online_equals_offline_within_the_hold(
        steps in prop::collection::vec((-2..5_i64, 0..400_u64), 1..30),
        begans in prop::collection::vec((0.0..1.0_f64, -400..499_i64), 0..6),
    ) {
        let (mut stamp, mut clock_ms) = (0, 1000);
        let mut arrivals = Vec::new();
        for (i, (ds, dt)) in steps.iter().enumerate() {
            (stamp, clock_ms) = (stamp + ds, clock_ms + dt);
            arrivals.push((clock_ms, odom(i as u64, stamp)));
        }
        let end = Header { robot: "r1".into(), seq: 99, ..Default::default() };
        arrivals.push((clock_ms + 400, Message::End(End { header: end })));
        let stream: Vec<_> = arrivals.iter().map(|a| a.1.clone()).collect();
        let says: Vec<_> = begans.iter().enumerate().map(|(i, (share, _))| say(i, (share * stamp as f64) as i64)).collect();
        // The message before which a sentence enters, and its arrival there.
        let mut all: Vec<(u64, usize, Message)> = arrivals.iter().cloned().enumerate().map(|(i, (t, m))| (t, i, m)).collect();
        for (s, (_, late_ms)) in says.iter().zip(&begans) {
            let slot = stream.iter().position(|m| Some(order_stamp(m)) > s.began).unwrap();
            let at = arrivals[slot].0.saturating_add_signed(*late_ms);
            all.push((at, usize::MAX, Message::Say(s.clone())));
        }
        all.sort_by_key(|(t, i, _)| (*t, *i));
        let (mut hold, mut got) = (HoldBack::new(HOLD, None), Vec::new());
        for (t, _, m) in all {
            let now = Duration::from_millis(t);
            match m {
                Message::Say(s) => hold.push_say(now, 0, s),
                m => hold.push(now, m),
            }
            drain(&mut hold, now, &mut got);
        }
        drain(&mut hold, Duration::MAX, &mut got);
        prop_assert_eq!(got, offline(&stream, says));
    }
}

#[test]
fn a_message_is_held_and_then_let_go() {
    let mut hold = HoldBack::new(HOLD, None);
    hold.push(Duration::from_secs(1), odom(0, 5));
    assert_eq!(hold.pop(Duration::from_millis(1499)), None);
    assert_eq!(hold.pop(Duration::from_millis(1500)), Some(odom(0, 5)));
    assert!(hold.is_empty());
}

#[test]
fn a_late_sentence_enters_at_once() {
    let mut hold = HoldBack::new(HOLD, None);
    hold.push(Duration::ZERO, odom(0, 5));
    assert!(hold.pop(HOLD).is_some());
    hold.push(HOLD, odom(1, 6));
    hold.push_say(HOLD, 0, say(0, 4));
    assert_eq!(hold.pop(HOLD), Some(Message::Say(say(0, 4))));
}

#[test]
fn a_sentence_ahead_of_a_silent_stream_enters_in_the_end() {
    let mut hold = HoldBack::new(HOLD, None);
    hold.push_say(Duration::ZERO, 0, say(0, 100));
    assert_eq!(hold.pop(HOLD), None);
    assert_eq!(hold.pop(HOLD * HoldBack::PATIENCE), Some(Message::Say(say(0, 100))));
}

#[test]
fn a_sentence_said_to_a_quiet_robot_waits_one_hold() {
    let mut hold = HoldBack::new(HOLD, None);
    hold.push(Duration::ZERO, odom(0, 7));
    assert!(hold.pop(HOLD).is_some());
    hold.push_say(HOLD * 8, 0, Say { began: None, ..say(0, 0) });
    assert_eq!(hold.pop(HOLD * 8), None);
    assert_eq!(hold.pop(HOLD * 9), Some(Message::Say(say(0, 7))));
}

#[test]
fn a_sentence_without_a_time_is_said_now() {
    let mut hold = HoldBack::new(HOLD, None);
    hold.push(Duration::ZERO, odom(0, 7));
    hold.push_say(Duration::ZERO, 0, Say { began: None, ..say(0, 0) });
    let mut got = Vec::new();
    drain(&mut hold, Duration::MAX, &mut got);
    assert_eq!(got, [odom(0, 7), Message::Say(say(0, 7))]);
}

#[test]
fn a_stream_that_goes_on_lends_its_time() {
    let mut hold = HoldBack::new(HOLD, Some((0, Stamp { ns: 70 })));
    hold.push_say(Duration::ZERO, 0, say(0, 60));
    assert_eq!(hold.pop(Duration::ZERO), Some(Message::Say(say(0, 60))));
    hold.push_say(Duration::ZERO, 0, Say { began: None, ..say(1, 0) });
    assert_eq!(hold.pop(Duration::MAX), Some(Message::Say(say(1, 70))));
}

#[test]
fn the_end_comes_after_all_that_was_said() {
    let end = || Message::End(End { header: Header { robot: "r1".into(), ..Default::default() } });
    let mut hold = HoldBack::new(HOLD, None);
    hold.push(Duration::ZERO, odom(0, 7));
    hold.push(Duration::ZERO, end());
    hold.push_say(Duration::ZERO, 0, say(0, 1_000_000));
    let mut got = Vec::new();
    drain(&mut hold, HOLD, &mut got);
    assert_eq!(got, [odom(0, 7), Message::Say(say(0, 1_000_000)), end()]);
}

#[test]
fn a_sentence_far_ahead_of_a_stream_that_goes_on_is_heard() {
    let (mut hold, mut heard_at) = (HoldBack::new(HOLD, None), None);
    hold.push_say(HOLD, 0, say(0, 1_000_000));
    for i in 0..30 {
        let now = HOLD * i;
        hold.push(now, odom(i.into(), i.into()));
        while let Some(m) = hold.pop(now) {
            heard_at = heard_at.or(matches!(m, Message::Say(_)).then_some(i));
        }
    }
    // Its patience ends at 11 holds; what came until then goes out before it.
    assert_eq!(heard_at, Some(11));
}

#[test]
fn a_backlog_costs_no_sentence_its_place() {
    let mut hold = HoldBack::new(HOLD, None);
    for i in 0..3 {
        hold.push(Duration::ZERO, odom(i, i as i64));
    }
    hold.push_say(HOLD, 0, say(0, 3));
    hold.push_say(HOLD, 0, say(1, 4));
    hold.push(HOLD * 2, odom(3, 4));
    // The one sentence has its place, the other is ahead; both have waited long.
    let mut got = Vec::new();
    drain(&mut hold, HOLD * 100, &mut got);
    let stream: Vec<_> = (0..3).map(|i| odom(i, i as i64)).chain([odom(3, 4)]).collect();
    assert_eq!(got, offline(&stream, vec![say(0, 3), say(1, 4)]));
}

#[test]
fn sentences_do_not_pile_up() {
    let mut hold = HoldBack::new(HOLD, None);
    hold.push(Duration::ZERO, odom(0, 0));
    for i in 0..HoldBack::SENTENCES_MAX {
        hold.push_say(HOLD / 2, 0, say(i, 1_000_000 - i as i64));
    }
    assert_eq!((hold.pop(HOLD / 2), hold.len()), (None, 1));
    hold.push_say(HOLD * 3 / 4, 0, say(5000, 0));
    let first = hold.pop(HOLD * 3 / 4);
    assert!(matches!(first, Some(Message::Say(say)) if say.id != "s5000"));
    assert_eq!((hold.pop(HOLD * 3 / 4), hold.sentences()), (None, HoldBack::SENTENCES_MAX));
}

#[test]
fn a_new_boot_has_a_clock_of_its_own() {
    let mut hold = HoldBack::new(HOLD, Some((1, Stamp { ns: 9000 })));
    hold.push(Duration::ZERO, odom_of(1, 7, 9500));
    hold.push(Duration::ZERO, odom_of(2, 0, 0));
    hold.push_say(Duration::ZERO, 2, say(0, 15));
    hold.push_say(Duration::ZERO, 2, Say { began: None, ..say(1, 0) });
    for seq in 1..4 {
        hold.push(Duration::ZERO, odom_of(2, seq, seq as i64 * 10));
    }
    let mut got = Vec::new();
    drain(&mut hold, HOLD, &mut got);
    let (now, later) = (Message::Say(say(1, 0)), Message::Say(say(0, 15)));
    let old = [odom_of(1, 7, 9500), odom_of(2, 0, 0), now, odom_of(2, 1, 10), later];
    assert_eq!(got, [&old[..], &[odom_of(2, 2, 20), odom_of(2, 3, 30)]].concat());
}

#[test]
fn what_is_held_goes_on_when_it_was_written_down() {
    let mut hold = HoldBack::new(HOLD, None);
    for seq in 0..6 {
        hold.push(HOLD * seq as u32 / 8, odom_of(1, seq, seq as i64 * 10));
    }
    for (id, began) in [(0, 15), (1, 15), (2, 500)] {
        hold.push_say(HOLD / 2, 1, say(id, began));
    }
    let _ = hold.pop(HOLD);
    let mut again = HoldBack::of(&hold.held().unwrap()).unwrap();
    let (mut got, mut got_again) = (Vec::new(), Vec::new());
    for now in [HOLD, HOLD * 3 / 2, HOLD * 30] {
        drain(&mut hold, now, &mut got);
        drain(&mut again, now, &mut got_again);
        assert_eq!(got, got_again);
    }
    assert_eq!(got.len(), 8);
}
