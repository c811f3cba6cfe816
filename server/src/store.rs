//! The data folder: saved maps.
//!
//! Per map `{id}.map`, what [`Mapper::save`] wrote, and `{id}.json`, what the core doesn't know of
//! it ([`Card`]). Both are replaced whole: written aside, made durable, renamed. The card comes
//! second: should the machine stop in between, messages after the older watermark come again.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use toponym_core::Mapper;
use toponym_proto::keys::check_id;

/// What is known of a map beside the map.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Card {
    /// Born once with the map.
    pub uuid: String,
    /// The robot that maps it.
    pub robot: String,
    /// (boot, seq) of the last message in it.
    pub watermark: Option<(u64, u64)>,
    /// Newest stamp in it, ns.
    pub stamp_ns: i64,
}

/// The data folder can't be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The medium failed, or access is denied.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Another process has it.
    #[error("{}: another server uses this data folder; stop it or set another `data`", .0.display())]
    InUse(PathBuf),
    /// A saved map can't be understood. It is left as it is.
    #[error(
        "{}: {reason}; move it away to start without this map, or use the build that wrote it",
        path.display()
    )]
    Broken {
        /// Which file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

fn io_error(path: &Path) -> impl FnOnce(std::io::Error) -> StoreError + '_ {
    move |source| StoreError::Io { path: path.into(), source }
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
        let path = folder.join("lock");
        let lock = File::create(&path).map_err(io_error(&path))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { folder: folder.into(), _lock: lock }),
            Err(fs::TryLockError::WouldBlock) => Err(StoreError::InUse(folder.into())),
            Err(fs::TryLockError::Error(source)) => Err(StoreError::Io { path, source }),
        }
    }

    /// All saved maps by id.
    pub fn load(&self) -> Result<BTreeMap<String, (Mapper, Card)>, StoreError> {
        let mut maps = BTreeMap::new();
        for entry in fs::read_dir(&self.folder).map_err(io_error(&self.folder))? {
            let path = entry.map_err(io_error(&self.folder))?.path();
            let id = path.file_stem().and_then(|s| s.to_str()).unwrap_or_default();
            if path.extension().is_none_or(|e| e != "map") || check_id("map", id).is_err() {
                continue;
            }
            let broken = |path: &Path, reason: String| StoreError::Broken { path: path.into(), reason };
            let bytes = fs::read(&path).map_err(io_error(&path))?;
            let mapper = Mapper::load(&bytes).map_err(|e| broken(&path, e.to_string()))?;
            let card_path = path.with_extension("json");
            let text = fs::read(&card_path).map_err(io_error(&card_path))?;
            let card = serde_json::from_slice(&text).map_err(|e| broken(&card_path, e.to_string()))?;
            maps.insert(id.to_string(), (mapper, card));
        }
        Ok(maps)
    }

    /// Saves a map; when this returns it is on the medium.
    pub fn save(&self, id: &str, map: &[u8], card: &Card) -> Result<(), StoreError> {
        self.replace(&format!("{id}.map"), map)?;
        let path = self.folder.join(format!("{id}.json"));
        let text = serde_json::to_vec_pretty(card)
            .map_err(|e| StoreError::Broken { path, reason: e.to_string() })?;
        self.replace(&format!("{id}.json"), &text)
    }

    fn replace(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        let aside = self.folder.join(format!("{name}.new"));
        let mut file = File::create(&aside).map_err(io_error(&aside))?;
        file.write_all(bytes).and_then(|()| file.sync_all()).map_err(io_error(&aside))?;
        let path = self.folder.join(name);
        fs::rename(&aside, &path).map_err(io_error(&path))?;
        File::open(&self.folder).and_then(|folder| folder.sync_all()).map_err(io_error(&self.folder))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("toponym-store-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        path
    }

    fn card() -> Card {
        Card { uuid: "u".into(), robot: "r1".into(), watermark: Some((1, 2)), stamp_ns: 3 }
    }

    #[test]
    fn what_was_saved_is_loaded() {
        let path = folder("saved");
        let store = Store::open(&path).unwrap();
        let map = Mapper::new(toponym_core::Config::default()).save().unwrap();
        store.save("main", &map, &card()).unwrap();
        store.save("main", &map, &Card { watermark: Some((1, 9)), ..card() }).unwrap();
        let maps = store.load().unwrap();
        let (mapper, known) = &maps["main"];
        assert_eq!((mapper.save().unwrap() == map, known.watermark), (true, Some((1, 9))));
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn what_is_half_written_does_not_count() {
        let path = folder("half");
        let store = Store::open(&path).unwrap();
        let map = Mapper::new(toponym_core::Config::default()).save().unwrap();
        store.save("main", &map, &card()).unwrap();
        fs::write(path.join("main.map.new"), b"half").unwrap();
        fs::write(path.join("main.json.new"), b"half").unwrap();
        assert_eq!(store.load().unwrap()["main"].1, card());
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn a_broken_file_is_named() {
        let path = folder("broken");
        let store = Store::open(&path).unwrap();
        let map = Mapper::new(toponym_core::Config::default()).save().unwrap();
        store.save("main", &map, &card()).unwrap();
        fs::write(path.join("main.json"), b"{").unwrap();
        let error = store.load().unwrap_err().to_string();
        assert!(error.contains("main.json") && error.contains("move it away"), "{error}");
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
