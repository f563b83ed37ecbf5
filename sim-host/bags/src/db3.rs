//! Messages in databases of `SQLite`.

use std::collections::HashMap;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};

use crate::decode::Value;
use crate::error::Defect;
use crate::known;
use crate::message::{Message, Take, Topic};
use crate::packed::{self, MOST_PARTS};
use crate::sqlite::{Database, Row, SqlValue};

/// The most topics of a bag.
const MOST_TOPICS: usize = 10_000;

/// Refuses a database of which a part is in a file beside it.
pub fn check_journal(path: &Path) -> Result<(), Defect> {
    for ending in ["-wal", "-journal"] {
        let mut beside = path.as_os_str().to_owned();
        beside.push(ending);
        let beside = PathBuf::from(beside);
        if std::fs::metadata(&beside).is_ok_and(|data| data.len() > 0) {
            let why = format!(
                "a part of it is in {}: the recording was interrupted. `sqlite3 FILE .schema` brings both together",
                beside.display()
            );
            return Err(Defect::content(why));
        }
    }
    Ok(())
}

/// Reads the messages of a file in the order of their rows.
pub fn read(bytes: impl Read + Seek, path: &Path, take: &mut dyn Take) -> Result<(), Defect> {
    let mut database = Database::of(bytes)?;
    for table in ["topics", "messages"] {
        if !database.has_table(table) {
            let why = format!("has no table `{table}`: it is no bag of ROS 2");
            return Err(Defect::content(why));
        }
    }
    let texts = definitions(&mut database)?;
    let topics = topics(&mut database, &texts, take)?;
    let columns = database.columns("messages")?;
    let [topic_id, timestamp, data] =
        ["topic_id", "timestamp", "data"].map(|name| columns.find(name));
    let (topic_id, timestamp, data) = (topic_id?, timestamp?, data?);
    let mut left = MOST_PARTS;
    database.rows("messages", &mut |mut row: Row| {
        let number = row.number;
        let (SqlValue::Integer(id), SqlValue::Integer(time), SqlValue::Blob(bytes)) =
            (topic_id.take(&mut row), timestamp.take(&mut row), data.take(&mut row))
        else {
            let why = format!("row {number} of the table `messages` is no message");
            return Err(Defect::content(why));
        };
        let Some(topic) = topics.get(&id) else {
            let why = format!(
                "row {number} of the table `messages` has topic {id}, which it does not have"
            );
            return Err(Defect::content(why));
        };
        let Some(topic) = topic else { return Ok(()) };
        let bytes = packed::message(&bytes, &mut left)?;
        let value = Value::read(&topic.definition, &bytes);
        take.take(&Message { file: path, number, topic, time, value })
    })
}

/// The definitions of types as text, which bags have since Iron.
fn definitions<R: Read + Seek>(
    database: &mut Database<R>,
) -> Result<HashMap<String, String>, Defect> {
    const TABLE: &str = "message_definitions";
    let mut texts = HashMap::new();
    if !database.has_table(TABLE) {
        return Ok(texts);
    }
    let columns = database.columns(TABLE)?;
    let [kind, encoding, text] =
        ["topic_type", "encoding", "encoded_message_definition"].map(|name| columns.find(name));
    let (kind, encoding, text) = (kind?, encoding?, text?);
    database.rows(TABLE, &mut |mut row: Row| {
        if let (SqlValue::Text(kind), SqlValue::Text(encoding), SqlValue::Text(text)) =
            (kind.take(&mut row), encoding.take(&mut row), text.take(&mut row))
            && encoding == "ros2msg"
            && texts.len() < MOST_TOPICS
        {
            texts.insert(kind, text);
        }
        Ok::<_, Defect>(())
    })?;
    Ok(texts)
}

/// The topics by their number; none that are not wanted.
fn topics<R: Read + Seek>(
    database: &mut Database<R>,
    texts: &HashMap<String, String>,
    take: &dyn Take,
) -> Result<HashMap<i64, Option<Topic>>, Defect> {
    let columns = database.columns("topics")?;
    let [id, name, kind, format] =
        ["id", "name", "type", "serialization_format"].map(|name| columns.find(name));
    let (id, name, kind, format) = (id?, name?, kind?, format?);
    let mut topics = HashMap::new();
    database.rows("topics", &mut |mut row: Row| {
        let number = row.number;
        let (
            SqlValue::Integer(id),
            SqlValue::Text(name),
            SqlValue::Text(kind),
            SqlValue::Text(format),
        ) = (id.take(&mut row), name.take(&mut row), kind.take(&mut row), format.take(&mut row))
        else {
            let why = format!("row {number} of the table `topics` is no topic");
            return Err(Defect::content(why));
        };
        if topics.len() >= MOST_TOPICS {
            return Err(Defect::content(format!("has more than {MOST_TOPICS} topics")));
        }
        let mut topic = None;
        if take.wants(&name, &kind) {
            if format != "cdr" {
                let why = format!("the messages of {name} are `{format}`, and only `cdr` is read");
                return Err(Defect::content(why));
            }
            let definition = known::definition(&kind, texts.get(&kind).map(String::as_str))?;
            topic = Some(Topic { name, kind, definition });
        }
        topics.insert(id, topic);
        Ok(())
    })?;
    Ok(topics)
}
