//! A medium that fails on purpose: it forgets what was not synced, in all the ways that
//! the assumptions allow, and refuses what it is told to refuse.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use toponym_journal::{Disk, DiskFile};

/// A sector is written whole or not at all.
const SECTOR: usize = 512;

/// What becomes of what was not synced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crash {
    /// It is gone.
    Lost,
    /// All of it is there.
    Kept,
    /// The last write is cut somewhere at a sector; those before are there.
    Torn,
    /// Each sector of each write is there or not.
    Reordered,
    /// Each sector is there or not, and a bit of it may have turned.
    Flipped,
}

/// All there are.
pub const CRASHES: [Crash; 5] = [Crash::Lost, Crash::Kept, Crash::Torn, Crash::Reordered, Crash::Flipped];

/// What the medium refuses from now on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Writes fail, having written half.
    ShortWrite,
    /// Writes and new files fail: it is full.
    Full,
    /// Syncs fail.
    Sync,
    /// Syncs of files succeed and do nothing, as if the journal acknowledged before it synced: a test that does not
    /// notice is none.
    Lie,
}

#[derive(Clone, Debug, Default)]
struct Content {
    /// As last synced.
    durable: Vec<u8>,
    /// As written.
    written: Vec<u8>,
    /// Writes since the last sync.
    pending: Vec<(usize, Vec<u8>)>,
}

#[derive(Clone, Debug)]
enum Rename {
    Create(String, usize),
    Move(String, String),
    Remove(String),
}

#[derive(Debug, Default)]
struct State {
    contents: Vec<Content>,
    /// Names as they are now, and as last synced.
    names: BTreeMap<String, usize>,
    durable_names: BTreeMap<String, usize>,
    /// Changes of names since.
    renames: Vec<Rename>,
    /// Operations so far.
    operations: usize,
    /// At this one the machine stops: nothing works any more.
    stops_at: Option<usize>,
    fault: Option<Fault>,
}

/// The medium; a clone is the same one.
#[derive(Clone, Debug, Default)]
pub struct SimDisk {
    state: Arc<Mutex<State>>,
}

/// A file of it.
#[derive(Debug)]
pub struct SimFile {
    disk: SimDisk,
    id: usize,
}

impl SimDisk {
    /// A medium with these files, all durable.
    pub fn with(files: impl IntoIterator<Item = (String, Vec<u8>)>) -> Self {
        let disk = Self::default();
        let mut state = disk.lock();
        for (name, bytes) in files {
            state.contents.push(Content { durable: bytes.clone(), written: bytes, pending: vec![] });
            let id = state.contents.len() - 1;
            state.names.insert(name, id);
        }
        state.durable_names = state.names.clone();
        drop(state);
        disk
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Operations so far.
    pub fn operations(&self) -> usize {
        self.lock().operations
    }

    /// The machine stops in the middle of this operation.
    pub fn stop_at(&self, operation: usize) {
        self.lock().stops_at = Some(operation);
    }

    /// From now on this fails; none: all works again.
    pub fn set_fault(&self, fault: Option<Fault>) {
        self.lock().fault = fault;
    }

    /// Its files, as they would be read now.
    pub fn files(&self) -> BTreeMap<String, Vec<u8>> {
        let state = self.lock();
        let content = |id: &usize| state.contents.get(*id).map(|c| c.written.clone()).unwrap_or_default();
        state.names.iter().map(|(name, id)| (name.clone(), content(id))).collect()
    }

    /// The medium after the machine has stopped and started again.
    #[must_use]
    pub fn after(&self, crash: Crash, random: &mut ChaCha8Rng) -> Self {
        let state = self.lock();
        let mut names = state.durable_names.clone();
        let done = match crash {
            Crash::Lost => 0,
            Crash::Kept => state.renames.len(),
            _ => random.random_range(0..=state.renames.len()),
        };
        state.renames.iter().take(done).for_each(|rename| rename.apply(&mut names));
        let files: Vec<(String, Vec<u8>)> = names
            .into_iter()
            .filter_map(|(name, id)| Some((name, state.contents.get(id)?.after(crash, random))))
            .collect();
        drop(state);
        Self::with(files)
    }

    /// Counts an operation; an error once the machine has stopped.
    fn operate(&self) -> io::Result<MutexGuard<'_, State>> {
        let mut state = self.lock();
        if state.stops_at.is_some_and(|at| state.operations >= at) {
            return Err(io::Error::other("the machine has stopped"));
        }
        state.operations += 1;
        Ok(state)
    }
}

impl Rename {
    fn apply(&self, names: &mut BTreeMap<String, usize>) {
        match self {
            Self::Create(name, id) => {
                names.insert(name.clone(), *id);
            }
            Self::Move(from, to) => {
                if let Some(id) = names.remove(from) {
                    names.insert(to.clone(), id);
                }
            }
            Self::Remove(name) => {
                names.remove(name);
            }
        }
    }
}

impl Content {
    fn write(into: &mut Vec<u8>, offset: usize, bytes: &[u8]) {
        if into.len() < offset + bytes.len() {
            into.resize(offset + bytes.len(), 0);
        }
        if let Some(place) = into.get_mut(offset..offset + bytes.len()) {
            place.copy_from_slice(bytes);
        }
    }

    fn after(&self, crash: Crash, random: &mut ChaCha8Rng) -> Vec<u8> {
        let mut bytes = self.durable.clone();
        for (k, (offset, written)) in self.pending.iter().enumerate() {
            let last = k + 1 == self.pending.len();
            let cut = random.random_range(0..=written.len() / SECTOR);
            let mut at = 0;
            while at < written.len() {
                // Up to the end of the sector of the file.
                let length = (SECTOR - (offset + at) % SECTOR).min(written.len() - at);
                let kept = match crash {
                    Crash::Lost => false,
                    Crash::Kept => true,
                    Crash::Torn => !last || at / SECTOR < cut,
                    Crash::Reordered | Crash::Flipped => random.random_bool(0.5),
                };
                if let (true, Some(sector)) = (kept, written.get(at..at + length)) {
                    let mut sector = sector.to_vec();
                    if crash == Crash::Flipped && random.random_bool(0.5) {
                        let bit = random.random_range(0..8 * sector.len());
                        if let Some(byte) = sector.get_mut(bit / 8) {
                            *byte ^= 1 << (bit % 8);
                        }
                    }
                    Self::write(&mut bytes, offset + at, &sector);
                }
                at += length;
            }
        }
        bytes
    }
}

impl Disk for SimDisk {
    type File = SimFile;

    fn list(&self) -> io::Result<Vec<String>> {
        Ok(self.lock().names.keys().cloned().collect())
    }

    fn read(&self, name: &str) -> io::Result<Vec<u8>> {
        self.files().remove(name).ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn create(&self, name: &str, bytes: u64) -> io::Result<SimFile> {
        let mut state = self.operate()?;
        if state.fault == Some(Fault::Full) {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let zeros = vec![0; bytes as usize];
        state.contents.push(Content { durable: zeros.clone(), written: zeros, pending: vec![] });
        let id = state.contents.len() - 1;
        state.names.insert(name.into(), id);
        state.renames.push(Rename::Create(name.into(), id));
        Ok(SimFile { disk: self.clone(), id })
    }

    fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        let mut state = self.operate()?;
        let rename = Rename::Move(from.into(), to.into());
        rename.apply(&mut state.names);
        state.renames.push(rename);
        Ok(())
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        let mut state = self.operate()?;
        let rename = Rename::Remove(name.into());
        rename.apply(&mut state.names);
        state.renames.push(rename);
        Ok(())
    }

    fn sync_names(&self) -> io::Result<()> {
        let mut state = self.operate()?;
        if state.fault == Some(Fault::Sync) {
            return Err(io::Error::from_raw_os_error(5));
        }
        state.durable_names = state.names.clone();
        state.renames.clear();
        Ok(())
    }
}

impl DiskFile for SimFile {
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        let mut state = self.disk.operate()?;
        // In the middle of an operation: what it wrote is there as far as the crash says.
        let stops = state.stops_at == Some(state.operations);
        let fault = state.fault;
        let part = if fault == Some(Fault::ShortWrite) { bytes.len() / 2 } else { bytes.len() };
        if fault == Some(Fault::Full) {
            return Err(io::ErrorKind::StorageFull.into());
        }
        if let (Some(content), Some(bytes)) = (state.contents.get_mut(self.id), bytes.get(..part)) {
            Content::write(&mut content.written, offset as usize, bytes);
            content.pending.push((offset as usize, bytes.to_vec()));
        }
        match fault {
            Some(Fault::ShortWrite) => Err(io::ErrorKind::WriteZero.into()),
            _ if stops => Err(io::Error::other("the machine has stopped")),
            _ => Ok(()),
        }
    }

    fn sync(&mut self) -> io::Result<()> {
        let mut state = self.disk.operate()?;
        if state.fault == Some(Fault::Sync) {
            return Err(io::Error::from_raw_os_error(5));
        }
        if state.stops_at == Some(state.operations) {
            return Err(io::Error::other("the machine has stopped"));
        }
        if state.fault == Some(Fault::Lie) {
            return Ok(());
        }
        if let Some(content) = state.contents.get_mut(self.id) {
            content.durable = content.written.clone();
            content.pending.clear();
        }
        Ok(())
    }
}
