//! A map's journal: every message is on disk before the filter sees it, and is acknowledged only
//! then. The map is a fold of its journal; a checkpoint is the fold so far.
//!
//! One folder per map:
//!
//! | file | what |
//! |---|---|
//! | `{first:020}.journal` | a segment: entries from number `first` on ([`segment`]) |
//! | `{index:020}.checkpoint` | the map after entry `index` ([`checkpoint`]); the newest two are kept |
//! | `new.*` | being written; means nothing |
//!
//! Both are made of frames ([`toponym_proto::frame`]): length, checksum, number, payload.
//!
//! # What is assumed of the medium
//! - What was written before a sync that succeeded is there after it, in order or not; what was not
//!   synced is there, or not, or partly, each sector of 512 bytes whole (old or new).
//! - A rename within the folder is atomic, and is there once the folder is synced.
//! - A sync that failed says nothing of what it should have written: the file is left alone, and
//!   what is not durable yet is written again to a new one.
//! - Bits may turn, sectors may be lost. A frame's CRC-32 misses that once in 4·10⁹.
//!
//! # What is promised
//! - *Acknowledged ⊆ recovered*: [`Journal::commit`] returns when its entries, and the word that
//!   they are there ([`segment`], slots), are synced.
//! - *Torn is mended, damaged is refused*: what breaks off behind the durable mark was acknowledged to
//!   nobody and is cut. Anything broken before it is an error that names file and offset; nothing
//!   is loaded then, and nothing is written.

pub mod checkpoint;
pub mod disk;
pub mod entry;
mod journal;
pub mod recover;
pub mod segment;

pub use checkpoint::Checkpoint;
pub use disk::{Disk, DiskFile, Folder};
pub use entry::{Entry, Event};
pub use journal::{Journal, Opened, prune};

use serde::{Deserialize, Serialize};

/// Whose journal it is; stands at the head of each of its files.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Born once with the map; files of another map are never taken for this one's.
    pub uuid: String,
    /// Build that wrote the file.
    pub build: String,
    /// Hash of the filter's settings, for people who compare.
    pub config: u64,
    /// The filter's seed.
    pub seed: u64,
}

impl Identity {
    /// Where the checksums of this map's frames begin, so that no frame of another map fits.
    fn salt(&self) -> u32 {
        crc32fast::hash(self.uuid.as_bytes())
    }
}

/// A journal can't be read or written.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The medium failed, or is full.
    #[error("{file}: {source}")]
    Io {
        /// Which file.
        file: String,
        /// Why.
        source: std::io::Error,
    },
    /// What was durable is not there as it was written.
    #[error("{file}: damaged at byte {offset}: {why}")]
    Damaged {
        /// Which file.
        file: String,
        /// Where in it.
        offset: u64,
        /// What is wrong there.
        why: String,
    },
    /// Written by a newer build.
    #[error("{file}: format {found:?}, this build reads up to {expected:?}")]
    Format {
        /// Which file.
        file: String,
        /// Its first line.
        found: String,
        /// What this build writes.
        expected: String,
    },
}

impl JournalError {
    fn io(file: &str) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| Self::Io { file: file.into(), source }
    }

    fn damaged(file: &str, offset: usize, why: impl Into<String>) -> Self {
        Self::Damaged { file: file.into(), offset: offset as u64, why: why.into() }
    }
}
