//! Answers to `where`, each reckoned once for a snapshot however often it is asked: with how much was said of a name the
//! time for one grows.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};
use toponym_core::Snapshot;
use toponym_core::answers::query::WhereAnswer;

use super::board::lock;

/// Questions whose answers are kept; beyond, each is reckoned anew.
const KEPT_MAX: usize = 256;

/// What is asked, and in which language.
type Question = (String, Option<String>);

/// What was answered from the newest snapshot that was asked.
#[derive(Default)]
pub struct Answered {
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    /// Held, so that no other can come to lie at its address.
    from: Option<Arc<Snapshot>>,
    answers: BTreeMap<Question, Arc<OnceLock<WhereAnswer>>>,
}

impl Answered {
    /// The answer to a question. Who asks the same meanwhile waits for it.
    pub fn where_is(&self, snapshot: &Arc<Snapshot>, text: &str, lang: Option<&str>) -> WhereAnswer {
        let answer = || snapshot.where_is(text, lang);
        match self.slot(snapshot, (text.to_owned(), lang.map(str::to_owned))) {
            Some(slot) => slot.get_or_init(answer).clone(),
            None => answer(),
        }
    }

    /// Where its answer is kept; none if there are too many.
    fn slot(&self, snapshot: &Arc<Snapshot>, question: Question) -> Option<Arc<OnceLock<WhereAnswer>>> {
        let mut kept = lock(&self.kept);
        if !kept.from.as_ref().is_some_and(|from| Arc::ptr_eq(from, snapshot)) {
            *kept = Kept { from: Some(snapshot.clone()), answers: BTreeMap::new() };
        }
        if kept.answers.len() >= KEPT_MAX && !kept.answers.contains_key(&question) {
            return None;
        }
        Some(kept.answers.entry(question).or_default().clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_core::{Config, Mapper};

    #[test]
    fn an_answer_is_kept_for_its_snapshot_and_there_is_a_bound() {
        let mapper = Mapper::new(Config::default());
        let (first, second) = (Arc::new(mapper.snapshot()), Arc::new(mapper.snapshot()));
        let answered = Answered::default();
        let slot = |from, text: &str| answered.slot(from, (text.to_owned(), None));
        let gym = slot(&first, "gym").unwrap();
        assert!(Arc::ptr_eq(&gym, &slot(&first, "gym").unwrap()));
        assert!(!Arc::ptr_eq(&gym, &slot(&second, "gym").unwrap()), "another snapshot, another answer");
        for k in 1..KEPT_MAX {
            assert!(slot(&second, &k.to_string()).is_some());
        }
        assert!(slot(&second, "one more").is_none() && slot(&second, "gym").is_some());
        assert_eq!(answered.where_is(&second, "one more", None).via, "unknown");
    }
}
