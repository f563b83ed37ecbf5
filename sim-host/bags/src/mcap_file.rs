//! Messages in MCAP files.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

use mcap::read::ChunkReader;
use mcap::records::{Channel, ChunkHeader, Record, SchemaHeader};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::decode::Value;
use crate::error::Defect;
use crate::known;
use crate::message::{Message, Take, Topic};
use crate::packed::{self, MOST_PARTS};

/// The largest record, bytes.
const MOST_RECORD: usize = 256 << 20;
/// How many bytes are read at once.
const STEP: usize = 1 << 16;

/// Reads the messages of a file from its begin to its end.
pub fn read(mut bytes: impl Read, path: &Path, take: &mut dyn Take) -> Result<(), Defect> {
    let options =
        LinearReaderOptions::default().with_emit_chunks(true).with_record_length_limit(MOST_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    let mut messages = Messages {
        path,
        take,
        schemas: HashMap::new(),
        topics: HashMap::new(),
        number: 0,
        left: MOST_PARTS,
    };
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(need) => {
                if need > MOST_RECORD {
                    let why = format!("a record claims {need} bytes, and at most 256 MiB are read");
                    return Err(Defect::content(why));
                }
                let read = bytes.read(reader.insert(need.min(STEP)))?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { data, opcode } => {
                // The summary begins here, and has no messages.
                if opcode == mcap::records::op::DATA_END {
                    return Ok(());
                }
                messages.record(mcap::parse_record(opcode, data)?)?;
            }
        }
    }
    Ok(())
}

/// The messages so far.
struct Messages<'t> {
    path: &'t Path,
    take: &'t mut dyn Take,
    schemas: HashMap<u16, (SchemaHeader, Vec<u8>)>,
    /// The topics by their channel; none that are not wanted.
    topics: HashMap<u16, Option<Topic>>,
    number: i64,
    /// How many bytes may still be unpacked.
    left: u64,
}

impl Messages<'_> {
    fn record(&mut self, record: Record) -> Result<(), Defect> {
        match record {
            Record::Schema { header, data } => {
                self.schemas.entry(header.id).or_insert((header, data.into_owned()));
            }
            Record::Channel(channel) if !self.topics.contains_key(&channel.id) => {
                let topic = self.topic(&channel)?;
                self.topics.insert(channel.id, topic);
            }
            Record::Message { header, data } => {
                self.number += 1;
                let number = self.number;
                let Some(topic) = self.topics.get(&header.channel_id) else {
                    let why = format!(
                        "message {number} is of channel {}, which it does not have",
                        header.channel_id
                    );
                    return Err(Defect::content(why));
                };
                let Some(topic) = topic else { return Ok(()) };
                let bytes = packed::message(&data, &mut self.left)?;
                let time = i64::try_from(header.log_time).unwrap_or(i64::MAX);
                let value = Value::read(&topic.definition, &bytes);
                self.take.take(&Message { file: self.path, number, topic, time, value })?;
            }
            Record::Chunk { header, data } => self.chunk(&header, &data)?,
            _ => {}
        }
        Ok(())
    }

    fn chunk(&mut self, header: &ChunkHeader, data: &[u8]) -> Result<(), Defect> {
        let bytes = match header.compression.as_str() {
            "" => Cow::Borrowed(data),
            by => Cow::Owned(packed::part(by, data, &mut self.left)?),
        };
        let length = bytes.len() as u64;
        if length != header.uncompressed_size {
            let claimed = header.uncompressed_size;
            let why = format!(
                "a chunk claims {claimed} bytes and has {length}; `mcap recover` saves what can be read"
            );
            return Err(Defect::content(why));
        }
        let unpacked =
            ChunkHeader { compression: String::new(), compressed_size: length, ..header.clone() };
        ChunkReader::new(unpacked, &bytes)?.try_for_each(|record| match record? {
            Record::Chunk { .. } => Err(Defect::content("a chunk has a chunk in it")),
            record => self.record(record),
        })
    }

    /// The topic of a channel, if it is wanted.
    fn topic(&self, channel: &Channel) -> Result<Option<Topic>, Defect> {
        let Some((schema, text)) = self.schemas.get(&channel.schema_id) else { return Ok(None) };
        let (name, kind) = (&channel.topic, known::with_msg(&schema.name));
        if !self.take.wants(name, &kind) {
            return Ok(None);
        }
        if channel.message_encoding != "cdr" {
            let encoding = &channel.message_encoding;
            let why = format!(
                "the messages of {name} are `{encoding}`, and only `cdr`, that of ROS 2, is read"
            );
            return Err(Defect::content(why));
        }
        let text = match (schema.encoding.as_str(), std::str::from_utf8(text)) {
            ("ros2msg", Ok(text)) => Some(text),
            _ => None,
        };
        let definition = known::definition(&kind, text)?;
        Ok(Some(Topic { name: name.clone(), kind, definition }))
    }
}
