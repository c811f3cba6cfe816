//! What RViz, Nav2 and Foxglove show: the map as a grid, rooms and names as markers, what was heard as text.

use super::Shared;
use super::broadcast::posed;
use super::mouth::Speaker;
use crate::msg::{Color, Header, MapMetaData, Marker, MarkerArray, OccupancyGrid, StringMsg, Time, Vector3};
use crate::plan::kind;
use crate::wire::Qos;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::broadcast::error::RecvError;
use toponym::{ClientError, Guide, Planner};
use toponym_proto::Pose;
use toponym_proto::answer::GraphReply;
use toponym_proto::grid::GridReply;
use toponym_proto::regions::RegionsReply;
use tracing::debug;

/// How long the server may take to draw.
const DRAW_WAIT: Duration = Duration::from_secs(30);
/// Drawing takes no more of the time than one part in so many.
const SHARE: u32 = 20;
/// How often it is looked whether the map has changed.
const LOOK: Duration = Duration::from_millis(500);
/// Names less likely are not shown.
const NAMED_MIN: f64 = 0.3;
/// Height of names, metres.
const TEXT_M: f64 = 0.5;
const LINE_STRIP: i32 = 4;
const LINE_LIST: i32 = 5;
const SPHERE_LIST: i32 = 7;
const TEXT: i32 = 9;
const DELETE_ALL: i32 = 3;
/// Blue and orange of a palette that the colour-blind tell apart.
const OUTLINE: Color = Color { r: 0.0, g: 0.45, b: 0.7, a: 1.0 };
const NAME: Color = Color { r: 0.1, g: 0.1, b: 0.1, a: 1.0 };
const PLACE: Color = Color { r: 0.5, g: 0.5, b: 0.5, a: 0.8 };
const LOOP: Color = Color { r: 0.9, g: 0.6, b: 0.0, a: 1.0 };

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
        match pictures(shared, &planner).await {
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

async fn pictures(shared: &Shared, planner: &Planner) -> Result<(OccupancyGrid, MarkerArray), ClientError> {
    let header = header(shared);
    let grid = occupancy(&header, &planner.grid(shared.robot.resolution_m).await?)?;
    let (regions, graph) = (planner.regions().await?, planner.graph().await?);
    Ok((grid, markers(&header, &regions, &graph)))
}

fn header(shared: &Shared) -> Header {
    let stamp_ns = shared.pose.borrow().as_ref().map_or(0, |pose| pose.stamp.ns);
    Header { stamp: Time::from(stamp_ns), frame_id: shared.robot.map_frame.clone() }
}

/// The grid as ROS has it.
///
/// # Errors
/// If it has no such cells.
pub fn occupancy(header: &Header, grid: &GridReply) -> Result<OccupancyGrid, ClientError> {
    let info = MapMetaData {
        map_load_time: header.stamp,
        resolution: grid.resolution_m as f32,
        width: grid.width as u32,
        height: grid.height as u32,
        origin: posed(&grid.map_from_grid),
    };
    Ok(OccupancyGrid { header: header.clone(), info, data: grid.cells()? })
}

/// Rooms by their outlines and names, places, and what closes loops.
pub fn markers(header: &Header, regions: &RegionsReply, graph: &GraphReply) -> MarkerArray {
    let mark = |ns: &str, id: u64, kind, color| Marker {
        header: header.clone(),
        ns: ns.into(),
        id: id as i32,
        kind,
        color,
        pose: posed(&Pose::default()),
        ..Marker::default()
    };
    let point = |x: f64, y: f64| Vector3 { x, y, z: 0.0 };
    let wide = |m: f64| Vector3 { x: m, y: m, z: m };
    let mut all = vec![Marker { action: DELETE_ALL, ..mark("", 0, TEXT, NAME) }];
    for region in &regions.regions {
        let mut points: Vec<Vector3> = region.polygon_m.iter().map(|p| point(p[0], p[1])).collect();
        points.extend(points.first().copied());
        let outline = mark("rooms", region.id, LINE_STRIP, OUTLINE);
        all.push(Marker { scale: wide(0.06), points, ..outline });
        let Some(name) = region.names.first().filter(|name| name.p >= NAMED_MIN) else { continue };
        let Some((x, y)) = middle(&region.polygon_m) else { continue };
        let mut text = mark("names", region.id, TEXT, NAME);
        text.pose.position = Vector3 { x, y, z: 0.3 };
        all.push(Marker { scale: wide(TEXT_M), text: format!("{} {:.2}", name.label, name.p), ..text });
    }
    let at: std::collections::BTreeMap<u64, Vector3> =
        graph.places.iter().map(|p| (p.id, point(p.x_m, p.y_m))).collect();
    let places = mark("places", 0, SPHERE_LIST, PLACE);
    all.push(Marker { scale: wide(0.12), points: at.values().copied().collect(), ..places });
    let edges = graph.particles.first().map_or(&[][..], |best| &best.edges);
    let ends = edges.iter().filter_map(|e| Some([*at.get(&e.i)?, *at.get(&e.j)?]));
    let loops = mark("loops", 0, LINE_LIST, LOOP);
    all.push(Marker { scale: wide(0.04), points: ends.flatten().collect(), ..loops });
    MarkerArray { markers: all }
}

/// The mean of the corners.
fn middle(polygon_m: &[[f64; 2]]) -> Option<(f64, f64)> {
    let n = polygon_m.len() as f64;
    let sum = |k: usize| polygon_m.iter().map(|p| p[k]).sum::<f64>();
    (!polygon_m.is_empty()).then(|| (sum(0) / n, sum(1) / n))
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
