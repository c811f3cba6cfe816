//! Writes MCAP as ROS 2 records it: rosbag2, Foxglove and rerun read it.

use crate::cdr;
use crate::definitions::definition;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// A file of messages.
pub struct BagWriter<W: Write + Seek> {
    file: Writer<W>,
    /// Channel and messages so far, by topic.
    channels: BTreeMap<String, (u16, u32)>,
}

impl<W: Write + Seek> BagWriter<W> {
    /// With nothing in it yet.
    ///
    /// # Errors
    /// The medium's.
    pub fn new(file: W) -> Result<Self, String> {
        let options = WriteOptions::new().profile("ros2").library("toponym").compression_threads(0);
        let file = options.create(file).map_err(|e| e.to_string())?;
        Ok(Self { file, channels: BTreeMap::new() })
    }

    /// Adds a message of a type that is known to [`definition`], at a time in nanoseconds.
    ///
    /// # Errors
    /// The medium's; if its type is not known.
    pub fn write<T: Serialize>(
        &mut self,
        topic: &str,
        kind: &str,
        at_ns: i64,
        message: &T,
    ) -> Result<(), String> {
        self.put(topic, kind, at_ns, &cdr::write(message)?)
    }

    /// The same of a message that is CDR already.
    ///
    /// # Errors
    /// As [`BagWriter::write`].
    pub fn put(&mut self, topic: &str, kind: &str, at_ns: i64, data: &[u8]) -> Result<(), String> {
        let why = |e: mcap::McapError| e.to_string();
        if !self.channels.contains_key(topic) {
            let definition = definition(kind).ok_or_else(|| format!("{kind} is not written"))?;
            let schema = self.file.add_schema(kind, "ros2msg", definition.as_bytes()).map_err(why)?;
            let channel = self.file.add_channel(schema, topic, "cdr", &BTreeMap::new()).map_err(why)?;
            self.channels.insert(topic.to_owned(), (channel, 0));
        }
        let Some((channel_id, sequence)) = self.channels.get_mut(topic) else { return Ok(()) };
        *sequence += 1;
        let time = at_ns.max(0) as u64;
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: time,
            publish_time: time,
        };
        self.file.write_to_known_channel(&header, data).map_err(why)
    }

    /// What is written so far can be read from now on, whatever happens.
    ///
    /// # Errors
    /// The medium's.
    pub fn flush(&mut self) -> Result<(), String> {
        self.file.flush().map_err(|e| e.to_string())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// The medium's.
    pub fn finish(mut self) -> Result<W, String> {
        self.file.finish().map_err(|e| e.to_string())?;
        Ok(self.file.into_inner())
    }
}
