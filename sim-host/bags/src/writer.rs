//! Writes a bag: messages into an MCAP file, and the metadata that is beside it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Seek, Write};

use anyhow::Context;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use serde::Serialize;
use sonarfix_ros_messages::cdr;
use sonarfix_ros_messages::schema::Message;
use sonarfix_ros_messages::transforms::Nanoseconds;

/// What a publisher offers: which messages a subscriber that comes late gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Durability {
    /// None (`volatile`).
    Volatile,
    /// The last one (`transient_local`): maps and static frames.
    Latched,
}

impl Durability {
    /// As rosbag2 writes it: keep the last ten, reliable.
    fn qos(self) -> String {
        let durability = match self {
            Self::Latched => 1,
            Self::Volatile => 2,
        };
        let forever = |name: &str| format!("  {name}:\n    sec: 9223372036\n    nsec: 854775807\n");
        format!(
            "- history: 1\n  depth: 10\n  reliability: 1\n  durability: {durability}\n{}{}  liveliness: 1\n{}  \
             avoid_ros_namespace_conventions: false\n",
            forever("deadline"),
            forever("lifespan"),
            forever("liveliness_lease_duration"),
        )
    }
}

/// A topic of the bag.
#[derive(Debug)]
struct Channel {
    number: u16,
    kind: String,
    durability: Durability,
    count: u64,
}

/// A bag that is being written.
pub struct Writer<W: Write + Seek> {
    out: mcap::Writer<W>,
    channels: BTreeMap<String, Channel>,
    /// The times of the earliest and the latest message.
    span: Option<(u64, u64)>,
}

impl<W: Write + Seek> Writer<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(out: W) -> anyhow::Result<Self> {
        let library = concat!("sonarfix ", env!("CARGO_PKG_VERSION"));
        let options = WriteOptions::new().compression(None).library(library).profile("ros2");
        Ok(Self { out: options.create(out)?, channels: BTreeMap::new(), span: None })
    }

    /// Writes a message. A topic has the type and the durability of its first message.
    ///
    /// # Errors
    /// If it cannot be written, or is earlier than the zero of MCAP's clock.
    pub fn write<M: Message + Serialize>(
        &mut self,
        topic: &str,
        durability: Durability,
        time: Nanoseconds,
        message: &M,
    ) -> anyhow::Result<()> {
        let kind = (M::type_name(), M::definition());
        self.write_bytes(topic, &kind, durability, time, &cdr::write(message)?)
    }

    /// Writes the bytes of a message of a type with this name and definition.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_bytes(
        &mut self,
        topic: &str,
        kind: &(String, String),
        durability: Durability,
        time: Nanoseconds,
        bytes: &[u8],
    ) -> anyhow::Result<()> {
        let time = u64::try_from(time).context("MCAP has no times before zero")?;
        if !self.channels.contains_key(topic) {
            let channel = self.declare(topic, kind, durability)?;
            self.channels.insert(topic.to_owned(), channel);
        }
        let channel = self.channels.get_mut(topic).context("a topic is not declared")?;
        let sequence = u32::try_from(channel.count % (1 << 32)).unwrap_or(0);
        channel.count += 1;
        let header = MessageHeader {
            channel_id: channel.number,
            sequence,
            log_time: time,
            publish_time: time,
        };
        let (first, last) = self.span.unwrap_or((time, time));
        self.span = Some((first.min(time), last.max(time)));
        Ok(self.out.write_to_known_channel(&header, bytes)?)
    }

    fn declare(
        &mut self,
        topic: &str,
        (kind, definition): &(String, String),
        durability: Durability,
    ) -> anyhow::Result<Channel> {
        let schema = self.out.add_schema(kind, "ros2msg", definition.as_bytes())?;
        let qos = [("offered_qos_profiles".to_owned(), durability.qos())];
        let number = self.out.add_channel(schema, topic, "cdr", &BTreeMap::from(qos))?;
        Ok(Channel { number, kind: kind.clone(), durability, count: 0 })
    }

    /// Ends the file, and returns it with the text of its `metadata.yaml`. `name` is the name of the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn end(mut self, name: &str) -> anyhow::Result<(W, String)> {
        self.out.finish()?;
        let metadata = metadata(name, self.span, &self.channels)?;
        Ok((self.out.into_inner(), metadata))
    }
}

/// `metadata.yaml`, in the version of ROS's Iron and Jazzy.
fn metadata(
    name: &str,
    span: Option<(u64, u64)>,
    channels: &BTreeMap<String, Channel>,
) -> Result<String, std::fmt::Error> {
    // JSON's texts in quotation marks are YAML's.
    let quoted = |text: &str| format!("{text:?}");
    let (first, last) = span.unwrap_or_default();
    let (start, duration) = (first, last - first);
    let count: u64 = channels.values().map(|channel| channel.count).sum();
    let name = quoted(name);
    let mut text = String::new();
    write!(
        text,
        "rosbag2_bagfile_information:\n  version: 8\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {duration}\n  \
         starting_time:\n    nanoseconds_since_epoch: {start}\n  message_count: {count}\n  topics_with_message_count:\n"
    )?;
    for (topic, Channel { kind, durability, count, .. }) in channels {
        let (topic, qos) = (quoted(topic), quoted(durability.qos().trim_end()));
        write!(
            text,
            "    - topic_metadata:\n        name: {topic}\n        type: {kind}\n        serialization_format: cdr\n        \
             offered_qos_profiles: {qos}\n        type_description_hash: \"\"\n      message_count: {count}\n"
        )?;
    }
    write!(
        text,
        "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {name}\n  files:\n    - path: {name}\n      \
         starting_time:\n        nanoseconds_since_epoch: {start}\n      duration:\n        nanoseconds: {duration}\n      \
         message_count: {count}\n  custom_data: ~\n  ros_distro: \"\"\n"
    )?;
    Ok(text)
}
