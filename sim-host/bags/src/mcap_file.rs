//! Messages in MCAP files.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

use mcap::records::{Channel, ChunkHeader, Record, SchemaHeader, op};
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
                if opcode == op::DATA_END {
                    return Ok(());
                }
                messages.raw(opcode, data)?;
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
    /// A record as bytes. Only those that are needed are parsed, and only if their texts are not longer than they are themselves: the
    /// parser allocates what a text claims.
    fn raw(&mut self, opcode: u8, body: &[u8]) -> Result<(), Defect> {
        // Where the first text begins, how many follow each other, and whether a list of texts is behind them.
        let (mut at, texts, has_list) = match opcode {
            op::SCHEMA => (2, 3, false),
            op::CHANNEL => (4, 2, true),
            op::MESSAGE => (0, 0, false),
            op::CHUNK => (28, 1, false),
            _ => return Ok(()),
        };
        for _ in 0..texts {
            at = end_of_text(body, at)?;
        }
        at += if has_list { 4 } else { 0 };
        while has_list && at < body.len() {
            at = end_of_text(body, at)?;
        }
        self.record(mcap::parse_record(opcode, body)?)
    }

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
        if header.uncompressed_crc != 0 && crc32fast::hash(&bytes) != header.uncompressed_crc {
            let why = "a chunk has another checksum than its bytes; `mcap recover` saves what can be read";
            return Err(Defect::content(why));
        }
        let mut rest = bytes.as_ref();
        while let Some((&opcode, behind)) = rest.split_first() {
            let cut_off = || Defect::content("a chunk ends within a record");
            let (length, behind) = behind.split_first_chunk().ok_or_else(cut_off)?;
            let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| cut_off())?;
            let (body, behind) = behind.split_at_checked(length).ok_or_else(cut_off)?;
            rest = behind;
            if opcode == op::CHUNK {
                return Err(Defect::content("a chunk has a chunk in it"));
            }
            self.raw(opcode, body)?;
        }
        Ok(())
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

/// Where a text at a place of a record ends: four bytes of length, and as many as that.
fn end_of_text(body: &[u8], at: usize) -> Result<usize, Defect> {
    let length = body.get(at..).and_then(|rest| rest.first_chunk());
    let length = length.and_then(|length| usize::try_from(u32::from_le_bytes(*length)).ok());
    let end = length.and_then(|length| at.checked_add(4)?.checked_add(length));
    end.filter(|end| *end <= body.len()).ok_or_else(|| {
        Defect::content(
            "a record claims a text that is longer than it; `mcap recover` saves what can be read",
        )
    })
}
