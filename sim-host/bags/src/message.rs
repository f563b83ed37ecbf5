//! The messages of a bag, and who takes them.

use std::path::Path;

use crate::decode::{Undecodable, Value};
use crate::definition::Definition;
use crate::error::Defect;

/// A topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// The type of its messages: `nav_msgs/msg/Odometry`.
    pub kind: String,
    /// The definition of that type.
    pub definition: Definition,
}

/// A message.
#[derive(Debug)]
pub struct Message<'m> {
    /// The file that it is in.
    pub file: &'m Path,
    /// Its number there: that of its row in a database, else counted from 1.
    pub number: i64,
    /// Its topic.
    pub topic: &'m Topic,
    /// When it was recorded, nanoseconds.
    pub time: i64,
    /// Its fields.
    pub value: Result<Value<'m>, Undecodable>,
}

/// Takes the messages of a bag, one after the other.
pub trait Take {
    /// Whether messages of this topic are taken, by its name and type.
    fn wants(&self, topic: &str, kind: &str) -> bool;

    /// Takes a message.
    ///
    /// # Errors
    /// [`Defect`], to end the reading.
    fn take(&mut self, message: &Message) -> Result<(), Defect>;
}
