//! Long answers, each written once for a state of the map however many ask for it, and held once however slowly they read.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};
use toponym_core::Snapshot;
use toponym_proto::answer::Problem;

use super::board::lock;
use super::queries::Reply;

/// Answers that are kept, such as grids of different cells; beyond, each is written anew.
const KEPT_MAX: usize = 4;

type Slot = Arc<OnceLock<Result<Reply, Problem>>>;

/// What was answered from the newest snapshot that was asked.
#[derive(Default)]
pub struct Written(Mutex<Kept>);

#[derive(Default)]
struct Kept {
    /// Held, so that no other can come to lie at its address.
    from: Option<Arc<Snapshot>>,
    answers: BTreeMap<String, Slot>,
}

impl Written {
    /// The answer to `what`; who comes while it is being written waits for it.
    ///
    /// # Errors
    /// Those of `write`.
    pub fn of(
        &self,
        snapshot: &Arc<Snapshot>,
        what: &str,
        write: impl FnOnce() -> Result<Reply, Problem>,
    ) -> Result<Reply, Problem> {
        match self.slot(snapshot, what) {
            Some(slot) => slot.get_or_init(write).clone(),
            None => write(),
        }
    }

    fn slot(&self, snapshot: &Arc<Snapshot>, what: &str) -> Option<Slot> {
        let Kept { from, answers } = &mut *lock(&self.0);
        if !from.as_ref().is_some_and(|from| Arc::ptr_eq(from, snapshot)) {
            answers.clear();
            *from = Some(snapshot.clone());
        }
        let has_room = answers.len() < KEPT_MAX || answers.contains_key(what);
        has_room.then(|| answers.entry(what.to_owned()).or_default().clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_core::{Config, Mapper};

    #[test]
    fn an_answer_is_written_once_for_its_snapshot_and_there_is_a_bound() {
        let mapper = Mapper::new(Config::default());
        let (first, second, written) = (mapper.snapshot(), mapper.snapshot(), Written::default());
        let count = std::cell::Cell::new(0);
        let ask = |from, what: &str| {
            let reply = written.of(from, what, || {
                count.set(count.get() + 1);
                Ok(Reply::json(vec![1]))
            });
            assert_eq!(reply.unwrap().payload.as_ref(), [1]);
            count.get()
        };
        assert_eq!((ask(&first, "graph"), ask(&first, "graph"), ask(&first, "grid")), (1, 1, 2));
        assert_eq!((ask(&second, "graph"), ask(&second, "graph")), (3, 3), "another snapshot");
        for k in 1..KEPT_MAX {
            ask(&second, &k.to_string());
        }
        let before = count.get();
        assert_eq!((ask(&second, "more"), ask(&second, "more")), (before + 1, before + 2));
        assert_eq!(ask(&second, "graph"), before + 2);
    }
}
