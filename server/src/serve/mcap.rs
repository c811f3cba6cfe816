//! `serve --mcap FILE`: what the server tells, as messages of ROS 2 in MCAP, for Foxglove and rerun.
//!
//! Chunks are closed every few seconds: of a killed server's file all but the last is readable.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant};
use tokio::task::JoinHandle;
use toponym::{ClientError, Planner};
use toponym_proto::answer::{Heard, PoseOut};
use toponym_ros::bag::BagWriter;
use toponym_ros::live::now_ns;
use toponym_ros::msg::{
    Header, MarkerArray, OccupancyGrid, StringMsg, TFMessage, Time, Transform, TransformStamped,
};
use toponym_ros::plan::kind;
use toponym_ros::shown::{map_as_shown, posed};
use tracing::{debug, error, info, warn};
use zenoh::Session;

use super::board::Board;
use super::watch;

/// The map whose topics have the usual names.
const USUAL_MAP: &str = "main";

/// What waits to be written; what finds no room is left out, and told.
const QUEUE: usize = 1024;
/// How often a chunk is closed.
const CHUNK: Duration = Duration::from_secs(2);
/// How often it is looked whether maps have changed.
const LOOK: Duration = Duration::from_secs(5);
/// How long a map may take to be drawn.
const DRAW_WAIT: Duration = Duration::from_secs(30);
/// Edge of a cell, metres.
const RESOLUTION_M: f64 = 0.05;

/// A message to be written.
enum Line {
    Tf(TFMessage),
    Heard(StringMsg),
    Map { id: String, grid: Box<OccupancyGrid>, marked: Box<MarkerArray> },
}

/// A file that is being written.
pub struct Mcap {
    listening: JoinHandle<()>,
    writing: std::thread::JoinHandle<()>,
}

impl Mcap {
    /// Writes what `session` hears of a site's robots and maps from now on. A file that is there is left alone: another is
    /// written beside it.
    ///
    /// # Errors
    /// If there can be no such file; Zenoh's.
    pub async fn begin(file: &Path, session: &Session, board: Arc<Board>) -> io::Result<Self> {
        let file = free(file);
        let bag = BagWriter::new(BufWriter::new(File::create_new(&file)?)).map_err(io::Error::other)?;
        info!("writing {}", file.display());
        let (sender, lines) = sync_channel(QUEUE);
        let write = move || write_all(&file, bag, &lines);
        let writing = std::thread::Builder::new().name("mcap".into()).spawn(write)?;
        let to = sender.clone();
        let poses = session.declare_subscriber(board.keys.pose("*")).callback(move |sample| {
            if let Ok(pose) = serde_json::from_slice(&sample.payload().to_bytes()) {
                enter(&to, Line::Tf(transform(&pose)));
            }
        });
        let poses = poses.await.map_err(io::Error::other)?;
        let to = sender.clone();
        let heard = session.declare_subscriber(board.keys.heard("*")).callback(move |sample| {
            let heard = serde_json::from_slice::<Heard>(&sample.payload().to_bytes());
            if let Some(heard) = heard.ok().filter(|heard| !heard.words.is_empty()) {
                enter(&to, Line::Heard(StringMsg { data: heard.words }));
            }
        });
        let heard = heard.await.map_err(io::Error::other)?;
        let session = session.clone();
        let listening = tokio::spawn(async move {
            let _until_aborted = (poses, heard);
            draw(&session, &board, &sender).await;
        });
        Ok(Self { listening, writing })
    }

    /// Ends the file.
    pub async fn end(self) {
        self.listening.abort();
        // What it listened with is gone by then, and with it all who hand lines on.
        let _ = self.listening.await;
        let _ = tokio::task::spawn_blocking(|| self.writing.join()).await;
    }
}

/// A file that is not there yet: `tour.mcap`, or else `tour.1.mcap`, and so on.
fn free(file: &Path) -> PathBuf {
    let numbered = (1..u32::MAX).map(|k| file.with_extension(format!("{k}.mcap")));
    std::iter::once(file.to_owned()).chain(numbered).find(|f| !f.exists()).unwrap_or_else(|| file.to_owned())
}

/// Whether it will be written. Where nobody writes any more that was told.
fn enter(sender: &SyncSender<Line>, line: Line) -> bool {
    let entered = sender.try_send(line);
    if matches!(entered, Err(TrySendError::Full(_))) {
        warn!("the MCAP file cannot follow: a message is left out of it");
    }
    entered.is_ok()
}

/// Its topics: those of the usual map have the usual names.
fn topic(map: &str, name: &str) -> String {
    if map == USUAL_MAP { name.to_owned() } else { format!("/{map}{name}") }
}

fn frame(map: &str) -> String {
    if map == USUAL_MAP { "map".to_owned() } else { format!("{map}/map") }
}

/// Where a robot is in its map.
fn transform(pose: &PoseOut) -> TFMessage {
    let header = Header { stamp: Time::from(pose.stamp.ns), frame_id: frame(&pose.map.id) };
    let at = posed(&pose.map_from_body);
    let transform = Transform { translation: at.position, rotation: at.orientation };
    TFMessage { transforms: vec![TransformStamped { header, child_frame_id: pose.robot.clone(), transform }] }
}

/// Hands on each map that has changed.
async fn draw(session: &Session, board: &Board, sender: &SyncSender<Line>) {
    let mut drawn: BTreeMap<String, (u64, u64)> = BTreeMap::new();
    loop {
        tokio::time::sleep(LOOK).await;
        for map in watch::info(board).maps {
            let state = (map.epoch, map.rev);
            if drawn.get(&map.id) == Some(&state) {
                continue;
            }
            match picture(session, &board.site, &map.id).await {
                Ok(line) => {
                    if enter(sender, line) {
                        drawn.insert(map.id, state);
                    }
                }
                Err(e) => debug!(map = map.id, "no picture for the MCAP file: {e}"),
            }
        }
    }
}

async fn picture(session: &Session, site: &str, map: &str) -> Result<Line, ClientError> {
    let planner = Planner::new(session, site, map, DRAW_WAIT)?;
    let header = Header { stamp: Time::from(now_ns()), frame_id: frame(map) };
    let (grid, marked) = map_as_shown(&planner, &header, RESOLUTION_M).await?;
    Ok(Line::Map { id: map.to_owned(), grid: Box::new(grid), marked: Box::new(marked) })
}

/// Until nobody hands anything on any more; then the file is ended.
fn write_all(file: &Path, mut bag: BagWriter<BufWriter<File>>, lines: &Receiver<Line>) {
    let mut flushed = Instant::now();
    let written = loop {
        let next = match lines.recv_timeout(CHUNK) {
            Ok(line) => write_line(&mut bag, line),
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => break bag.finish().map(drop),
        };
        let next = next.and_then(|()| {
            let is_due = flushed.elapsed() >= CHUNK;
            if is_due {
                flushed = Instant::now();
                bag.flush()?;
            }
            Ok(())
        });
        if next.is_err() {
            break next;
        }
    };
    if let Err(why) = written {
        error!("{}: {why}: nothing more is written", file.display());
    }
}

fn write_line(bag: &mut BagWriter<BufWriter<File>>, line: Line) -> Result<(), String> {
    let now_ns = now_ns();
    match line {
        Line::Tf(message) => bag.write("/tf", kind::TF, now_ns, &message),
        Line::Heard(message) => bag.write("/toponym/heard", kind::TEXT, now_ns, &message),
        Line::Map { id, grid, marked } => {
            bag.write(&topic(&id, "/map"), kind::GRID, now_ns, &*grid)?;
            bag.write(&topic(&id, "/toponym/markers"), kind::MARKERS, now_ns, &*marked)
        }
    }
}
