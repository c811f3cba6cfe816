//! What a robot keeps on disk until the server has it: an outage may last for hours, and the robot's program may end
//! meanwhile.
//!
//! Files `{robot}.{number}.spool` of frames ([`toponym_proto::frame`]), each a message in its bincode form; one is removed when
//! all in it is acknowledged. Written through to disk once a second: what a power cut takes is that second.

use std::collections::VecDeque;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use toponym_proto::frame::{self, Found};
use toponym_proto::{Limits, Message};

/// A file is not made longer than this.
const FILE_BYTES: u64 = 4 << 20;
/// How long what was written may wait to be on disk.
const SYNC: Duration = Duration::from_secs(1);
/// Frames are salted with it: other files are none.
const SALT: u32 = u32::from_le_bytes(*b"tpsp");

/// (boot, seq) of a message.
pub type Place = (u64, u64);

/// One file.
#[derive(Debug)]
struct Part {
    path: PathBuf,
    file: File,
    bytes: u64,
    /// The last message in it.
    last: Place,
}

/// Where a message is.
#[derive(Clone, Copy, Debug)]
struct Kept {
    place: Place,
    /// Number of its file.
    part: u64,
    at: u64,
    bytes: usize,
}

/// A robot's spool.
#[derive(Debug)]
pub struct Spool {
    folder: PathBuf,
    robot: String,
    max_bytes: u64,
    /// Files by number, without gaps from `first` on.
    parts: VecDeque<Part>,
    first: u64,
    /// Messages that are not in memory, oldest first.
    waiting: VecDeque<Kept>,
    synced: Instant,
}

impl Spool {
    /// Makes the folder if there is none, and finds what an earlier run left: it waits.
    ///
    /// # Errors
    /// The medium's.
    pub fn open(folder: &Path, robot: &str, max_bytes: u64) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        let number = |name: &str| -> Option<u64> {
            name.strip_prefix(robot)?.strip_prefix('.')?.strip_suffix(".spool")?.parse().ok()
        };
        let mut numbers = Vec::new();
        for entry in fs::read_dir(folder)? {
            numbers.extend(entry?.file_name().to_str().and_then(number));
        }
        numbers.sort_unstable();
        let mut spool = Self {
            folder: folder.into(),
            robot: robot.into(),
            max_bytes,
            parts: VecDeque::new(),
            first: 0,
            waiting: VecDeque::new(),
            synced: Instant::now(),
        };
        for number in numbers {
            spool.find(number)?;
        }
        Ok(spool)
    }

    /// Reads a file of an earlier run, up to where it breaks off. Then it is numbered anew, without gaps.
    fn find(&mut self, number: u64) -> io::Result<()> {
        let path = self.path(number);
        let bytes = fs::read(&path)?;
        let part = self.first + self.parts.len() as u64;
        let (mut at, mut last) = (0, None);
        while let Found::Frame { payload, end, .. } = frame::read(&bytes, at, SALT) {
            let Some(header) =
                Message::from_bincode(payload, &Limits::NONE).ok().and_then(|m| m.header().cloned())
            else {
                break;
            };
            last = Some((header.boot, header.seq));
            let place = (header.boot, header.seq);
            self.waiting.push_back(Kept { place, part, at: at as u64, bytes: end - at });
            at = end;
        }
        let Some(last) = last else { return fs::remove_file(&path) };
        let file = OpenOptions::new().read(true).write(true).open(&path)?;
        file.set_len(at as u64)?;
        let new = self.path(part);
        if new != path {
            fs::rename(&path, &new)?;
        }
        self.parts.push_back(Part { path: new, file, bytes: at as u64, last });
        Ok(())
    }

    fn path(&self, number: u64) -> PathBuf {
        self.folder.join(format!("{}.{number}.spool", self.robot))
    }

    /// Whether it holds as much as it may; an empty one takes a message in any case.
    pub fn is_full(&self) -> bool {
        !self.parts.is_empty() && self.parts.iter().map(|part| part.bytes).sum::<u64>() >= self.max_bytes
    }

    /// Whether messages wait that are not in memory.
    pub fn waits(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Boot of the first that waits.
    pub fn boot(&self) -> Option<u64> {
        self.waiting.front().map(|kept| kept.place.0)
    }

    /// Keeps a message in its bincode form; if it `waits`, it comes back from [`Spool::next`].
    ///
    /// # Errors
    /// The medium's.
    pub fn keep(&mut self, place: Place, bincode: &[u8], waits: bool) -> io::Result<()> {
        let mut frame = Vec::new();
        frame::append(&mut frame, SALT, place.1, bincode);
        if self.parts.back().is_none_or(|part| part.bytes >= FILE_BYTES) {
            let path = self.path(self.first + self.parts.len() as u64);
            let file = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(&path)?;
            self.parts.push_back(Part { path, file, bytes: 0, last: place });
        }
        let part = self.first + self.parts.len() as u64 - 1;
        let Some(newest) = self.parts.back_mut() else { return Err(ErrorKind::NotFound.into()) };
        newest.file.seek(SeekFrom::Start(newest.bytes))?;
        newest.file.write_all(&frame)?;
        if waits {
            self.waiting.push_back(Kept { place, part, at: newest.bytes, bytes: frame.len() });
        }
        newest.bytes += frame.len() as u64;
        newest.last = place;
        if self.synced.elapsed() >= SYNC {
            newest.file.sync_data()?;
            self.synced = Instant::now();
        }
        Ok(())
    }

    /// The next that waits, if it is of this boot.
    ///
    /// # Errors
    /// The medium's; or what was kept is damaged.
    pub fn next(&mut self, boot: u64) -> io::Result<Option<Message>> {
        let Some(kept) = self.waiting.front().copied().filter(|kept| kept.place.0 == boot) else {
            return Ok(None);
        };
        self.waiting.pop_front();
        let part = self.parts.get_mut((kept.part - self.first) as usize).ok_or(ErrorKind::NotFound)?;
        let mut bytes = vec![0; kept.bytes];
        part.file.seek(SeekFrom::Start(kept.at))?;
        part.file.read_exact(&mut bytes)?;
        let damaged =
            |why: String| io::Error::new(ErrorKind::InvalidData, format!("{}: {why}", part.path.display()));
        match frame::read(&bytes, 0, SALT) {
            Found::Frame { payload, .. } => {
                Message::from_bincode(payload, &Limits::NONE).map(Some).map_err(|e| damaged(e.to_string()))
            }
            _ => Err(damaged(format!("damaged at byte {}", kept.at))),
        }
    }

    /// All up to this is acknowledged: files with nothing else in them go.
    ///
    /// # Errors
    /// The medium's.
    pub fn acknowledged(&mut self, upto: Place) -> io::Result<()> {
        while self.waiting.front().is_some_and(|kept| kept.place <= upto) {
            self.waiting.pop_front();
        }
        while let Some(part) = self.parts.front().filter(|part| part.last <= upto) {
            fs::remove_file(&part.path)?;
            self.parts.pop_front();
            self.first += 1;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_proto::{End, Header};

    fn message(boot: u64, seq: u64) -> Message {
        Message::End(End { header: Header { robot: "r1".into(), boot, seq, ..Header::default() } })
    }

    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("toponym-spool-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        path
    }

    fn keep(spool: &mut Spool, boot: u64, seq: u64, waits: bool) {
        spool.keep((boot, seq), &message(boot, seq).to_bincode().unwrap(), waits).unwrap();
    }

    #[test]
    fn what_waits_comes_back_in_order_and_after_a_restart_all_that_is_left() {
        let path = folder("order");
        let mut spool = Spool::open(&path, "r1", 1 << 20).unwrap();
        for seq in 0..10 {
            keep(&mut spool, 7, seq, seq >= 4);
        }
        assert_eq!(spool.next(7).unwrap(), Some(message(7, 4)));
        assert_eq!(spool.next(8).unwrap(), None, "of another boot");
        drop(spool);
        // Torn in the middle of the last.
        let file = path.join("r1.0.spool");
        let bytes = fs::read(&file).unwrap();
        fs::write(&file, &bytes[..bytes.len() - 3]).unwrap();
        let mut spool = Spool::open(&path, "r1", 1 << 20).unwrap();
        assert_eq!(spool.boot(), Some(7));
        let left: Vec<Message> = std::iter::from_fn(|| spool.next(7).unwrap()).collect();
        assert_eq!(left, (0..9).map(|seq| message(7, seq)).collect::<Vec<_>>());
        spool.acknowledged((7, 8)).unwrap();
        assert_eq!(fs::read_dir(&path).unwrap().count(), 0);
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn it_is_bounded_and_frees_what_is_acknowledged() {
        let path = folder("bound");
        let mut spool = Spool::open(&path, "r1", 2 * FILE_BYTES).unwrap();
        let mut seq = 0;
        while !spool.is_full() {
            keep(&mut spool, 1, seq, true);
            seq += 1;
        }
        let files = fs::read_dir(&path).unwrap().count();
        assert_eq!(files, 2);
        spool.acknowledged((1, seq - 2)).unwrap();
        assert!(!spool.is_full());
        assert_eq!(spool.next(1).unwrap(), Some(message(1, seq - 1)));
        fs::remove_dir_all(path).unwrap();
    }
}
