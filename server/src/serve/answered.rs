//! Answers to `where`, each reckoned once for a snapshot however often it is asked: with how much was said and driven the
//! time for one grows.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use toponym_core::Snapshot;
use toponym_core::answers::query::WhereAnswer;

use super::aside;
use super::board::lock;

/// Questions whose answers are kept; beyond, each is reckoned anew.
const KEPT_MAX: usize = 256;
/// While an answer is reckoned others get that of the snapshot before, some tenths of a second old. Who has just said
/// something wants to find it, and waits: so many at first …
const WAITING_MAX: u64 = 8;
/// … and then one in so many who ask.
const WAITS_ONE_IN: u64 = 200;
/// How many are asked until half of them are forgotten.
const REMEMBERED: u64 = 4000;

/// What is asked, and in which language.
type Question = (String, Option<String>);

/// A slot and the snapshot that it is from.
type From = (Arc<Snapshot>, Arc<Slot>);

/// What was answered from the newest snapshot that was asked, and before.
#[derive(Default)]
pub struct Answered {
    kept: Mutex<Kept>,
    waits: Mutex<Waits>,
}

/// How many have asked of late, and how many of them were made to wait.
#[derive(Default)]
struct Waits {
    asked: u64,
    waited: u64,
}

impl Waits {
    /// Whether one more may be made to wait.
    fn more(&mut self) -> bool {
        if self.asked >= REMEMBERED {
            (self.asked, self.waited) = (self.asked / 2, self.waited / 2);
        }
        self.asked += 1;
        let may = self.waited * WAITS_ONE_IN < self.asked + WAITING_MAX * WAITS_ONE_IN;
        self.waited += u64::from(may);
        may
    }
}

#[derive(Default)]
struct Kept {
    /// Held, so that no other can come to lie at its address.
    from: Option<Arc<Snapshot>>,
    answers: BTreeMap<Question, Arc<Slot>>,
    /// The newest answers from snapshots before, to what was asked of the last of them.
    before: BTreeMap<Question, From>,
}

#[derive(Default)]
struct Slot {
    answer: OnceLock<WhereAnswer>,
    /// Whether somebody reckons it.
    begun: AtomicBool,
}

impl Answered {
    /// The answer to a question, and the snapshot that it is from.
    pub fn where_is(
        &self,
        snapshot: &Arc<Snapshot>,
        text: &str,
        lang: Option<&str>,
    ) -> (Arc<Snapshot>, WhereAnswer) {
        let (slot, before) = self.slots(snapshot, (text.to_owned(), lang.map(str::to_owned)));
        let Some(slot) = slot else { return (snapshot.clone(), snapshot.where_is(text, lang)) };
        if let Some(answer) = slot.answer.get() {
            lock(&self.waits).asked += 1;
            return (snapshot.clone(), answer.clone());
        }
        // What is told of a robot that is lost, or found, is another thing.
        let before = before.filter(|(from, _)| from.state() == snapshot.state());
        let before = before.and_then(|(from, slot)| Some((from, slot.answer.get()?.clone())));
        if let Some((from, answer)) = before
            && (from.says_the_same(snapshot) || !lock(&self.waits).more())
        {
            if !slot.begun.swap(true, Ordering::Relaxed) {
                let (text, lang) = (text.to_owned(), lang.map(str::to_owned));
                let (snapshot, slot) = (Arc::downgrade(snapshot), Arc::downgrade(&slot));
                // By the time that its turn comes there may be another snapshot, and nobody wants it.
                aside::ahead(move || {
                    if let (Some(snapshot), Some(slot)) = (snapshot.upgrade(), slot.upgrade()) {
                        slot.answer.get_or_init(|| snapshot.where_is(&text, lang.as_deref()));
                    }
                });
            }
            return (from, answer);
        }
        (snapshot.clone(), slot.answer.get_or_init(|| snapshot.where_is(text, lang)).clone())
    }

    /// Where its answer is kept, none if there are too many; and the newest one from before.
    fn slots(&self, snapshot: &Arc<Snapshot>, question: Question) -> (Option<Arc<Slot>>, Option<From>) {
        let mut kept = lock(&self.kept);
        if !kept.from.as_ref().is_some_and(|from| Arc::ptr_eq(from, snapshot)) {
            kept.turn(snapshot);
        }
        let old = kept.before.get(&question).cloned();
        if kept.answers.len() >= KEPT_MAX && !kept.answers.contains_key(&question) {
            return (None, old);
        }
        (Some(kept.answers.entry(question).or_default().clone()), old)
    }
}

impl Kept {
    /// From now on answers are from another snapshot.
    fn turn(&mut self, snapshot: &Arc<Snapshot>) {
        let (from, answers) = (self.from.replace(snapshot.clone()), std::mem::take(&mut self.answers));
        self.before.retain(|question, _| answers.contains_key(question));
        if let Some(from) = from {
            let ready = answers.into_iter().filter(|(_, slot)| slot.answer.get().is_some());
            self.before.extend(ready.map(|(question, slot)| (question, (from.clone(), slot))));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_core::{Config, Event, Mapper};

    fn snapshots() -> [Arc<Snapshot>; 2] {
        let mapper = Mapper::new(Config::default());
        [mapper.snapshot(), mapper.snapshot()]
    }

    #[test]
    fn an_answer_is_kept_for_its_snapshot_and_there_is_a_bound() {
        let ([first, second], answered) = (snapshots(), Answered::default());
        let slot = |from, text: &str| answered.slots(from, (text.to_owned(), None)).0;
        let gym = slot(&first, "gym").unwrap();
        assert!(Arc::ptr_eq(&gym, &slot(&first, "gym").unwrap()));
        assert!(!Arc::ptr_eq(&gym, &slot(&second, "gym").unwrap()), "another snapshot, another answer");
        for k in 1..KEPT_MAX {
            assert!(slot(&second, &k.to_string()).is_some());
        }
        assert!(slot(&second, "one more").is_none() && slot(&second, "gym").is_some());
        assert_eq!(answered.where_is(&second, "one more", None).1.via, "unknown");
    }

    #[test]
    fn nobody_waits_where_nothing_was_said_and_the_next_have_it() {
        let ([first, second], answered) = (snapshots(), Answered::default());
        answered.where_is(&first, "gym", None);
        assert!(Arc::ptr_eq(&answered.where_is(&second, "gym", None).0, &first));
        assert!(Arc::ptr_eq(&answered.where_is(&second, "cafe", None).0, &second), "there is none before");
        answered.slots(&second, ("gym".into(), None)).0.unwrap().answer.wait();
        assert!(Arc::ptr_eq(&answered.where_is(&second, "gym", None).0, &second));
    }

    #[test]
    fn who_has_said_something_waits_unless_many_do() {
        let (mut mapper, answered) = (Mapper::new(Config::default()), Answered::default());
        let mut last = mapper.snapshot();
        answered.where_is(&last, "gym", None);
        let mut found = 0;
        for k in 0..2 * WAITING_MAX {
            mapper.step(Event::Glossary(format!("refectory = canteen{k}")));
            let next = mapper.snapshot();
            let (from, _) = answered.where_is(&next, "gym", None);
            found += u64::from(Arc::ptr_eq(&from, &next));
            assert!(Arc::ptr_eq(&from, &next) || Arc::ptr_eq(&from, &last));
            answered.slots(&next, ("gym".into(), None)).0.unwrap().answer.wait();
            last = next;
        }
        assert_eq!(found, WAITING_MAX + 1, "the first, and one of those who asked since");
    }

    #[test]
    fn of_many_few_wait() {
        let mut waits = Waits::default();
        let waited = (0..10 * REMEMBERED).filter(|_| waits.more()).count() as u64;
        assert!(waited < 10 * REMEMBERED / 100, "{waited}: one in a hundred");
        // After a quiet time the next may wait again.
        (0..WAITS_ONE_IN * 2).for_each(|_| waits.asked += 1);
        assert!(waits.more());
    }
}
