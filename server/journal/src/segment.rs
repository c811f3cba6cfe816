//! A segment: a stretch of the journal, in a file that has its full length from the start.
//!
//! ```text
//!    0  toponym-journal 2\n
//!   64  a frame: the map's identity (JSON), index = number of the first entry
//! 3072  slot 0:  index of the last durable entry u64 │ crc u32, of these and of the slot's number
//! 3584  slot 1:  the same, of the commit before or after
//! 4096  a frame per entry, then zeros
//! ```
//! A commit syncs its entries, then writes the slot that is not the newest, and syncs that: what a
//! slot says is durable, is; and if one is torn or lost, the other one still holds, as long as the entries bear out that
//! the lost one told of no more than is there. (A slot lost *and* the whole of the last entries zeroed looks like a stop
//! before them: that is opened, and told as mended.) Format 1 is read; its slots do not say which they are.

use crate::{Disk, DiskFile, Identity, JournalError};
use std::ops::Range;
use toponym_proto::frame::{self, Found, u32_at, u64_at};

/// First line.
const MAGIC: &[u8] = b"toponym-journal 2\n";
/// That of the format before.
const MAGIC_1: &[u8] = b"toponym-journal 1\n";
/// Where the identity stands.
const HEAD_AT: usize = 64;
/// Where the slots stand, each in a sector of its own.
pub const SLOTS_AT: [usize; 2] = [3072, 3584];
/// Where entries begin.
pub const FRAMES_AT: usize = 4096;
/// Name while it is being made.
const NEW: &str = "new.journal";

/// Name of the segment that begins with this entry.
pub fn name(first: u64) -> String {
    format!("{first:020}.journal")
}

/// No journal is that long: a number beyond is forged.
pub const INDEX_MAX: u64 = 1 << 62;

/// First entry of the segment of this name.
pub fn first_of(name: &str) -> Option<u64> {
    let digits = name.strip_suffix(".journal").filter(|digits| digits.len() == 20)?;
    digits.parse().ok().filter(|first| *first <= INDEX_MAX)
}

fn slot(salt: u32, place: usize, durable: u64) -> [u8; 12] {
    let mut bytes = [0; 12];
    let (index, crc) = bytes.split_at_mut(8);
    index.copy_from_slice(&durable.to_le_bytes());
    crc.copy_from_slice(&slot_checksum(salt, Some(place), durable).to_le_bytes());
    bytes
}

fn slot_checksum(salt: u32, place: Option<usize>, durable: u64) -> u32 {
    let mut crc = crc32fast::Hasher::new_with_initial(salt);
    crc.update(b"slot");
    crc.update(place.map(|place| place as u8).as_slice());
    crc.update(&durable.to_le_bytes());
    crc.finalize()
}

/// A segment that is being written.
pub struct Writer<F> {
    pub(crate) name: String,
    file: F,
    salt: u32,
    /// Where the next frame goes.
    at: usize,
    size: usize,
    newest_slot: usize,
}

impl<F: DiskFile> Writer<F> {
    /// Makes a segment for entries from `first` on; when this returns it is durable.
    pub fn create<D: Disk<File = F>>(
        disk: &D,
        identity: &Identity,
        first: u64,
        size: usize,
    ) -> Result<Self, JournalError> {
        let (name, salt) = (name(first), identity.salt());
        let json =
            serde_json::to_vec(identity).map_err(|e| JournalError::io(&name)(std::io::Error::other(e)))?;
        let mut head = MAGIC.to_vec();
        head.resize(HEAD_AT, 0);
        frame::append(&mut head, salt, first, &json);
        for (place, at) in SLOTS_AT.into_iter().enumerate() {
            head.resize(at, 0);
            head.extend(slot(salt, place, first.saturating_sub(1)));
        }
        let make = || {
            let mut file = disk.create(NEW, size as u64)?;
            file.write_at(0, &head)?;
            file.sync()?;
            disk.rename(NEW, &name)?;
            disk.sync_names()?;
            Ok(file)
        };
        let file = make().map_err(JournalError::io(&name))?;
        Ok(Self { name, file, salt, at: FRAMES_AT, size, newest_slot: 0 })
    }

    /// Whether so many bytes more go in.
    pub fn has_room(&self, bytes: usize) -> bool {
        self.at + bytes <= self.size
    }

    /// Writes frames, the last of which has this number; when this returns they are durable, and known to be.
    pub fn commit(&mut self, frames: &[u8], durable: u64) -> std::io::Result<()> {
        self.file.write_at(self.at as u64, frames)?;
        self.file.sync()?;
        let other = 1 - self.newest_slot;
        let at = SLOTS_AT.get(other).copied().unwrap_or_default();
        self.file.write_at(at as u64, &slot(self.salt, other, durable))?;
        self.file.sync()?;
        self.at += frames.len();
        self.newest_slot = other;
        Ok(())
    }
}

/// What a segment's file says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Name of the file.
    pub name: String,
    /// Whose.
    pub identity: Identity,
    /// Number of its first entry.
    pub first: u64,
    /// Last entry that is known to be durable; `first − 1` if there is none.
    pub durable: u64,
    /// Slots that can't be read, of two.
    pub slots_lost: usize,
    /// Payloads of its entries from `first` on, as ranges of the file.
    pub entries: Vec<Range<usize>>,
    /// Where something stands that is no entry; none if nothing was written behind the last.
    pub broken: Option<(usize, String)>,
    /// Where the entries end.
    pub end: usize,
}

/// Reads a segment's file.
///
/// # Errors
/// If its head is damaged, or says something else than its name.
pub fn read(name: &str, bytes: &[u8]) -> Result<Segment, JournalError> {
    let damaged = |offset, why: &str| JournalError::damaged(name, offset, why);
    let first = first_of(name).ok_or_else(|| damaged(0, "its name is no segment's"))?;
    let is_old = bytes.starts_with(MAGIC_1);
    if !is_old {
        check_magic(name, bytes, MAGIC)?;
    }
    let (identity, salt) = identity(name, bytes, HEAD_AT, first)?;
    let slots = [0, 1].map(|place| {
        let at = SLOTS_AT[place];
        let (durable, crc) = (u64_at(bytes, at)?, u32_at(bytes, at + 8)?);
        (slot_checksum(salt, (!is_old).then_some(place), durable) == crc
            && durable <= INDEX_MAX
            && durable + 1 >= first)
            .then_some(durable)
    });
    let Some(durable) = slots.iter().flatten().max().copied() else {
        return Err(damaged(SLOTS_AT[0], "neither slot tells what is durable"));
    };
    let slots_lost = slots.iter().filter(|slot| slot.is_none()).count();
    let mut segment = Segment {
        name: name.into(),
        identity,
        first,
        durable,
        slots_lost,
        entries: Vec::new(),
        broken: None,
        end: FRAMES_AT,
    };
    loop {
        let next = first + segment.entries.len() as u64;
        match frame::read(bytes, segment.end, salt) {
            Found::Frame { index, payload, end } if index == next => {
                segment.entries.push(end - payload.len()..end);
                segment.end = end;
            }
            Found::Frame { index, .. } => {
                segment.broken = Some((segment.end, format!("entry {index} where {next} is expected")));
            }
            Found::Blank => break,
            Found::Broken(why) => segment.broken = Some((segment.end, why.into())),
        }
        if segment.broken.is_some() {
            break;
        }
    }
    Ok(segment)
}

/// Checks a file's first line.
pub(crate) fn check_magic(name: &str, bytes: &[u8], magic: &[u8]) -> Result<(), JournalError> {
    if bytes.starts_with(magic) {
        return Ok(());
    }
    let kind = magic.split(|b| *b == b' ').next().unwrap_or_default();
    let line = bytes.split(|b| *b == b'\n').next().unwrap_or_default();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_end().to_owned();
    let version = line.strip_prefix(kind).and_then(|rest| rest.strip_prefix(b" "));
    match version {
        Some(version) if line.len() < 64 && version.iter().all(u8::is_ascii_digit) => {
            Err(JournalError::Format { file: name.into(), found: text(line), expected: text(magic) })
        }
        _ => Err(JournalError::damaged(name, 0, format!("it does not begin with {:?}", text(magic)))),
    }
}

/// Reads the frame with a file's identity at byte `at`, with the salt of all others.
pub(crate) fn identity(
    name: &str,
    bytes: &[u8],
    at: usize,
    index: u64,
) -> Result<(Identity, u32), JournalError> {
    let damaged = |why: &str| JournalError::damaged(name, at, why);
    let length = u32_at(bytes, at).ok_or_else(|| damaged("breaks off before its head"))? as usize;
    let json = bytes.get(at + frame::HEAD..).and_then(|rest| rest.get(..length));
    let json = json.ok_or_else(|| damaged("its head is longer than the file"))?;
    let identity: Identity = serde_json::from_slice(json).map_err(|_| damaged("its head can't be read"))?;
    // The salt comes out of what it protects: a turned bit changes both.
    let salt = identity.salt();
    match frame::read(bytes, at, salt) {
        Found::Frame { index: found, .. } if found == index => Ok((identity, salt)),
        Found::Frame { .. } => Err(damaged("its head is that of another file")),
        Found::Blank | Found::Broken(_) => Err(damaged("its head's checksum is another")),
    }
}
