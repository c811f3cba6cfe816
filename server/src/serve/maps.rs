//! The maps there are: loads them at the start, makes new ones for robots, starts and stops their
//! threads.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicI64;
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;
use toponym_core::Mapper;
use toponym_proto::Setup;
use toponym_proto::answer::{ErrorCode, Problem};
use toponym_proto::record::{RecordError, RecordWriter};
use tracing::{error, info, warn};

use super::board::{Board, MapView};
use super::mapping::{Due, Mapping, Work};
use super::outbox::Outbox;
use crate::config::ServerConfig;
use crate::store::{Card, Store, StoreError};

/// Messages that wait in front of the filter; those before them wait with their robot.
const QUEUE: usize = 256;

/// The maps and their threads.
pub struct Maps {
    config: ServerConfig,
    board: Arc<Board>,
    outbox: Outbox,
    store: Arc<Store>,
    record: Option<Record>,
    threads: Vec<JoinHandle<Result<(), StoreError>>>,
    /// The saved map of each robot that it was on last, and (boot, seq) of the last message in it.
    saved: BTreeMap<String, (Arc<MapView>, (u64, u64))>,
}

impl Maps {
    /// None yet. `record`: of the first map; others get their id added to its name.
    pub fn new(
        config: ServerConfig,
        board: Arc<Board>,
        outbox: Outbox,
        store: Arc<Store>,
        record: Option<Record>,
    ) -> Self {
        Self { config, board, outbox, store, record, threads: Vec::new(), saved: BTreeMap::new() }
    }

    /// Starts a thread for each saved map.
    pub fn start_saved(&mut self, saved: BTreeMap<String, (Mapper, Card)>) -> io::Result<()> {
        for (id, (mapper, card)) in saved {
            info!(map = id, robot = card.robot, "loaded");
            if self.record.is_some() {
                warn!(map = id, "the record begins in the middle of this map: replay it with --start-map");
            }
            let (robot, watermark) = (card.robot.clone(), card.watermark);
            let view = self.start(&id, mapper, card)?;
            if let Some(watermark) = watermark
                && self.saved.get(&robot).is_none_or(|(_, known)| *known < watermark)
            {
                self.saved.insert(robot, (view, watermark));
            }
        }
        Ok(())
    }

    /// The map that a robot was on in an earlier run, and how far it got.
    pub fn saved(&self, robot: &str) -> Option<(Arc<MapView>, (u64, u64))> {
        self.saved.get(robot).cloned()
    }

    /// The map that a robot's setup names, new if there is none. A map has one robot.
    pub fn find(&mut self, setup: &Setup) -> Result<Arc<MapView>, Problem> {
        let (id, robot) = (&setup.map, &setup.header.robot);
        let maps = self.board.maps.load();
        if let Some(view) = maps.get(id) {
            if view.robot == *robot {
                return Ok(view.clone());
            }
            let message = format!("map {id:?} is mapped by robot {:?}", view.robot);
            return Err(Problem::new(ErrorCode::MapTaken, message)
                .field("map")
                .hint("one robot maps a map: give this one another map in its setup"));
        }
        if maps.len() >= self.config.maps_max {
            let message = format!("there are {} maps already", maps.len());
            return Err(Problem::new(ErrorCode::TooLarge, message)
                .field("map")
                .hint("raise maps_max in the server's configuration"));
        }
        let card = Card { uuid: new_uuid(), robot: robot.clone(), watermark: None, stamp_ns: 0 };
        self.start(id, Mapper::new(self.config.mapper.clone()), card)
            .map_err(|e| Problem::new(ErrorCode::Internal, format!("map {id:?} could not be started: {e}")))
    }

    fn start(&mut self, id: &str, mapper: Mapper, card: Card) -> io::Result<Arc<MapView>> {
        let record = self.record.as_mut().map(|record| record.of_map(id)).transpose()?;
        let (work, queue) = sync_channel(QUEUE);
        let view = Arc::new(MapView {
            id: id.into(),
            uuid: card.uuid.clone(),
            robot: card.robot.clone(),
            snapshot: arc_swap::ArcSwap::new(mapper.snapshot()),
            stamp_ns: AtomicI64::new(card.stamp_ns),
            recorded: Mutex::default(),
            work,
        });
        let mapping = Mapping {
            view: view.clone(),
            mapper,
            card,
            board: self.board.clone(),
            outbox: self.outbox.clone(),
            store: self.store.clone(),
            record,
            graph_period: Duration::from_secs_f64(self.config.graph_period_s),
            record_due: Due::default(),
            snapshot_due: Due::default(),
            graph_due: Due::default(),
        };
        let thread = std::thread::Builder::new().name(format!("map {id}"));
        self.threads.push(thread.spawn(move || mapping.run(&queue))?);
        self.board.add_map(view.clone());
        Ok(view)
    }

    /// Lets every map work off its queue and save itself; returns when all have, with what became
    /// of those that could not.
    pub fn stop(&mut self) -> Vec<String> {
        for view in self.board.maps.load().values() {
            let _ = view.work.send(Work::Stop);
        }
        let mut failed = Vec::new();
        for thread in self.threads.drain(..) {
            let name = thread.thread().name().unwrap_or_default().to_string();
            let why = match thread.join() {
                Ok(Ok(())) => continue,
                Ok(Err(e)) => format!("{name} could not be saved: {e}"),
                Err(_) => format!("{name} is as last saved: its thread failed, see the log"),
            };
            error!("DATA LOSS: {why}");
            failed.push(why);
        }
        failed
    }
}

/// Where maps are recorded: the first under the name given, others with their id added.
pub struct Record {
    path: PathBuf,
    /// For the first map, until there is one.
    first: Option<RecordWriter<File>>,
}

impl Record {
    /// Makes the file. One that is there already is an error: it may be all that is left of a map.
    pub fn create(path: PathBuf) -> io::Result<Self> {
        let first = Some(create_record(&path)?);
        Ok(Self { path, first })
    }

    fn of_map(&mut self, id: &str) -> io::Result<RecordWriter<File>> {
        if let Some(first) = self.first.take() {
            return Ok(first);
        }
        let mut name = self.path.as_os_str().to_owned();
        name.push(format!(".{id}"));
        let path = Path::new(&name);
        warn!(map = id, path = %path.display(), "a further map is recorded in a file of its own");
        create_record(path)
    }
}

fn create_record(path: &Path) -> io::Result<RecordWriter<File>> {
    let named = |e: io::Error| {
        let hint = match e.kind() {
            io::ErrorKind::AlreadyExists => "; move the earlier record away or give --record another file",
            _ => "",
        };
        io::Error::new(e.kind(), format!("record {}: {e}{hint}", path.display()))
    };
    let mut record =
        File::create_new(path).and_then(|f| RecordWriter::new(f).map_err(into_io)).map_err(named)?;
    // The first line is written at once: better told now than at the first scan.
    record.flush().map_err(into_io).map_err(named)?;
    Ok(record)
}

fn into_io(error: RecordError) -> io::Error {
    match error {
        RecordError::Io(e) => e,
        other => io::Error::other(other),
    }
}

/// 128 random bits in the usual notation.
fn new_uuid() -> String {
    let hex = format!("{:032x}", u128::from(ulid::Ulid::generate()));
    let part = |range: std::ops::Range<usize>| hex.get(range).unwrap_or_default();
    [part(0..8), part(8..12), part(12..16), part(16..20), part(20..32)].join("-")
}
