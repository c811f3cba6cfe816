//! SQLite: a table of topics and one of messages, read page by page.

use super::scratch::Scratch;
use super::{MESSAGE_MAX, Raw, Topic, Topics, plain};
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags};
use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Messages read at once.
const PAGE: u32 = 500;

/// A file of a bag.
pub struct SqlitePart {
    connection: Connection,
    /// Indices of topics by their ids in the file.
    topics: BTreeMap<i64, usize>,
    page: VecDeque<Raw>,
    /// Time and id of the newest message read.
    last: (i64, i64),
    ended: bool,
    /// Messages read, and in all.
    count: (u64, u64),
    /// Where a copy of the file is, if one had to be made.
    _scratch: Option<Scratch>,
}

impl SqlitePart {
    /// Stands before the first message.
    pub fn open(path: &Path, topics: &mut Topics) -> Result<Self, String> {
        let (file, scratch) = readable(path).map_err(|e| e.to_string())?;
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        // One that nobody else has is opened as its journal wants it.
        let flags = if scratch.is_some() { OpenFlags::SQLITE_OPEN_READ_WRITE } else { flags };
        let connection = Connection::open_with_flags(&file, flags).map_err(|e| e.to_string())?;
        let ids = read_topics(&connection, topics).map_err(|why| format!("no table of topics: {why}"))?;
        let all = connection.query_row("SELECT count(*) FROM messages", [], |row| row.get::<_, i64>(0));
        let all = all.map_err(|e| format!("no table of messages: {e}"))? as u64;
        Ok(Self {
            connection,
            topics: ids,
            page: VecDeque::new(),
            last: (i64::MIN, i64::MIN),
            ended: false,
            count: (0, all),
            _scratch: scratch,
        })
    }

    /// The next message, or why there are no more.
    pub fn next(&mut self) -> Option<Result<Raw, String>> {
        while self.page.is_empty() && !self.ended {
            match self.turn() {
                Ok(rows) => self.ended = rows == 0,
                Err(e) => {
                    self.ended = true;
                    return Some(Err(e.to_string()));
                }
            }
        }
        self.page.pop_front().map(Ok)
    }

    /// Share of its messages that is read.
    pub fn share(&self) -> f64 {
        self.count.0 as f64 / self.count.1.max(1) as f64
    }

    /// Reads the next page; tells how many rows it had.
    fn turn(&mut self) -> rusqlite::Result<usize> {
        let mut statement = self.connection.prepare(
            "SELECT timestamp, id, topic_id, data FROM messages WHERE (timestamp, id) > (?1, ?2) \
             ORDER BY timestamp, id LIMIT ?3",
        )?;
        let mut rows = statement.query((self.last.0, self.last.1, PAGE))?;
        let mut count = 0;
        while let Some(row) = rows.next()? {
            count += 1;
            self.last = (row.get(0)?, row.get(1)?);
            let topic = self.topics.get(&row.get(2)?);
            let data = match row.get_ref(3)? {
                ValueRef::Blob(data) if data.len() <= MESSAGE_MAX => data,
                _ => continue,
            };
            if let Some(&topic) = topic {
                self.page.push_back(Raw { topic, received_ns: self.last.0, data: data.to_vec() });
            }
        }
        self.count.0 += count as u64;
        Ok(count)
    }
}

fn read_topics(connection: &Connection, topics: &mut Topics) -> Result<BTreeMap<i64, usize>, String> {
    let wrong = |e: rusqlite::Error| e.to_string();
    let mut statement =
        connection.prepare("SELECT id, name, type, serialization_format FROM topics").map_err(wrong)?;
    let mut rows = statement.query([]).map_err(wrong)?;
    let mut ids = BTreeMap::new();
    while let Some(row) = rows.next().map_err(wrong)? {
        let text = |column: usize| row.get::<_, String>(column).map_err(wrong);
        let topic = Topic { name: text(1)?, kind: text(2)?, is_cdr: text(3)? == "cdr" };
        ids.insert(row.get(0).map_err(wrong)?, topics.index(topic)?);
    }
    Ok(ids)
}

/// The file itself, or a copy: of one that is compressed, and of one with a write-ahead log, which a recorder that
/// was killed leaves and which can't be read without being written.
fn readable(path: &Path) -> std::io::Result<(PathBuf, Option<Scratch>)> {
    let log = PathBuf::from(format!("{}-wal", path.display()));
    let is_plain = !is_compressed(path)?;
    if is_plain && !log.is_file() {
        return Ok((path.to_owned(), None));
    }
    let scratch = Scratch::new()?;
    let copy = scratch.path().join("bag.db3");
    std::io::copy(&mut plain(File::open(path)?)?, &mut File::create(&copy)?)?;
    if is_plain {
        std::fs::copy(&log, scratch.path().join("bag.db3-wal"))?;
    }
    Ok((copy, Some(scratch)))
}

fn is_compressed(path: &Path) -> std::io::Result<bool> {
    use std::io::Read as _;
    let mut first = [0; super::ZSTD.len()];
    File::open(path)?.read_exact(&mut first)?;
    Ok(first == super::ZSTD)
}
