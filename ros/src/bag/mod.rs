//! rosbag2's files: messages as they were received, whatever they are of.
//!
//! A bag is a folder with parts (MCAP or SQLite), or one of these alone. `metadata.yaml` is not needed: what a part is its
//! content says, and parts are read in the order of the numbers in their names.

mod mcap;
mod scratch;
mod sqlite;
mod write;

pub use self::write::BagWriter;

use self::mcap::McapPart;
use self::sqlite::SqlitePart;
use std::collections::VecDeque;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Topics that a bag may have.
const TOPICS_MAX: usize = 10_000;
/// A message may not be longer, bytes.
const MESSAGE_MAX: usize = 256 << 20;
/// First bytes of a Zstandard frame.
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
const MCAP: &[u8] = b"\x89MCAP";
const SQLITE: &[u8] = b"SQLite format 3\0";

/// A topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// `/scan`
    pub name: String,
    /// `sensor_msgs/msg/LaserScan`
    pub kind: String,
    /// Whether messages are CDR.
    pub is_cdr: bool,
}

/// A message of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raw {
    /// Index among the bag's topics.
    pub topic: usize,
    /// When it was received, nanoseconds.
    pub received_ns: i64,
    /// As it was sent, not compressed.
    pub data: Vec<u8>,
}

/// Topics of all parts.
#[derive(Clone, Debug, Default)]
pub struct Topics(Vec<Topic>);

impl Topics {
    /// The index of a topic that may be new.
    fn index(&mut self, topic: Topic) -> Result<usize, String> {
        if let Some(known) = self.0.iter().position(|t| *t == topic) {
            return Ok(known);
        }
        if self.0.len() == TOPICS_MAX {
            return Err(format!("more than {TOPICS_MAX} topics"));
        }
        self.0.push(topic);
        Ok(self.0.len() - 1)
    }
}

/// A bag being read.
pub struct Bag {
    parts: VecDeque<PathBuf>,
    part: Option<Part>,
    topics: Topics,
    /// Why a part ended before its end.
    broken: Vec<String>,
    bytes: u64,
    /// Bytes of the parts that are read, and of that being read.
    done: u64,
    length: u64,
}

enum Part {
    Mcap(Box<McapPart>),
    Sqlite(SqlitePart),
}

/// Whether a path is a bag or one of its parts, by its content.
pub fn is_bag(path: &Path) -> bool {
    if path.is_dir() { !parts(path).is_empty() } else { is_part(path) }
}

fn is_part(path: &Path) -> bool {
    let first = File::open(path).and_then(plain).and_then(|file| {
        let mut first = Vec::new();
        file.take(SQLITE.len() as u64).read_to_end(&mut first)?;
        Ok(first)
    });
    first.is_ok_and(|first| first.starts_with(MCAP) || first == SQLITE)
}

/// A file, decompressed if it is compressed.
fn plain(mut file: File) -> std::io::Result<Box<dyn Read + Send>> {
    use std::io::Seek as _;
    let mut first = [0; ZSTD.len()];
    let compressed = file.read_exact(&mut first).is_ok() && first == ZSTD;
    file.rewind()?;
    let file = std::io::BufReader::new(file);
    Ok(if compressed { Box::new(zstd::Decoder::with_buffer(file)?) } else { Box::new(file) })
}

/// The parts in a folder, in order.
fn parts(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut parts: Vec<PathBuf> =
        entries.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.is_file() && is_part(p)).collect();
    // `rosbag2_10` comes after `rosbag2_9`.
    let number = |path: &Path| -> Option<u64> {
        let name = path.file_name()?.to_str()?;
        let stem = &name[..name.find('.')?];
        stem.rsplit_once('_')?.1.parse().ok()
    };
    parts.sort_by_key(|path| (number(path), path.clone()));
    parts
}

impl Bag {
    /// Stands before the first message.
    ///
    /// # Errors
    /// If there is no part that can be opened.
    pub fn open(path: &Path) -> Result<Self, String> {
        let parts: VecDeque<PathBuf> = if path.is_dir() { parts(path).into() } else { [path.into()].into() };
        let length = |path: &PathBuf| std::fs::metadata(path).map_or(0, |m| m.len());
        let bytes = parts.iter().map(length).sum();
        let mut bag = Self {
            parts,
            part: None,
            topics: Topics::default(),
            broken: Vec::new(),
            bytes,
            done: 0,
            length: 0,
        };
        bag.next_part()?;
        Ok(bag)
    }

    fn next_part(&mut self) -> Result<(), String> {
        self.part = None;
        self.done += std::mem::take(&mut self.length);
        let Some(path) = self.parts.pop_front() else { return Ok(()) };
        let file = File::open(&path).map_err(|e| e.to_string())?;
        self.length = file.metadata().map_or(0, |m| m.len());
        let mut content = plain(file).map_err(|e| e.to_string())?;
        let mut first = Vec::new();
        content.by_ref().take(SQLITE.len() as u64).read_to_end(&mut first).map_err(|e| e.to_string())?;
        self.part = Some(if first == SQLITE {
            Part::Sqlite(SqlitePart::open(&path, &mut self.topics)?)
        } else {
            Part::Mcap(Box::new(McapPart::new(Box::new(std::io::Cursor::new(first).chain(content)))))
        });
        Ok(())
    }

    /// Its topics so far.
    pub fn topics(&self) -> &[Topic] {
        &self.topics.0
    }

    /// Why parts ended before their end.
    pub fn broken(&self) -> &[String] {
        &self.broken
    }

    /// Bytes of its files that are read, about, and of all.
    pub fn progress(&self) -> (u64, u64) {
        let within = match &self.part {
            Some(Part::Mcap(part)) => part.read(),
            Some(Part::Sqlite(part)) => (part.share() * self.length as f64) as u64,
            None => 0,
        };
        (self.done + within.min(self.length), self.bytes)
    }

    fn raw(&mut self) -> Option<Result<Raw, String>> {
        match self.part.as_mut()? {
            Part::Mcap(part) => part.next(&mut self.topics),
            Part::Sqlite(part) => part.next(),
        }
    }
}

impl Iterator for Bag {
    type Item = Raw;

    fn next(&mut self) -> Option<Raw> {
        loop {
            let problem = match self.raw() {
                Some(Ok(raw)) => match decompressed(raw) {
                    Ok(raw) => return Some(raw),
                    Err(why) => Some(why),
                },
                Some(Err(why)) => Some(format!("read up to there: {why}")),
                None => None,
            };
            // One broken message may be anything; a broken part has no more.
            self.broken.extend(problem);
            if self.part.is_none() && self.parts.is_empty() {
                return None;
            }
            if let Err(why) = self.next_part() {
                self.broken.push(why);
            }
        }
    }
}

/// Of a bag that compresses message by message each is a Zstandard frame, which no CDR begins like.
fn decompressed(raw: Raw) -> Result<Raw, String> {
    if !raw.data.starts_with(&ZSTD) {
        return Ok(raw);
    }
    let mut data = Vec::new();
    let decoder = zstd::Decoder::with_buffer(raw.data.as_slice()).map_err(|e| e.to_string())?;
    decoder.take(MESSAGE_MAX as u64).read_to_end(&mut data).map_err(|e| format!("damaged message: {e}"))?;
    Ok(Raw { data, ..raw })
}
