//! MCAP: records in compressed chunks, read as they come, so that a file that was never finished is read, too.

use super::{MESSAGE_MAX, Raw, Topic, Topics};
use mcap::parse_record;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::io::Read;

/// A file of a bag.
pub struct McapPart {
    file: Box<dyn Read + Send>,
    reader: LinearReader,
    /// Names of schemas.
    schemas: BTreeMap<u16, String>,
    /// Topics of channels.
    channels: BTreeMap<u16, usize>,
    /// Bytes taken from the file.
    read: u64,
    ended: bool,
}

impl McapPart {
    /// Stands before the first message.
    pub fn new(file: Box<dyn Read + Send>) -> Self {
        let options = LinearReaderOptions::default().with_record_length_limit(MESSAGE_MAX);
        Self {
            file,
            reader: LinearReader::new_with_options(options),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            read: 0,
            ended: false,
        }
    }

    /// The next message, or why there are no more.
    pub fn next(&mut self, topics: &mut Topics) -> Option<Result<Raw, String>> {
        if self.ended {
            return None;
        }
        let next = self.record(topics).transpose();
        self.ended = !matches!(next, Some(Ok(_)));
        next
    }

    /// Bytes read; of a file that is compressed as a whole, those that came out.
    pub fn read(&self) -> u64 {
        self.read
    }

    fn record(&mut self, topics: &mut Topics) -> Result<Option<Raw>, String> {
        loop {
            let event = match self.reader.next_event() {
                None => return Ok(None),
                Some(event) => event.map_err(|e| e.to_string())?,
            };
            match event {
                LinearReadEvent::ReadRequest(count) => {
                    let count = count.min(MESSAGE_MAX);
                    let read = self.file.read(self.reader.insert(count)).map_err(|e| e.to_string())?;
                    self.reader.notify_read(read);
                    self.read += read as u64;
                }
                LinearReadEvent::Record { data, opcode } => {
                    match parse_record(opcode, data).map_err(|e| e.to_string())? {
                        Record::Schema { header, .. } => drop(self.schemas.insert(header.id, header.name)),
                        Record::Channel(channel) => {
                            let kind = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                            let is_cdr = channel.message_encoding == "cdr";
                            let topic = topics.index(Topic { name: channel.topic, kind, is_cdr })?;
                            self.channels.insert(channel.id, topic);
                        }
                        Record::Message { header, data } => {
                            // One whose channel nobody told is of no known type.
                            if let Some(&topic) = self.channels.get(&header.channel_id) {
                                let received_ns = header.log_time as i64;
                                return Ok(Some(Raw { topic, received_ns, data: data.into_owned() }));
                            }
                        }
                        _ => {}
                    }
                }
            }
        }
    }
}
