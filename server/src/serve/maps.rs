//! The maps there are: loads them at the start, makes new ones for robots, starts and stops their
//! threads.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use toponym_core::Mapper;
use toponym_journal::{Entry, Event, Folder, Journal};
use toponym_proto::answer::{ErrorCode, Problem};
use toponym_proto::limits::EMPTY_IDLE_S;
use toponym_proto::{Setup, Stamp};
use tracing::{error, info, warn};

use super::board::{Board, MapView, lock};
use super::mapping::{Due, Mapping, suspicions};
use super::outbox::Outbox;
use super::recording::Recordings;
use super::saver::Saver;
use super::scribe::{Scribe, Work};
use crate::config::ServerConfig;
use crate::fold::{Card, Fold};
use crate::store::{Found, Store, StoreError, identity};

/// Messages that wait in front of the journal; those before them wait with their robot.
const QUEUE: usize = 256;
/// Entries that wait between the journal and the filter: those of some seconds.
const STEPS: usize = 1024;
/// How long the filters may go on when the server stops; what they leave is in their journals.
const STOP_WAIT: Duration = Duration::from_secs(3);

/// What is known of a robot of an earlier run.
#[derive(Clone)]
pub struct Saved {
    /// The map it was on last, if that is at hand.
    pub map: Option<Arc<MapView>>,
    /// (boot, seq) of the last of its messages that is on disk, or given up.
    pub watermark: (u64, u64),
    /// Newest stamp of those.
    pub newest: Stamp,
}

/// The maps and their threads.
pub struct Maps {
    config: ServerConfig,
    board: Arc<Board>,
    outbox: Outbox,
    store: Arc<Store>,
    records: Option<Recordings>,
    /// Each with its map.
    threads: Vec<(String, JoinHandle<Result<(), String>>)>,
    /// The saved map of each robot that it was on last.
    saved: BTreeMap<String, Saved>,
    /// Those on disk alone: there was no room.
    retired: BTreeSet<String>,
    /// Those of them that their robots do not know of yet.
    newly_retired: Vec<(String, Problem)>,
}

/// A map to be started.
struct Start {
    fold: Fold,
    tail: Vec<(u64, Entry)>,
    journal: Journal<Folder>,
}

impl Maps {
    /// None yet.
    pub fn new(
        config: ServerConfig,
        board: Arc<Board>,
        outbox: Outbox,
        store: Arc<Store>,
        records: Option<Recordings>,
    ) -> Self {
        let (threads, saved) = (Vec::new(), BTreeMap::new());
        let (retired, newly_retired) = (BTreeSet::new(), Vec::new());
        Self { config, board, outbox, store, records, threads, saved, retired, newly_retired }
    }

    /// Starts a thread for each saved map. One that can't be loaded stops only itself.
    pub fn start_saved(&mut self) -> Result<(), StoreError> {
        let mut ids = self.store.ids()?;
        let room = self.config.limits.maps;
        if ids.len() > room {
            ids.sort_by_key(|id| Reverse(self.store.written_at(id)));
        }
        for (k, id) in ids.into_iter().enumerate() {
            let loaded = self.store.load(&id, self.hold()).map_err(|e| e.to_string());
            let begun = loaded.and_then(|found| {
                if k < room {
                    return self.go_on(&id, found);
                }
                warn!(map = id, "stays on disk: others were written to later, and limits.maps is {room}");
                self.remember(&found.fold.card.robot, reached(&found.fold, &found.tail), None);
                self.show_retired(&id);
                Ok(())
            });
            if let Err(why) = begun {
                error!(map = id, "this map is not served: {why}");
                let problem = Problem::new(ErrorCode::Internal, format!("map {id:?} can't be loaded: {why}"))
                    .field("map")
                    .hint("see `toponym-server journal verify` and `recover`, or give the robot another map");
                lock(&self.board.broken).insert(id, problem);
            }
        }
        Ok(())
    }

    fn hold(&self) -> Duration {
        Duration::from_secs_f64(self.config.hold_back_s)
    }

    fn go_on(&mut self, id: &str, found: Found) -> Result<(), String> {
        let Found { fold, tail, mut journal, mended } = found;
        for what in &mended {
            warn!(map = id, "mended: {what}");
        }
        let new = identity(&fold);
        let old = journal.identity_mut();
        if old.build != new.build {
            warn!(map = id, "made by build {}; what follows its checkpoint is folded by this one", old.build);
        }
        *old = new;
        let reached = reached(&fold, &tail);
        info!(map = id, robot = fold.card.robot, entries = tail.len(), "loaded");
        let robot = fold.card.robot.clone();
        let view = self.start(id, Start { fold, tail, journal }, reached.0).map_err(|e| e.to_string())?;
        self.remember(&robot, reached, Some(view));
        Ok(())
    }

    /// Keeps in mind how far a robot is, and on which map if that is at hand.
    fn remember(&mut self, robot: &str, reached: (Option<(u64, u64)>, Stamp), map: Option<Arc<MapView>>) {
        if let (Some(watermark), newest) = reached
            && self.saved.get(robot).is_none_or(|known| known.watermark <= watermark)
        {
            self.saved.insert(robot.to_owned(), Saved { map, watermark, newest });
        }
    }

    /// The robots that saved maps are of.
    pub fn saved_robots(&self) -> impl Iterator<Item = &str> {
        self.saved.keys().map(String::as_str)
    }

    /// The map that a robot was on in an earlier run, and how far it got.
    pub fn saved(&self, robot: &str) -> Option<Saved> {
        self.saved.get(robot).cloned()
    }

    /// The map that a robot's setup names, new if there is none. A map has one robot.
    pub fn find(&mut self, setup: &Setup) -> Result<Arc<MapView>, Problem> {
        let (id, robot) = (&setup.map, &setup.header.robot);
        let is_retired = self.retired.contains(id);
        if let Some(problem) = lock(&self.board.broken).get(id).filter(|_| !is_retired) {
            return Err(problem.clone());
        }
        if let Some(view) = self.board.maps.load().get(id) {
            return if view.robot == *robot { Ok(view.clone()) } else { Err(taken(id, &view.robot)) };
        }
        self.make_room()?;
        if is_retired {
            return self.bring_back(id, robot);
        }
        let card = Card { uuid: new_uuid(), robot: robot.clone(), watermark: None, stamp_ns: 0 };
        let fold = Fold::new(Mapper::new(self.config.mapper.clone()), card, self.hold());
        let started = self.store.create(id, &fold).map_err(|e| e.to_string()).and_then(|journal| {
            self.start(id, Start { fold, tail: Vec::new(), journal }, None).map_err(|e| e.to_string())
        });
        started
            .map_err(|e| Problem::new(ErrorCode::Internal, format!("map {id:?} could not be started: {e}")))
    }

    /// Leaves room for one more map: if need be, that for which nothing has come for longest makes it.
    fn make_room(&mut self) -> Result<(), Problem> {
        let maps = self.board.maps.load_full();
        if maps.len() < self.config.limits.maps {
            return Ok(());
        }
        let spare = |view: &&Arc<MapView>| {
            let (idle_s, most_s) = (view.idle().as_secs(), self.config.limits.map_idle_s);
            idle_s >= most_s || (idle_s >= EMPTY_IDLE_S && view.snapshot.load().is_empty())
        };
        let Some(view) = maps.values().filter(spare).max_by_key(|view| view.idle()).cloned() else {
            self.board.reach("maps");
            let message = format!("there are {} maps already", maps.len());
            return Err(Problem::new(ErrorCode::TooLarge, message)
                .field("map")
                .hint("raise limits.maps in the server's configuration, or delete a map"));
        };
        self.retire(&view);
        Ok(())
    }

    /// Keeps a map on disk alone.
    fn retire(&mut self, view: &MapView) {
        info!(map = view.id, idle_s = view.idle().as_secs(), "retired: another needs its room");
        self.end(view, STOP_WAIT);
        let reached = (*lock(&view.durable), view.stamp());
        self.remember(&view.robot, reached, None);
        let problem = self.show_retired(&view.id);
        self.newly_retired.push((view.id.clone(), problem));
    }

    /// Tells whoever asks for a map that it is on disk alone.
    fn show_retired(&mut self, id: &str) -> Problem {
        let problem = Problem::new(ErrorCode::NoSuchMap, format!("map {id:?} made room for others"))
            .field("map")
            .hint("it is on disk: a setup of its robot brings it back; or raise limits.maps");
        self.retired.insert(id.into());
        lock(&self.board.broken).insert(id.into(), problem.clone());
        problem
    }

    /// Loads a map that is on disk alone.
    fn bring_back(&mut self, id: &str, robot: &str) -> Result<Arc<MapView>, Problem> {
        let failed =
            |why: String| Problem::new(ErrorCode::Internal, format!("map {id:?} can't be loaded: {why}"));
        let found = self.store.load(id, self.hold()).map_err(|e| failed(e.to_string()))?;
        if found.fold.card.robot != robot {
            return Err(taken(id, &found.fold.card.robot));
        }
        self.retired.remove(id);
        lock(&self.board.broken).remove(id);
        self.go_on(id, found).map_err(failed)?;
        self.board.maps.load().get(id).cloned().ok_or_else(|| failed("it has ended".into()))
    }

    /// Maps that made room since this was last asked, and what their robots are told.
    pub fn take_retired(&mut self) -> Vec<(String, Problem)> {
        std::mem::take(&mut self.newly_retired)
    }

    /// `durable`: (boot, seq) of the last of its robot's messages in its journal; the filter may not be that far.
    fn start(&mut self, id: &str, map: Start, durable: Option<(u64, u64)>) -> std::io::Result<Arc<MapView>> {
        let Start { fold, tail, journal } = map;
        let record = self.records.as_ref();
        let record = record.map(|r| r.of_map(id, &fold.card.uuid, fold.steps())).transpose()?;
        let (work, queue) = sync_channel(QUEUE);
        let (steps, taken) = sync_channel(STEPS);
        let view = Arc::new(MapView::new(id, &fold.card, durable, fold.mapper.snapshot(), work));
        *lock(&view.suspected) = suspicions(&fold);
        let newest = tail.last().map_or(fold.now(), |(_, entry)| Duration::from_nanos(entry.at_ns));
        let held_ns = tail.iter().rev().find_map(|(_, entry)| match entry.event {
            Event::Hold(ns) => Some(ns),
            _ => None,
        });
        // Settings may have changed since; what was taken in before is folded as it was.
        if held_ns.map_or(fold.hold(), Duration::from_nanos) != self.hold() {
            let _ = view.work.try_send(Work::Take(Event::Hold(self.hold().as_nanos() as u64)));
        }
        let learnt = tail.iter().rev().find_map(|(_, entry)| match &entry.event {
            Event::Glossary(words) => Some(words.as_str()),
            _ => None,
        });
        let words = self.board.words.load_full();
        if learnt.unwrap_or_else(|| fold.mapper.words()) != *words {
            let _ = view.work.try_send(Work::Take(Event::Glossary(words.to_string())));
        }
        let saved = journal.durable() - tail.len() as u64;
        let mapping = Mapping {
            view: view.clone(),
            fold,
            index: saved,
            board: self.board.clone(),
            outbox: self.outbox.clone(),
            saver: Saver::new(self.store.journal(id), saved),
            record,
            graph_period: Duration::from_secs_f64(self.config.graph_period_s),
            log_speech: self.config.log_speech,
            saves: Vec::new(),
            record_due: Due::default(),
            snapshot_due: Due::default(),
            graph_due: Due::default(),
        };
        let scribe = Scribe::new(view.clone(), journal, steps, newest);
        let named = |what: &str| std::thread::Builder::new().name(format!("{what} {id}"));
        self.threads.push((id.into(), named("map").spawn(move || mapping.run(tail, &taken))?));
        let journal = named("journal").spawn(move || {
            scribe.run(&queue);
            Ok(())
        })?;
        self.threads.push((id.into(), journal));
        self.board.add_map(view.clone());
        Ok(view)
    }

    /// Lets every map's journal take what has come, and its filter work on for a while; returns when all are saved,
    /// with what became of those that could not be.
    pub fn stop(&mut self) -> Vec<String> {
        for view in self.board.maps.load().values() {
            *lock(&view.stops_at) = Some(Instant::now() + STOP_WAIT);
        }
        for view in self.board.maps.load().values() {
            let _ = view.work.send(Work::Stop);
        }
        self.join(|_| true)
    }

    /// Ends a map and sets its folder aside; there is room for another then.
    ///
    /// # Errors
    /// If there is none, or its folder can't be renamed.
    pub fn delete(&mut self, id: &str) -> Result<(), Problem> {
        let view = self.board.maps.load().get(id).cloned();
        if view.is_none() && lock(&self.board.broken).remove(id).is_none() {
            let message = format!("there is no map {id:?}");
            return Err(Problem::new(ErrorCode::NoSuchMap, message).field("map"));
        }
        if let Some(view) = view {
            self.end(&view, Duration::ZERO);
            self.saved.retain(|_, saved| saved.map.as_ref().is_none_or(|map| map.id != id));
        }
        self.retired.remove(id);
        let kept = self.store.set_aside(id).map_err(|e| Problem::new(ErrorCode::Internal, e.to_string()))?;
        info!(map = id, kept = %kept.display(), "deleted; what it was is kept");
        Ok(())
    }

    /// Ends a map's threads; its filter may go on for a while.
    fn end(&mut self, view: &MapView, wait: Duration) {
        *lock(&view.stops_at) = Some(Instant::now() + wait);
        let _ = view.work.send(Work::Stop);
        self.board.remove_map(&view.id);
        self.join(|of| of == view.id);
    }

    /// Waits for the threads of some maps; tells what became of those that could not be saved.
    fn join(&mut self, which: impl Fn(&str) -> bool) -> Vec<String> {
        let mut failed = Vec::new();
        for (_, thread) in self.threads.extract_if(.., |(id, _)| which(id)) {
            let name = thread.thread().name().unwrap_or_default().to_string();
            let why = match thread.join() {
                Ok(Ok(())) => continue,
                Ok(Err(e)) => {
                    format!("{name} could not be saved: {e}; its journal has all that was acknowledged")
                }
                Err(_) => format!("{name} failed, see the log; its journal has all that was acknowledged"),
            };
            error!("{why}");
            failed.push(why);
        }
        failed
    }
}

/// How far a map's robot is: (boot, seq) of the last of its messages on disk, and the newest stamp that has arrived, not
/// what the filter has taken in: that may be far behind.
fn reached(fold: &Fold, tail: &[(u64, Entry)]) -> (Option<(u64, u64)>, Stamp) {
    let watermark = tail.iter().filter_map(|(_, entry)| entry.watermark()).max().max(fold.card.watermark);
    let stamp = |(_, entry): &(u64, Entry)| match &entry.event {
        Event::Message(message) => Some(message.header()?.stamp),
        _ => None,
    };
    (watermark, tail.iter().rev().find_map(stamp).unwrap_or(Stamp { ns: fold.card.stamp_ns }))
}

fn taken(map: &str, robot: &str) -> Problem {
    Problem::new(ErrorCode::MapTaken, format!("map {map:?} is mapped by robot {robot:?}"))
        .field("map")
        .hint("one robot maps a map: give this one another map in its setup")
}

/// 128 random bits in the usual notation.
fn new_uuid() -> String {
    let hex = format!("{:032x}", u128::from(ulid::Ulid::generate()));
    let part = |range: std::ops::Range<usize>| hex.get(range).unwrap_or_default();
    [part(0..8), part(8..12), part(12..16), part(16..20), part(20..32)].join("-")
}
