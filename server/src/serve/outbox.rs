//! What is published goes through one bounded queue and one thread, so that a client that does not read can't hold up a map;
//! graphs, which are long, go by a thread that gives way.

use axum::body::Bytes;
use serde::Serialize;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use toponym_proto::answer::PoseOut;
use toponym_proto::codec::ENCODING_JSON;
use tracing::{debug, error, warn};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

use super::aside;
use super::board::{Board, MapView, lock};
use super::queries;
use crate::web::Published;

/// Queue length: seconds of poses of a few robots.
const QUEUE: usize = 1024;

enum Parcel {
    Payload { key: String, json: Bytes, prompt: bool },
    Stop,
}

/// Publishes from any thread.
#[derive(Clone)]
pub struct Outbox {
    board: Arc<Board>,
    session: Session,
    queue: SyncSender<Parcel>,
}

impl Outbox {
    /// Starts the thread that publishes.
    pub fn start(board: Arc<Board>, session: Session) -> std::io::Result<(Self, JoinHandle<()>)> {
        let (queue, parcels) = sync_channel(QUEUE);
        let outbox = Self { board: board.clone(), session: session.clone(), queue };
        let thread = std::thread::Builder::new()
            .name("publish".into())
            .spawn(move || publish_all(&board, &session, &parcels))?;
        Ok((outbox, thread))
    }

    /// What the next supersedes: dropped where the network can't follow.
    pub fn pose(&self, pose: &PoseOut) {
        if self.board.events.receiver_count() > 0 {
            let _ = self.board.events.send(Arc::new(Published::pose(pose)));
        }
        let key = self.board.keys.pose(&pose.robot);
        if let Some(json) = self.keep(&key, pose)
            && let Err(TrySendError::Full(_)) =
                self.queue.try_send(Parcel::Payload { key, json, prompt: false })
        {
            debug!("publishing falls behind: a pose is left out");
        }
    }

    /// What others wait for (feedback, states): waits for room here.
    pub fn send<T: Serialize>(&self, key: String, value: &T) {
        if let Some(json) = self.keep(&key, value) {
            // An error means that the server stops.
            let _ = self.queue.send(Parcel::Payload { key, json, prompt: true });
        }
    }

    /// What others wait for but concerns nobody who comes later.
    pub fn tell<T: Serialize>(&self, key: String, value: &T) {
        if let Some(json) = written(&key, value) {
            let _ = self.queue.send(Parcel::Payload { key, json, prompt: true });
        }
    }

    /// The graph of a map as it is when its turn comes; false if one is on its way. By another thread: poses do not wait for
    /// it.
    pub fn graph(&self, map: &Arc<MapView>) -> bool {
        if map.graph_waits.swap(true, Ordering::AcqRel) {
            return false;
        }
        let (outbox, map) = (self.clone(), map.clone());
        aside::ahead(move || {
            map.graph_waits.store(false, Ordering::Release);
            if outbox.board.stopped.load(Ordering::Acquire) {
                return;
            }
            map.snapshot.load().count_ahead();
            let key = outbox.board.keys.graph(&map.id);
            match queries::graph(&map) {
                Ok(reply) => {
                    let identity = map.identity(&map.snapshot.load());
                    let json = serde_json::to_vec(&identity).unwrap_or_default().into();
                    // Nobody looking is no error.
                    let _ = outbox.board.events.send(Arc::new(Published {
                        name: "map",
                        json,
                        of: map.id.clone(),
                    }));
                    // Before one that is as long as many messages is dropped, Zenoh waits for who reads slowly: here, and
                    // in a queue that is not that of poses.
                    publish(&outbox.session, &key, reply.payload, Priority::Data, false);
                }
                Err(problem) => error!(map = map.id, "graph: {problem}"),
            }
        });
        true
    }

    /// Ends the thread once all before is published.
    pub fn stop(&self) {
        let _ = self.queue.send(Parcel::Stop);
    }

    fn keep<T: Serialize>(&self, key: &str, value: &T) -> Option<Bytes> {
        let json = written(key, value)?;
        lock(&self.board.latest).insert(key.into(), json.clone());
        Some(json)
    }
}

fn written<T: Serialize>(key: &str, value: &T) -> Option<Bytes> {
    let json = serde_json::to_vec(value).inspect_err(|e| error!(key, "can't be written as JSON: {e}"));
    json.ok().map(Bytes::from)
}

/// Pages get the same, but poses.
fn tell_pages(board: &Board, key: &str, json: &Bytes) {
    let chunks = board.keys.chunks(key).unwrap_or_default();
    let [_, of, "out", what] = chunks[..] else { return };
    let name = match what {
        "heard" => "heard",
        "state" => "state",
        "jump" => "jump",
        _ => return,
    };
    // Nobody looking is no error.
    let _ = board.events.send(Arc::new(Published { name, json: json.clone(), of: of.to_owned() }));
}

fn publish_all(board: &Board, session: &Session, parcels: &Receiver<Parcel>) {
    while let Ok(parcel) = parcels.recv() {
        let Parcel::Payload { key, json, prompt } = parcel else { return };
        tell_pages(board, &key, &json);
        publish(session, &key, json, Priority::DataHigh, prompt);
    }
}

/// Nobody is waited for: a robot or guide whose connection is full asks or says again. Long answers, which wait, have
/// another queue.
fn publish(session: &Session, key: &str, json: Bytes, priority: Priority, prompt: bool) {
    let put = session.put(key, json).encoding(ENCODING_JSON).congestion_control(CongestionControl::Drop);
    if let Err(e) = put.priority(priority).express(prompt).wait() {
        warn!(key, "could not be published: {e}");
    }
}
