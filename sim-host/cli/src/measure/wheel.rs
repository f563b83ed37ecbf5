//! The edges of the encoder of a wheel that is turned by hand.

use sonarfix_link::message::EncoderReading;
use sonarfix_telemetry::signs::difference;

/// The edges of an encoder since the first reading.
#[derive(Debug, Default, Clone, Copy)]
pub struct Edges {
    last: Option<u32>,
    /// Their number; negative if the count falls.
    pub count: i64,
}

impl Edges {
    /// Takes a reading. The count wraps around.
    pub fn take(&mut self, reading: &EncoderReading) {
        if let Some(count) = reading.count {
            let moved = self.last.map_or(0, |last| difference(count, last, reading.bits));
            self.count += moved;
            self.last = Some(count);
        }
    }
}
