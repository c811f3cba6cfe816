//! Everything published goes through one bounded queue and one thread, so that a client that does
//! not read can't hold up a map.

use serde::Serialize;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use toponym_proto::codec::ENCODING_JSON;
use tracing::{debug, error, warn};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

use super::board::{Board, MapView, lock};
use super::queries;
use crate::web::Published;

/// Queue length: seconds of poses of a few robots.
const QUEUE: usize = 1024;

enum Parcel {
    Payload { key: String, json: Vec<u8>, prompt: bool },
    Graph(Arc<MapView>),
    Stop,
}

/// Publishes from any thread.
#[derive(Clone)]
pub struct Outbox {
    board: Arc<Board>,
    queue: SyncSender<Parcel>,
}

impl Outbox {
    /// Starts the thread that publishes.
    pub fn start(board: Arc<Board>, session: Session) -> std::io::Result<(Self, JoinHandle<()>)> {
        let (queue, parcels) = sync_channel(QUEUE);
        let outbox = Self { board: board.clone(), queue };
        let thread = std::thread::Builder::new()
            .name("publish".into())
            .spawn(move || publish_all(&board, &session, &parcels))?;
        Ok((outbox, thread))
    }

    /// What the next supersedes (poses): dropped where the network can't follow.
    pub fn stream<T: Serialize>(&self, key: String, value: &T) {
        if let Some(json) = self.keep(&key, value)
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

    /// The graph of a map as it is when its turn comes; false if there is no room now.
    pub fn graph(&self, map: &Arc<MapView>) -> bool {
        self.queue.try_send(Parcel::Graph(map.clone())).is_ok()
    }

    /// Ends the thread once all before is published.
    pub fn stop(&self) {
        let _ = self.queue.send(Parcel::Stop);
    }

    fn keep<T: Serialize>(&self, key: &str, value: &T) -> Option<Vec<u8>> {
        let json = written(key, value)?;
        lock(&self.board.latest).insert(key.into(), json.clone());
        Some(json)
    }
}

fn written<T: Serialize>(key: &str, value: &T) -> Option<Vec<u8>> {
    serde_json::to_vec(value).inspect_err(|e| error!(key, "can't be written as JSON: {e}")).ok()
}

/// Pages get the same, but of a map that has changed only that it has.
fn tell_pages(board: &Board, key: &str, json: &[u8]) {
    let chunks = board.keys.chunks(key).unwrap_or_default();
    let [_, of, "out", what] = chunks[..] else { return };
    let name = match what {
        "pose" => "pose",
        "heard" => "heard",
        "state" => "state",
        "jump" => "jump",
        "graph" => "map",
        _ => return,
    };
    // Nobody looking is no error.
    let _ = board.events.send(Arc::new(Published { name, json: json.to_vec(), of: of.to_owned() }));
}

fn publish_all(board: &Board, session: &Session, parcels: &Receiver<Parcel>) {
    while let Ok(parcel) = parcels.recv() {
        let (key, json, prompt) = match parcel {
            Parcel::Payload { key, json, prompt } => {
                tell_pages(board, &key, &json);
                (key, json, prompt)
            }
            Parcel::Graph(map) => match queries::graph(&map) {
                Ok(json) => {
                    let identity = map.identity(&map.snapshot.load());
                    tell_pages(
                        board,
                        &board.keys.graph(&map.id),
                        &serde_json::to_vec(&identity).unwrap_or_default(),
                    );
                    (board.keys.graph(&map.id), json, false)
                }
                Err(problem) => {
                    error!(map = map.id, "graph: {problem}");
                    continue;
                }
            },
            Parcel::Stop => return,
        };
        // Nobody is waited for: a robot or guide whose connection is full asks or says again. Long answers, which wait,
        // have another queue.
        let put = session.put(&key, json).encoding(ENCODING_JSON).congestion_control(CongestionControl::Drop);
        if let Err(e) = put.priority(Priority::DataHigh).express(prompt).wait() {
            warn!(key, "could not be published: {e}");
        }
    }
}
