//! Answers to `where`, each reckoned once for a snapshot however often it is asked: with how much was said and driven the
//! time for one grows.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use toponym_core::Snapshot;
use toponym_core::answers::query::WhereAnswer;

use super::board::lock;

/// Questions whose answers are kept; beyond, each is reckoned anew.
const KEPT_MAX: usize = 256;
/// While an answer is reckoned one waits for it, and others get that of the snapshot before, some tenths of a second old;
/// so many wait where something was said in between: who has just said it wants to find it.
const WAITING_MAX: usize = 8;

/// What is asked, and in which language.
type Question = (String, Option<String>);

/// A slot and the snapshot that it is from.
type From = (Arc<Snapshot>, Arc<Slot>);

/// What was answered from the newest snapshot that was asked, and before.
#[derive(Default)]
pub struct Answered {
    kept: Mutex<Kept>,
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
    /// How many have asked before it was there.
    waiting: AtomicUsize,
}

impl Answered {
    /// The answer to a question, and the snapshot that it is from.
    pub fn where_is(
        &self,
        snapshot: &Arc<Snapshot>,
        text: &str,
        lang: Option<&str>,
    ) -> (Arc<Snapshot>, WhereAnswer) {
        let answer = || snapshot.where_is(text, lang);
        let (slot, before) = self.slots(snapshot, (text.to_owned(), lang.map(str::to_owned)));
        let Some(slot) = slot else { return (snapshot.clone(), answer()) };
        if slot.answer.get().is_none()
            && let nth = slot.waiting.fetch_add(1, Ordering::Relaxed)
            && let Some((from, answer)) = before
                .filter(|(from, _)| nth >= if from.says_the_same(snapshot) { 1 } else { WAITING_MAX })
                .and_then(|(from, slot)| Some((from, slot.answer.get()?.clone())))
        {
            return (from, answer);
        }
        (snapshot.clone(), slot.answer.get_or_init(answer).clone())
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
    fn one_waits_and_others_get_the_answer_before() {
        let ([first, second], answered) = (snapshots(), Answered::default());
        answered.where_is(&first, "gym", None);
        let slot = answered.slots(&second, ("gym".into(), None)).0.unwrap();
        slot.waiting.store(1, Ordering::Relaxed);
        assert!(Arc::ptr_eq(&answered.where_is(&second, "gym", None).0, &first));
        assert!(Arc::ptr_eq(&answered.where_is(&second, "cafe", None).0, &second), "there is none before");
        slot.answer.set(second.where_is("gym", None)).unwrap();
        assert!(Arc::ptr_eq(&answered.where_is(&second, "gym", None).0, &second));
    }

    #[test]
    fn who_has_said_something_waits_unless_many_do() {
        let mut mapper = Mapper::new(Config::default());
        let (answered, first) = (Answered::default(), mapper.snapshot());
        answered.where_is(&first, "gym", None);
        mapper.step(Event::Glossary("refectory = canteen".into()));
        let second = mapper.snapshot();
        let slot = answered.slots(&second, ("gym".into(), None)).0.unwrap();
        slot.waiting.store(WAITING_MAX, Ordering::Relaxed);
        assert!(Arc::ptr_eq(&answered.where_is(&second, "gym", None).0, &first));
        slot.waiting.store(WAITING_MAX - 1, Ordering::Relaxed);
        assert!(Arc::ptr_eq(&answered.where_is(&second, "gym", None).0, &second));
    }
}
