//! The data folder: a journal per map, in a folder of the map's id.
//!
//! Files of earlier builds, `{id}.map` and `{id}.json`, begin a journal when they are found; they are kept
//! under `{id}.map.imported`.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use toponym_core::Mapper;
use toponym_journal::disk::sync_folder;
use toponym_journal::{Checkpoint, Entry, Folder, Identity, Journal, JournalError, Opened};
use toponym_proto::keys::check_id;

use crate::fold::{Card, Fold, FoldError};

/// The data folder can't be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The medium failed, or access is denied.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Another process has it.
    #[error("{}: another server uses this data folder; stop it or set another `data`", .0.display())]
    InUse(PathBuf),
    /// A map's journal can't be read or written. It is left as it is.
    #[error("{}: {source}", path.display())]
    Journal {
        /// The map's folder.
        path: PathBuf,
        /// What and where.
        source: JournalError,
    },
    /// A saved map can't be understood. It is left as it is.
    #[error("{}: {source}", path.display())]
    Fold {
        /// The map's folder, or file.
        path: PathBuf,
        /// Why.
        source: FoldError,
    },
    /// What is known beside a saved map of an earlier build can't be read.
    #[error("{}: {source}", path.display())]
    Card {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
}

fn io_error(path: &Path) -> impl FnOnce(io::Error) -> StoreError + '_ {
    move |source| StoreError::Io { path: path.into(), source }
}

/// A map as it was found.
pub struct Found {
    /// The map as of its last checkpoint.
    pub fold: Fold,
    /// What it took in after that, with numbers.
    pub tail: Vec<(u64, Entry)>,
    /// Goes on with it.
    pub journal: Journal<Folder>,
    /// What was mended, for people.
    pub mended: Vec<String>,
}

/// The folder, held for this process alone.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// Locked as long as the store lives.
    _lock: File,
}

impl Store {
    /// Makes the folder if there is none, and takes hold of it.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        fs::create_dir_all(folder).map_err(io_error(folder))?;
        if let Some(parent) = folder.canonicalize().map_err(io_error(folder))?.parent() {
            sync_folder(parent).map_err(io_error(parent))?;
        }
        let path = folder.join("lock");
        let lock = File::create(&path).map_err(io_error(&path))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { folder: folder.into(), _lock: lock }),
            Err(fs::TryLockError::WouldBlock) => Err(StoreError::InUse(folder.into())),
            Err(fs::TryLockError::Error(source)) => Err(StoreError::Io { path, source }),
        }
    }

    /// Folder of a map's journal.
    pub fn journal(&self, id: &str) -> Folder {
        Folder(self.folder.join(id))
    }

    /// Ids of all maps there are. A start that was cut short may have left a folder with nothing in it: that is none.
    pub fn ids(&self) -> Result<Vec<String>, StoreError> {
        let mut ids = Vec::new();
        for entry in fs::read_dir(&self.folder).map_err(io_error(&self.folder))? {
            let path = entry.map_err(io_error(&self.folder))?.path();
            let name = if path.is_dir() { path.file_name() } else { path.file_stem() };
            let is_map =
                if path.is_dir() { is_begun(&path) } else { path.extension().is_some_and(|e| e == "map") };
            match name.and_then(|name| name.to_str()) {
                Some(id) if is_map && check_id("map", id).is_ok() => ids.push(id.to_owned()),
                _ => {}
            }
        }
        ids.sort();
        ids.dedup();
        Ok(ids)
    }

    /// When something was last written to a map's folder; none if that can't be told.
    pub fn written_at(&self, id: &str) -> Option<SystemTime> {
        let times = fs::read_dir(self.folder.join(id)).ok()?.flatten().map(|e| e.metadata()?.modified());
        times.flatten().max()
    }

    /// Reads a map. `hold`: how long the stream of one of an earlier build waits for sentences.
    pub fn load(&self, id: &str, hold: Duration) -> Result<Found, StoreError> {
        let disk = self.journal(id);
        if !is_begun(&disk.0) {
            self.import(id, hold)?;
        }
        let path = disk.0.clone();
        let opened =
            Journal::open(disk).map_err(|source| StoreError::Journal { path: path.clone(), source })?;
        let Opened { journal, checkpoint, tail, mended } = opened;
        let fold = Fold::load(&checkpoint.map).map_err(|source| StoreError::Fold { path, source })?;
        Ok(Found { fold, tail, journal, mended })
    }

    /// Begins a map's journal; when this returns it is durable.
    pub fn create(&self, id: &str, fold: &Fold) -> Result<Journal<Folder>, StoreError> {
        let disk = self.journal(id);
        let path = disk.0.clone();
        fs::create_dir_all(&path).map_err(io_error(&path))?;
        sync_folder(&self.folder).map_err(io_error(&self.folder))?;
        let map = fold.save().map_err(|source| StoreError::Fold { path: path.clone(), source })?;
        Journal::create(disk, identity(fold), map).map_err(|source| StoreError::Journal { path, source })
    }

    /// Gives a map's folder a name that is no map's, and tells it.
    pub fn set_aside(&self, id: &str) -> Result<PathBuf, StoreError> {
        let path = self.folder.join(id);
        let aside = free_name(&self.folder.join(format!("{id}.deleted")));
        fs::rename(&path, &aside).map_err(io_error(&path))?;
        sync_folder(&self.folder).map_err(io_error(&self.folder))?;
        Ok(aside)
    }

    /// Begins the journal of a map that an earlier build saved.
    fn import(&self, id: &str, hold: Duration) -> Result<(), StoreError> {
        let (map, card) = (self.folder.join(format!("{id}.map")), self.folder.join(format!("{id}.json")));
        let bytes = fs::read(&map).map_err(io_error(&map))?;
        let mapper = Mapper::load(&bytes)
            .map_err(|e| StoreError::Fold { path: map.clone(), source: FoldError::Map(e) })?;
        let text = fs::read(&card).map_err(io_error(&card))?;
        let known: Card = serde_json::from_slice(&text)
            .map_err(|source| StoreError::Card { path: card.clone(), source })?;
        self.create(id, &Fold::new(mapper, known, hold))?;
        for path in [map, card] {
            let mut kept = path.clone().into_os_string();
            kept.push(".imported");
            fs::rename(&path, kept).map_err(io_error(&path))?;
        }
        Ok(())
    }
}

/// A name that nothing has yet: with `-1`, or the next number, behind it.
pub fn free_name(path: &Path) -> PathBuf {
    let numbered = |k: u64| {
        let mut name = path.as_os_str().to_owned();
        name.push(format!("-{k}"));
        PathBuf::from(name)
    };
    (1..=u64::from(u32::MAX)).map(numbered).find(|name| !name.exists()).unwrap_or_else(|| path.into())
}

/// Whether a folder has a journal in it, however damaged.
fn is_begun(folder: &Path) -> bool {
    let is_its = |entry: io::Result<fs::DirEntry>| {
        entry.is_ok_and(|entry| !entry.file_name().to_string_lossy().starts_with("new."))
    };
    fs::read_dir(folder).is_ok_and(|mut entries| entries.any(is_its))
}

/// What stands at the head of each file of a map.
pub fn identity(fold: &Fold) -> Identity {
    let config = fold.mapper.config();
    Identity {
        uuid: fold.card.uuid.clone(),
        build: format!("{} {}", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH),
        config: crc32fast::hash(format!("{config:?}").as_bytes()).into(),
        seed: config.seed,
    }
}

/// The map after entry `index`, to be written.
pub fn checkpoint(fold: &Fold, index: u64) -> Result<Checkpoint, FoldError> {
    Ok(Checkpoint { identity: identity(fold), index, map: fold.save()? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_journal::Event;

    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("toponym-store-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        path
    }

    fn fold() -> Fold {
        let card = Card { uuid: "u".into(), robot: "r1".into(), watermark: Some((1, 2)), stamp_ns: 3 };
        Fold::new(Mapper::new(toponym_core::Config::default()), card, Duration::ZERO)
    }

    fn load(store: &Store) -> Result<Found, StoreError> {
        store.load("main", Duration::ZERO)
    }

    #[test]
    fn what_was_written_is_found() {
        let path = folder("written");
        let store = Store::open(&path).unwrap();
        let mut journal = store.create("main", &fold()).unwrap();
        let entry = Entry { at_ns: 9, event: Event::Tick };
        journal.append(&entry.to_bytes().unwrap());
        journal.commit().unwrap();
        assert_eq!(store.ids().unwrap(), ["main"]);
        let found = load(&store).unwrap();
        assert_eq!((found.fold.card, found.tail), (fold().card, vec![(1, entry)]));
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn a_map_of_an_earlier_build_begins_a_journal() {
        let path = folder("earlier");
        let store = Store::open(&path).unwrap();
        fs::write(path.join("main.map"), fold().mapper.save().unwrap()).unwrap();
        fs::write(path.join("main.json"), serde_json::to_vec(&fold().card).unwrap()).unwrap();
        // A start that was cut short.
        fs::create_dir(path.join("main")).unwrap();
        fs::write(path.join("main/new.checkpoint"), b"half").unwrap();
        for _ in 0..2 {
            assert_eq!(store.ids().unwrap(), ["main"]);
            assert_eq!(load(&store).unwrap().fold.card, fold().card);
        }
        assert!(path.join("main.map.imported").is_file());
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn a_map_whose_birth_was_cut_short_is_born_again() {
        let path = folder("birth");
        let store = Store::open(&path).unwrap();
        fs::create_dir(path.join("main")).unwrap();
        fs::write(path.join("main/new.checkpoint"), b"half").unwrap();
        assert!(store.ids().unwrap().is_empty());
        store.create("main", &fold()).unwrap();
        // Only the first checkpoint was written: nothing was acknowledged yet.
        fs::remove_file(path.join("main").join(toponym_journal::segment::name(1))).unwrap();
        assert_eq!(store.ids().unwrap(), ["main"]);
        assert_eq!(load(&store).unwrap().tail, []);
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn a_broken_map_is_named() {
        let path = folder("broken");
        let store = Store::open(&path).unwrap();
        store.create("main", &fold()).unwrap();
        let file = path.join("main").join(toponym_journal::checkpoint::name(0));
        fs::write(&file, b"no map").unwrap();
        let error = load(&store).err().unwrap().to_string();
        assert!(
            error.contains("main") && error.contains(".checkpoint") && error.contains("byte 0"),
            "{error}"
        );
        assert_eq!(fs::read(&file).unwrap(), b"no map");
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn a_folder_has_one_owner() {
        let path = folder("owner");
        let first = Store::open(&path).unwrap();
        assert!(matches!(Store::open(&path), Err(StoreError::InUse(_))));
        drop(first);
        Store::open(&path).unwrap();
        fs::remove_dir_all(path).unwrap();
    }
}
