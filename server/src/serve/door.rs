//! The door: what the network delivers is handed to the intake without ever blocking. What finds no room was
//! acknowledged to nobody.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use toponym_proto::answer::{Problem, Sent};
use tracing::error;

use super::board::Board;
use crate::config::ServerConfig;

/// What the network delivers.
pub enum Arrival {
    /// A payload on a key.
    Payload {
        /// The key.
        key: String,
        /// Zenoh's encoding.
        encoding: String,
        /// The bytes; shorter than the limit.
        bytes: Vec<u8>,
    },
    /// A payload too long to be kept.
    TooLarge {
        /// The key.
        key: String,
        /// Its length.
        bytes: usize,
    },
    /// Delete a map, and tell what became of it.
    Delete {
        /// The map.
        map: String,
        /// Where to tell.
        reply: SyncSender<Result<(), Problem>>,
    },
    /// A robot is sent somewhere.
    Goal(Box<Sent>),
    /// The server stops: move on what there is, then end.
    Stop,
}

/// The door: hands arrivals over without ever blocking.
#[derive(Clone)]
pub struct Door {
    queue: SyncSender<Arrival>,
    board: Arc<Board>,
    payload_max_bytes: usize,
    queue_max_bytes: usize,
}

impl Door {
    /// With the queue behind it.
    pub fn new(board: Arc<Board>, config: &ServerConfig) -> (Self, Receiver<Arrival>) {
        let (queue, arrivals) = sync_channel(config.limits.queue_messages);
        let _ = board.control.set(queue.clone());
        let payload_max_bytes = config.limits.payload_bytes;
        (Self { queue, board, payload_max_bytes, queue_max_bytes: config.limits.queue_bytes }, arrivals)
    }

    /// For Zenoh's callbacks.
    pub fn sample(&self, sample: &zenoh::sample::Sample) {
        if sample.kind() != zenoh::sample::SampleKind::Put {
            return;
        }
        let (key, encoding) = (sample.key_expr().to_string(), sample.encoding().to_string());
        self.enter(key, encoding, sample.payload().len(), || sample.payload().to_bytes().into_owned());
    }

    /// Hands over what came on a key, if there is room for it; `payload` is made only then.
    pub fn enter(
        &self,
        key: String,
        encoding: String,
        bytes: usize,
        payload: impl FnOnce() -> Vec<u8>,
    ) -> bool {
        let waiting = self.board.queued_bytes.fetch_add(bytes, Ordering::Relaxed);
        if waiting + bytes > self.queue_max_bytes {
            self.overrun("queue_bytes", bytes);
            return false;
        }
        let arrival = if bytes > self.payload_max_bytes {
            self.board.reach("payload_bytes");
            Arrival::TooLarge { key, bytes }
        } else {
            Arrival::Payload { key, encoding, bytes: payload() }
        };
        let is_in = self.queue.try_send(arrival).is_ok();
        if !is_in {
            self.overrun("queue_messages", bytes);
        }
        is_in
    }

    /// There is no room: what is dropped was acknowledged to nobody.
    fn overrun(&self, limit: &'static str, bytes: usize) {
        self.board.reach(limit);
        self.board.queued_bytes.fetch_sub(bytes, Ordering::Relaxed);
        let overrun = self.board.overrun.fetch_add(1, Ordering::Relaxed) + 1;
        // The first, and then each doubling: a flood must not flood the log.
        if overrun.is_power_of_two() {
            error!(overrun, "messages arrive faster than they can be looked at: dropped, to be sent again");
        }
    }

    /// Tells the intake to end.
    pub fn close(&self) {
        let _ = self.queue.send(Arrival::Stop);
    }
}
