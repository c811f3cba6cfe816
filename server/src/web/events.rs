//! What happens, as it happens: server-sent events.

use super::Web;
use super::guard::Who;
use axum::Extension;
use axum::body::Bytes;
use axum::extract::State;
use axum::response::sse::{Event as Sent, KeepAlive, Sse};
use futures_util::stream::{Stream, unfold};
use serde_json::json;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;
use toponym_proto::answer::PoseOut;

/// A page shows a robot's pose so often: those between are left out.
const POSE_PERIOD: Duration = Duration::from_millis(500);

/// Nothing happens after it.
pub const LAST_EVENT: &str = "end";

/// Something that happened.
#[derive(Debug)]
pub struct Published {
    /// `pose`, `heard`, `state`, `jump`, `mended`, or `map` for one that has changed.
    pub name: &'static str,
    /// As in PROTOCOL.md; of `mended` what was answered, of `map` its identity.
    pub json: Bytes,
    /// Of which robot or map.
    pub of: String,
}

impl Published {
    /// As much of a pose as can be seen: half of what a page receives in an hour are poses.
    pub fn pose(pose: &PoseOut) -> Self {
        let at = &pose.map_from_body;
        let rounded = |value: f64| (value * 1000.0).round() / 1000.0;
        let seen = json!({
            "robot": pose.robot,
            "map": { "id": pose.map.id, "epoch": pose.map.epoch },
            "map_from_body": { "x_m": rounded(at.x_m), "y_m": rounded(at.y_m), "yaw_rad": rounded(at.yaw_rad) },
            "state": pose.state,
        });
        Self { name: "pose", json: seen.to_string().into(), of: pose.robot.clone() }
    }
}

/// Events from now on. A page that does not read misses some, and slows nobody down.
pub async fn events(
    State(web): State<Arc<Web>>,
    Extension(who): Extension<Who>,
) -> Sse<impl Stream<Item = Result<Sent, Infallible>>> {
    let begin = (web.board.events.subscribe(), BTreeMap::<String, Instant>::new(), who);
    let next = move |(mut events, mut shown, who): (
        Receiver<Arc<Published>>,
        BTreeMap<String, Instant>,
        Who,
    )| async move {
        loop {
            let event = match events.recv().await {
                Ok(event) => event,
                Err(RecvError::Lagged(missed)) => {
                    let told = Sent::default().event("missed").data(missed.to_string());
                    return Some((Ok(told), (events, shown, who)));
                }
                Err(RecvError::Closed) => return None,
            };
            if event.name == LAST_EVENT {
                return None;
            }
            let is_hidden = match event.name {
                "heard" => !who.may_hear(&event.of),
                "pose" | "state" => !who.is_about(&event.of),
                _ => false,
            };
            if is_hidden {
                continue;
            }
            if event.name == "pose" {
                let now = Instant::now();
                if shown.get(&event.of).is_some_and(|last| now - *last < POSE_PERIOD) {
                    continue;
                }
                shown.insert(event.of.clone(), now);
            }
            let json = String::from_utf8_lossy(&event.json);
            return Some((Ok(Sent::default().event(event.name).data(json)), (events, shown, who)));
        }
    };
    Sse::new(unfold(begin, next)).keep_alive(KeepAlive::default())
}
