//! Record files: what entered a map, in its order, for `map FILE`. A record goes on where it ended when the
//! server starts again.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use toponym_proto::Message;
use toponym_proto::record::{Origin, RecordError, RecordReader, RecordWriter};
use tracing::{error, info, warn};

use crate::store::free_name;

/// A map's record.
pub struct Recording {
    path: PathBuf,
    writer: Option<RecordWriter<File>>,
    /// Number of the next message that enters the map.
    next: u64,
}

impl Recording {
    /// Goes on with the record of this map, of which `steps` messages have entered it, or begins one. A file that is
    /// another map's, or lacks messages, is moved aside.
    pub fn open(path: PathBuf, map: &str, steps: u64) -> io::Result<Self> {
        let first = steps + 1;
        let writer = match Self::go_on(&path, map, first) {
            Ok(writer) => writer,
            Err(why) => {
                if let Some(why) = why {
                    let aside = free_name(&path);
                    warn!(path = %path.display(), aside = %aside.display(), "moved aside: {why}");
                    fs::rename(&path, aside)?;
                }
                if first > 1 {
                    warn!(path = %path.display(), first, "the record begins in the middle of its map");
                }
                let origin = Origin { map: map.into(), first };
                let mut writer = RecordWriter::new(File::create_new(&path)?, &origin).map_err(io_error)?;
                writer.flush().map_err(io_error)?;
                writer
            }
        };
        Ok(Self { path, writer: Some(writer), next: first })
    }

    /// The record that is there, at its end; else why it can't be gone on with, none if there is none.
    fn go_on(path: &Path, map: &str, first: u64) -> Result<RecordWriter<File>, Option<String>> {
        let told = |e: RecordError| Some(e.to_string());
        let file = match OpenOptions::new().read(true).append(true).open(path) {
            Ok(file) => file,
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Err(None),
            Err(e) => return Err(Some(e.to_string())),
        };
        let mut reader = RecordReader::new(&file).map_err(told)?;
        if reader.origin().is_none_or(|origin| origin.map != map) {
            return Err(Some("it is another map's record".into()));
        }
        while let Some(Ok(_)) = reader.next() {}
        let (next, end) = reader.at();
        if next < first {
            return Err(Some(format!("it ends with message {}, the map has {}", next - 1, first - 1)));
        }
        drop(reader);
        file.set_len(end).map_err(|e| told(e.into()))?;
        info!(path = %path.display(), next, "the record goes on");
        Ok(RecordWriter::at_end(file, next))
    }

    /// Adds the next message that enters the map, unless it is there already. A record with a gap would replay
    /// another map: after an error there is none.
    pub fn write(&mut self, message: &Message) {
        let number = self.next;
        self.next += 1;
        self.guarded(|writer| if number < writer.next() { Ok(()) } else { writer.write(message) });
    }

    /// Makes it durable.
    pub fn sync(&mut self) {
        self.guarded(|writer| {
            writer.flush()?;
            Ok(writer.get_ref().sync_data()?)
        });
    }

    fn guarded(&mut self, act: impl FnOnce(&mut RecordWriter<File>) -> Result<(), RecordError>) {
        if let Some(Err(e)) = self.writer.as_mut().map(act) {
            error!(path = %self.path.display(), "recording ends here: {e}");
            self.writer = None;
        }
    }
}

fn io_error(error: RecordError) -> io::Error {
    match error {
        RecordError::Io(e) => e,
        other => io::Error::other(other),
    }
}

/// Where maps are recorded: one under the name given, others with their id added.
pub struct Recordings {
    path: PathBuf,
}

impl Recordings {
    /// Checks that files can be written there. What is there already must be a record: it may be all that is left of a map.
    pub fn new(path: PathBuf) -> io::Result<Self> {
        let named = |e: io::Error| {
            let hint = "; move it away or give --record another file";
            io::Error::new(e.kind(), format!("record {}: {e}{hint}", path.display()))
        };
        match File::open(&path) {
            Ok(file) => drop(RecordReader::new(file).map_err(io_error).map_err(named)?),
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                drop(File::create_new(&path).map_err(named)?);
                fs::remove_file(&path).map_err(named)?;
            }
            Err(e) => return Err(named(e)),
        }
        Ok(Self { path })
    }

    /// The record of a map that has taken in `steps` messages.
    pub fn of_map(&self, id: &str, uuid: &str, steps: u64) -> io::Result<Recording> {
        let mut name = self.path.as_os_str().to_owned();
        name.push(format!(".{id}"));
        let own = PathBuf::from(name);
        let is_its = |path: &Path| {
            let reader = File::open(path).ok().and_then(|file| RecordReader::new(file).ok());
            reader.is_some_and(|reader| reader.origin().is_some_and(|origin| origin.map == uuid))
        };
        let path = if is_its(&self.path) || !self.path.exists() && !own.exists() { &self.path } else { &own };
        Recording::open(path.clone(), uuid, steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_proto::{Mend, Message};

    fn message(name: &str) -> Message {
        Message::Mend(Mend::Forget { name: name.into() })
    }

    fn read(path: &Path) -> Vec<Message> {
        RecordReader::new(File::open(path).unwrap()).unwrap().map(|m| m.unwrap().1).collect()
    }

    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("toponym-record-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        path
    }

    #[test]
    fn a_record_goes_on_where_it_ended() {
        let folder = folder("goes_on");
        let path = folder.join("run.rec");
        let records = Recordings::new(path.clone()).unwrap();
        let mut record = records.of_map("main", "u", 0).unwrap();
        for name in ["a", "b", "c"] {
            record.write(&message(name));
        }
        record.sync();
        drop(record);
        let torn = fs::read(&path).unwrap();
        fs::write(&path, &torn[..torn.len() - 2]).unwrap();
        // The map was saved after the first: the others enter again.
        let mut record = Recordings::new(path.clone()).unwrap().of_map("main", "u", 1).unwrap();
        for name in ["b", "c", "d"] {
            record.write(&message(name));
        }
        record.sync();
        assert_eq!(read(&path), ["a", "b", "c", "d"].map(message));
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn each_map_keeps_its_file_and_what_has_a_gap_is_moved_aside() {
        let folder = folder("each");
        let path = folder.join("run.rec");
        let records = Recordings::new(path.clone()).unwrap();
        for (id, uuid) in [("b", "ub"), ("a", "ua"), ("b", "ub"), ("a", "ua")] {
            let steps = read_or_none(&path, &folder, id);
            let mut record = records.of_map(id, uuid, steps).unwrap();
            record.write(&message(id));
            record.sync();
        }
        assert_eq!(read(&path), ["b", "b"].map(message));
        assert_eq!(read(&folder.join("run.rec.a")), ["a", "a"].map(message));
        let mut record = records.of_map("b", "ub", 7).unwrap();
        record.write(&message("late"));
        record.sync();
        assert_eq!(read(&path), [message("late")]);
        assert_eq!(read(&folder.join("run.rec-1")).len(), 2);
        fs::remove_dir_all(folder).unwrap();
    }

    /// Messages in the record of a map so far.
    fn read_or_none(path: &Path, folder: &Path, id: &str) -> u64 {
        let own = folder.join(format!("run.rec.{id}"));
        let path = if own.exists() { own } else { path.to_owned() };
        let theirs = |m: &Message| *m == message(id);
        if path.exists() { read(&path).into_iter().filter(theirs).count() as u64 } else { 0 }
    }
}
