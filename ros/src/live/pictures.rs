//! What RViz, Nav2 and Foxglove show: the map as a grid, rooms and names as markers, what was heard as text.

use super::Shared;
use super::mouth::Speaker;
use crate::msg::{Header, StringMsg, Time};
use crate::plan::kind;
use crate::shown::map_as_shown;
use crate::wire::Qos;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::broadcast::error::RecvError;
use toponym::{Guide, Planner};
use tracing::debug;

/// How long the server may take to draw.
const DRAW_WAIT: Duration = Duration::from_secs(30);
/// Drawing takes no more of the time than one part in so many.
const SHARE: u32 = 20;
/// How often it is looked whether the map has changed.
const LOOK: Duration = Duration::from_millis(500);
/// Until the session ends.
pub async fn publish(shared: Arc<Shared>, speaker: Arc<Speaker>) -> Result<(), String> {
    tokio::try_join!(draw(&shared, &speaker), tell_heard(&shared, &speaker)).map(|_| ())
}

async fn draw(shared: &Shared, speaker: &Speaker) -> Result<(), String> {
    let topic = |name: &'static str, kind| async move {
        speaker.topic(&speaker.named(name), kind, Qos::Latched).await.map_err(|e| e.to_string())
    };
    let grid = topic("/map", kind::GRID).await?;
    let metadata = topic("/map_metadata", kind::GRID_METADATA).await?;
    let markers = topic("/toponym/markers", kind::MARKERS).await?;
    let planner =
        Planner::new(&shared.own, &shared.site, &shared.robot.map, DRAW_WAIT).map_err(|e| e.to_string())?;
    let interval = Duration::from_secs_f64(shared.robot.map_update_interval_s);
    let (mut shown, mut next) = (None, Instant::now());
    loop {
        tokio::time::sleep(LOOK).await;
        let rev = shared.pose.borrow().as_ref().map(|pose| (pose.map.epoch, pose.map.rev));
        if rev.is_none() || rev == shown || Instant::now() < next {
            continue;
        }
        let began = Instant::now();
        match map_as_shown(&planner, &header(shared), shared.robot.resolution_m).await {
            Ok((map, marked)) => {
                shown = rev;
                grid.write(&map).await?;
                metadata.write(&map.info).await?;
                markers.write(&marked).await?;
            }
            Err(e) => debug!(robot = shared.robot.robot, "no map to show: {e}"),
        }
        next = Instant::now() + interval.max(SHARE * began.elapsed());
    }
}

fn header(shared: &Shared) -> Header {
    let stamp_ns = shared.pose.borrow().as_ref().map_or(0, |pose| pose.stamp.ns);
    Header { stamp: Time::from(stamp_ns), frame_id: shared.robot.map_frame.clone() }
}

/// What became of each sentence, in words.
async fn tell_heard(shared: &Shared, speaker: &Speaker) -> Result<(), String> {
    let topic = speaker.topic(&speaker.named("/toponym/heard"), kind::TEXT, Qos::Reliable(10)).await;
    let topic = topic.map_err(|e| e.to_string())?;
    let guide = Guide::connect(&shared.own, &shared.site, Some(&shared.robot.robot)).await;
    let guide = guide.map_err(|e| e.to_string())?;
    let mut feedback = guide.feedback();
    loop {
        match feedback.recv().await {
            Ok(heard) => {
                let why = heard.error.as_ref().map(|problem| problem.message.clone());
                let data = heard.question.clone().or(why).unwrap_or_else(|| heard.words.clone());
                if !data.is_empty() {
                    topic.write(&StringMsg { data }).await?;
                }
            }
            Err(RecvError::Lagged(_)) => {}
            Err(RecvError::Closed) => return Err("feedback has ended".into()),
        }
    }
}
