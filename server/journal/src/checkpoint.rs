//! A checkpoint: a map as it is after an entry of its journal.
//!
//! ```text
//!   0  toponym-checkpoint 1\n
//!  64  a frame: the map's identity (JSON)
//!      frames of up to 1 MiB: the map's bytes
//!      a frame of 8 bytes: how many bytes these are
//! ```
//! All frames have the number of the entry.

use crate::segment::{check_magic, identity};
use crate::{Disk, DiskFile, Identity, JournalError};
use toponym_proto::frame::{self, Found};

/// First line.
const MAGIC: &[u8] = b"toponym-checkpoint 1\n";
/// Where the identity stands.
const HEAD_AT: usize = 64;
/// Bytes of the map in a frame.
const CHUNK: usize = 1 << 20;
/// Name while it is being written.
const NEW: &str = "new.checkpoint";

/// A map after an entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkpoint {
    /// Whose.
    pub identity: Identity,
    /// Number of the last entry in it; 0: none.
    pub index: u64,
    /// What the map's owner wrote.
    pub map: Vec<u8>,
}

/// Name of the checkpoint after this entry.
pub fn name(index: u64) -> String {
    format!("{index:020}.checkpoint")
}

/// Entry after which the checkpoint of this name was made.
pub fn index_of(name: &str) -> Option<u64> {
    let digits = name.strip_suffix(".checkpoint").filter(|digits| digits.len() == 20)?;
    digits.parse().ok().filter(|index| *index <= crate::segment::INDEX_MAX)
}

impl Checkpoint {
    /// Writes it; when this returns it is durable.
    pub fn write<D: Disk>(&self, disk: &D) -> Result<(), JournalError> {
        let name = name(self.index);
        let make = || {
            let mut file = disk.create(NEW, 0)?;
            let mut at = 0;
            // Piece by piece: beside the map there is no room for another one.
            for piece in self.pieces() {
                file.write_at(at, &piece)?;
                at += piece.len() as u64;
            }
            file.sync()?;
            disk.rename(NEW, &name)?;
            disk.sync_names()
        };
        make().map_err(JournalError::io(&name))
    }

    /// The file's bytes: head and first frame of the map, its other frames, and how many bytes these are.
    fn pieces(&self) -> impl Iterator<Item = Vec<u8>> {
        let salt = self.identity.salt();
        let mut head = MAGIC.to_vec();
        head.resize(HEAD_AT, 0);
        frame::append(&mut head, salt, self.index, &serde_json::to_vec(&self.identity).unwrap_or_default());
        let length = (self.map.len() as u64).to_le_bytes();
        let chunks = self.map.chunks(CHUNK).map(<[u8]>::to_vec).chain([length.to_vec()]);
        chunks.map(move |chunk| {
            let mut piece = std::mem::take(&mut head);
            frame::append(&mut piece, salt, self.index, &chunk);
            piece
        })
    }

    /// Whether a file with these first bytes is one.
    pub fn is_one(bytes: &[u8]) -> bool {
        bytes.starts_with(MAGIC)
    }

    /// Reads a file.
    pub fn read(name: &str, bytes: &[u8]) -> Result<Self, JournalError> {
        check_magic(name, bytes, MAGIC)?;
        let index = index_of(name).or_else(|| frame::u64_at(bytes, HEAD_AT + 8)).unwrap_or_default();
        let (identity, salt) = identity(name, bytes, HEAD_AT, index)?;
        let mut at = HEAD_AT + frame::HEAD + frame::u32_at(bytes, HEAD_AT).unwrap_or_default() as usize;
        let mut map = Vec::new();
        loop {
            let damaged = |why: &str| JournalError::damaged(name, at, why);
            match frame::read(bytes, at, salt) {
                Found::Frame { index: found, payload, end } if found == index => {
                    let length = (map.len() as u64).to_le_bytes();
                    if end == bytes.len() {
                        return if payload == length {
                            Ok(Self { identity, index, map })
                        } else {
                            Err(damaged("it is longer or shorter than it was"))
                        };
                    }
                    map.extend_from_slice(payload);
                    at = end;
                }
                Found::Frame { .. } => return Err(damaged("a frame of another checkpoint")),
                Found::Blank => return Err(damaged("breaks off")),
                Found::Broken(why) => return Err(damaged(why)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read_and_every_bit_counts() {
        let identity = Identity { uuid: "u".into(), build: "b".into(), config: 1, seed: 2 };
        let map: Vec<u8> = (0..CHUNK + 1000).map(|i| (i % 251) as u8).collect();
        let checkpoint = Checkpoint { identity, index: 77, map };
        let bytes = checkpoint.pieces().collect::<Vec<_>>().concat();
        assert_eq!(Checkpoint::read(&name(77), &bytes).unwrap(), checkpoint);
        assert!(Checkpoint::read(&name(78), &bytes).is_err());
        let small = Checkpoint { map: vec![7; 40], ..checkpoint };
        let bytes = small.pieces().collect::<Vec<_>>().concat();
        for bit in 0..8 * bytes.len() {
            let mut turned = bytes.clone();
            turned[bit / 8] ^= 1 << (bit % 8);
            let read = Checkpoint::read(&name(77), &turned);
            assert!(read.is_err() || read.unwrap() == small, "bit {bit}");
        }
        for cut in 0..bytes.len() {
            assert!(Checkpoint::read(&name(77), &bytes[..cut]).is_err(), "cut to {cut}");
        }
    }
}
