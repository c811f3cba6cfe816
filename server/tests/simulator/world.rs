//! The world of one seed.

use crate::scene::{message, newborn, patience, say};
use crate::sim::{CRASHES, Crash, Fault, SimDisk};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use std::collections::{BTreeMap, HashMap};
use std::time::Duration;
use toponym_journal::{Entry, Event, Journal, prune};
use toponym_proto::Message;
use toponym_proto::answer::HeardStatus;
use toponym_proto::sequence::{Sequencer, Step};
use toponym_server::fold::{Fold, Outcome};
use toponym_server::store::{checkpoint, identity};

/// A bug, to see that it is noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bug {
    AcknowledgesBeforeSync,
    TakesInHashOrder,
}

/// What happened, over all seeds.
#[derive(Clone, Debug, Default)]
pub struct Told {
    pub messages: u64,
    pub sentences: u64,
    pub crashes: u64,
    pub repeated: u64,
    /// Commits that the medium refused.
    pub refusals: u64,
    /// Flipped bits that were mended, and that were refused.
    pub mended: u64,
    pub refused_flips: u64,
}

impl Told {
    pub fn add(&mut self, other: &Self) {
        self.messages += other.messages;
        self.sentences += other.sentences;
        self.crashes += other.crashes;
        self.repeated += other.repeated;
        self.refusals += other.refusals;
        self.mended += other.mended;
        self.refused_flips += other.refused_flips;
    }
}

/// A step of the virtual clock.
const TICK: Duration = Duration::from_millis(10);
/// The robot or guide sends again what is not known to be there.
const AGAIN: Duration = Duration::from_millis(400);
/// After so long all heals.
const HEALS: Duration = Duration::from_secs(8);
/// … and has to be settled after that.
const SETTLED: Duration = Duration::from_secs(40);
const MESSAGES: u64 = 120;
const SENTENCES: u64 = 4;

/// What is on its way over the network, either way.
#[derive(Clone, Copy)]
enum Packet {
    Message(u64),
    Say(u64),
    Acked(u64),
    Heard(u64),
}

/// The server's side: gone with a crash, but for the medium.
struct Server {
    journal: Journal<SimDisk>,
    fold: Fold,
    sequencer: Sequencer,
    /// (boot, seq) of the last message that is durable.
    durable: Option<(u64, u64)>,
    /// Appended, not yet known to be durable.
    unsynced: Vec<(u64, Entry)>,
    /// Time of its clock when the journal was opened.
    base: Duration,
    began: Duration,
}

struct World {
    random: ChaCha8Rng,
    bug: Option<Bug>,
    now: Duration,
    disk: SimDisk,
    server: Server,
    /// By time of arrival, and a number that makes them differ.
    network: BTreeMap<(Duration, u64), Packet>,
    packets: u64,
    /// All entries that were ever durable, by number.
    history: Vec<Entry>,
    acked: Option<u64>,
    heard: Vec<bool>,
    fault_ends: Duration,
    told: Told,
}

/// Runs a seed until all is settled, and looks whether it is as it should be.
pub fn run(seed: u64, bug: Option<Bug>) -> Told {
    let disk = SimDisk::default();
    let fold = newborn();
    let journal = Journal::create(disk.clone(), identity(&fold), fold.save().unwrap()).unwrap();
    let server = Server {
        journal: journal.with_segments_of(1 << 14),
        fold,
        sequencer: Sequencer::new(patience(), None),
        durable: None,
        unsynced: Vec::new(),
        base: Duration::ZERO,
        began: Duration::ZERO,
    };
    let mut world = World {
        random: ChaCha8Rng::seed_from_u64(seed),
        bug,
        now: Duration::ZERO,
        disk,
        server,
        network: BTreeMap::new(),
        packets: 0,
        history: Vec::new(),
        acked: None,
        heard: vec![false; SENTENCES as usize],
        fault_ends: Duration::ZERO,
        told: Told { messages: MESSAGES, sentences: SENTENCES, ..Told::default() },
    };
    while !world.is_settled() {
        assert!(world.now < SETTLED, "not settled: {:?} acknowledged, heard {:?}", world.acked, world.heard);
        world.tick();
    }
    world.check();
    world.told
}

impl World {
    fn is_settled(&self) -> bool {
        self.acked == Some(MESSAGES - 1)
            && self.heard.iter().all(|heard| *heard)
            && self.server.fold.held() == 0
            && self.server.unsynced.is_empty()
    }

    fn heals(&self) -> bool {
        self.now >= HEALS
    }

    fn tick(&mut self) {
        self.now += TICK;
        self.fail();
        self.clients();
        while let Some(first) = self.network.first_entry()
            && first.key().0 <= self.now
        {
            let packet = first.remove();
            self.arrive(packet);
        }
        self.serve();
    }

    /// What fails now.
    fn fail(&mut self) {
        if self.now >= self.fault_ends || self.heals() {
            self.disk.set_fault(None);
        }
        if self.heals() {
            return;
        }
        if self.random.random_bool(0.01) {
            let faults = [Fault::ShortWrite, Fault::Full, Fault::Sync];
            self.disk.set_fault(Some(faults[self.random.random_range(0..faults.len())]));
            self.fault_ends = self.now + TICK * self.random.random_range(1..60);
        }
        if self.random.random_bool(0.006) {
            self.crash();
        }
    }

    /// The machine stops and starts again.
    fn crash(&mut self) {
        self.told.crashes += 1;
        // A turned bit in what was not synced is for the journal's own tests: here what is there must be right.
        let crash = CRASHES[self.random.random_range(0..CRASHES.len())];
        let crash = if crash == Crash::Flipped { Crash::Reordered } else { crash };
        let disk = self.disk.after(crash, &mut self.random);
        self.restart(disk);
    }

    fn restart(&mut self, disk: SimDisk) {
        self.disk = disk;
        let opened = Journal::open(self.disk.clone()).unwrap();
        let index = opened.checkpoint.index;
        let mut fold = Fold::load(&opened.checkpoint.map).unwrap();
        let mut heard = Vec::new();
        // What was never known to be durable may be there, too.
        let (durable, known) = (opened.journal.durable(), self.history.len() as u64);
        assert!(durable >= known, "{durable} of {known} durable entries are left");
        for (number, entry) in opened.tail {
            if number as usize > self.history.len() {
                assert_eq!(number as usize, self.history.len() + 1);
                self.history.push(entry.clone());
            }
            assert_eq!(self.history[number as usize - 1], entry, "entry {number} is another than it was");
            take(&mut fold, entry, &mut heard);
        }
        assert_eq!(self.history.len() as u64, durable, "entries are missing after checkpoint {index}");
        let watermark = fold.card.watermark;
        assert!(
            watermark.map(|w| w.1) >= self.acked,
            "{watermark:?} is left of {:?} acknowledged",
            self.acked
        );
        let base = self.history.last().map_or(Duration::ZERO, |entry| Duration::from_nanos(entry.at_ns));
        self.server = Server {
            journal: opened.journal.with_segments_of(1 << 14),
            fold,
            sequencer: Sequencer::new(patience(), watermark),
            durable: watermark,
            unsynced: Vec::new(),
            base,
            began: self.now,
        };
        self.answer(heard);
    }

    /// Robot and guide send what is new, and again what is not known to be there.
    fn clients(&mut self) {
        let step = (self.now.as_nanos() / TICK.as_nanos()) as u64;
        let is_again = step.is_multiple_of((AGAIN.as_nanos() / TICK.as_nanos()) as u64);
        // A message each 20 ms, a sentence each 400 ms.
        let newest = step / 2;
        if step.is_multiple_of(2) && newest <= MESSAGES {
            self.send(Packet::Message(newest - 1));
        }
        if step.is_multiple_of(40) && step / 40 <= SENTENCES {
            self.send(Packet::Say(step / 40 - 1));
        }
        if is_again {
            // What was told may have been lost: the robot asks.
            if let Some((_, durable)) = self.server.durable {
                self.send(Packet::Acked(durable));
            }
            for n in self.acked.map_or(0, |acked| acked + 1)..newest.min(MESSAGES) {
                self.send(Packet::Message(n));
            }
            for n in 0..(step / 40).min(SENTENCES) {
                if !self.heard[n as usize] {
                    self.send(Packet::Say(n));
                }
            }
        }
    }

    /// The network loses, delays and repeats.
    fn send(&mut self, packet: Packet) {
        let (lost, twice) = if self.heals() { (0.0, 0.0) } else { (0.2, 0.1) };
        let copies = 1 + u64::from(self.random.random_bool(twice));
        for _ in 0..copies {
            if self.random.random_bool(lost) {
                continue;
            }
            let late = if self.random.random_bool(0.1) { 400 } else { 30 };
            let at = self.now + Duration::from_millis(self.random.random_range(0..late));
            self.packets += 1;
            self.network.insert((at, self.packets), packet);
        }
    }

    fn arrive(&mut self, packet: Packet) {
        match packet {
            Packet::Message(n) => self.server.sequencer.push(self.now, message(n)),
            Packet::Say(n) => self.append(Event::Say { boot: 1, say: say(n) }),
            Packet::Acked(n) => self.acked = self.acked.max(Some(n)),
            Packet::Heard(n) => self.heard[n as usize] = true,
        }
    }

    fn append(&mut self, event: Event) {
        let server = &mut self.server;
        let at_ns = (server.base + self.now.saturating_sub(server.began)).as_nanos() as u64;
        let entry = Entry { at_ns, event };
        let number = server.journal.append(&entry.to_bytes().unwrap());
        server.unsynced.push((number, entry));
    }

    /// recv → order → journal → sync → acknowledge → step, as the server's threads do it.
    fn serve(&mut self) {
        while let Some(step) = self.server.sequencer.pop(self.now) {
            match step {
                Step::Message(message) => self.append(Event::Message(message)),
                Step::Lost { from, to, .. } => panic!("{from}..{to} was given up"),
                Step::Refused { .. } => unreachable!("nothing is refused here"),
            }
        }
        self.told.repeated += self.server.sequencer.dropped().repeated;
        if self.server.unsynced.is_empty() && self.server.fold.held() > 0 {
            self.append(Event::Tick);
        }
        let lies = self.bug == Some(Bug::AcknowledgesBeforeSync) && self.random.random_bool(0.5);
        if !lies && self.server.journal.commit().is_err() {
            self.told.refusals += 1;
            return;
        }
        let entries = std::mem::take(&mut self.server.unsynced);
        if let Some(newest) = entries.iter().filter_map(|(_, entry)| entry.watermark()).max() {
            self.server.durable = self.server.durable.max(Some(newest));
            self.send(Packet::Acked(newest.1));
        }
        self.step(entries);
        if self.random.random_bool(0.01)
            && let Ok(written) = checkpoint(&self.server.fold, self.history.len() as u64)
        {
            // One that fails is made again later.
            let _ = written.write(&self.disk).and_then(|()| prune(&self.disk));
        }
    }

    /// The filter takes in what is durable.
    fn step(&mut self, entries: Vec<(u64, Entry)>) {
        let mut heard = Vec::new();
        self.history.extend(entries.iter().map(|(_, entry)| entry.clone()));
        let entries: Vec<Entry> = if self.bug == Some(Bug::TakesInHashOrder) {
            let hashed: HashMap<u64, Entry> = entries.into_iter().collect();
            hashed.into_values().collect()
        } else {
            entries.into_iter().map(|(_, entry)| entry).collect()
        };
        for entry in entries {
            take(&mut self.server.fold, entry, &mut heard);
        }
        self.answer(heard);
    }

    /// Tells the guide which sentences were dealt with.
    fn answer(&mut self, heard: Vec<u64>) {
        for n in heard {
            self.send(Packet::Heard(n));
        }
    }

    /// All that entered did so once and in order; the journal makes the same map; turned bits are seen.
    fn check(&mut self) {
        let (mut seqs, mut ids, mut again) = (Vec::new(), Vec::new(), newborn());
        for entry in self.history.clone() {
            again.take(entry, &mut |outcome| {
                if let Outcome::Enters(message) = outcome {
                    match message {
                        Message::Say(say) => ids.push(say.id.clone()),
                        other => seqs.extend(other.header().map(|header| header.seq)),
                    }
                }
            });
        }
        assert_eq!(seqs, (0..MESSAGES).collect::<Vec<_>>(), "messages in the map");
        ids.sort_unstable();
        assert_eq!(ids, (0..SENTENCES).map(|n| format!("s{n}")).collect::<Vec<_>>(), "sentences in the map");
        let map = again.save().unwrap();
        assert!(map == self.server.fold.save().unwrap(), "the journal makes another map");
        let (robot, driven_m) = (again.mapper.snapshot().robot().unwrap(), 0.01 * (MESSAGES - 1) as f64);
        assert!((robot.x_m - driven_m).hypot(robot.y_m) < 0.1, "at {robot:?} after {driven_m} m");
        self.restart(self.disk.after(Crash::Kept, &mut self.random.clone()));
        assert!(map == self.server.fold.save().unwrap(), "checkpoint and rest make another map");
        self.flip(&map);
    }

    /// A bit turns at rest: the same map, or none.
    fn flip(&mut self, map: &[u8]) {
        let mut files = self.disk.files();
        let names: Vec<String> = files.keys().cloned().collect();
        let file = files.get_mut(&names[self.random.random_range(0..names.len())]).unwrap();
        let bit = self.random.random_range(0..8 * file.len());
        file[bit / 8] ^= 1 << (bit % 8);
        let Ok(opened) = Journal::open(SimDisk::with(files)) else {
            self.told.refused_flips += 1;
            return;
        };
        self.told.mended += u64::from(!opened.mended.is_empty());
        let mut fold = Fold::load(&opened.checkpoint.map).unwrap();
        for (_, entry) in opened.tail {
            take(&mut fold, entry, &mut Vec::new());
        }
        assert!(fold.save().unwrap() == map, "a turned bit makes another map: {:?}", opened.mended);
    }
}

/// Takes an entry in; tells which sentences were dealt with.
fn take(fold: &mut Fold, entry: Entry, heard: &mut Vec<u64>) {
    fold.take(entry, &mut |outcome| {
        if let Outcome::Heard(told) = outcome
            && told.status != HeardStatus::Read
        {
            heard.push(told.id.strip_prefix('s').unwrap().parse().unwrap());
        }
    });
}
