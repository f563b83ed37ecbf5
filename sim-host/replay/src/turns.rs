//! The recorded turns of a gyro, each at the time of an encoder record.

use std::collections::VecDeque;

use sonarfix::sensor::gyro::{MeasuredTurn, TurnReading};

/// Readings that wait for their step: more than a log has between two encoder records.
const MOST: usize = 64;

/// Readings of a gyro, and the one that the localizer has taken.
#[derive(Debug, Clone, Default)]
pub struct Turns {
    waiting: VecDeque<(i64, TurnReading)>,
    taken: Option<TurnReading>,
}

impl Turns {
    /// Adds a reading of a time, microseconds.
    pub fn add(&mut self, time: i64, reading: TurnReading) {
        if self.waiting.len() == MOST {
            self.waiting.pop_front();
        }
        self.waiting.push_back((time, reading));
    }

    /// The reading of a time; those before it are dropped.
    pub fn at(&mut self, time: i64) -> Option<TurnReading> {
        while let Some((at, reading)) = self.waiting.front().copied() {
            if at > time {
                return None;
            }
            self.waiting.pop_front();
            if at == time {
                return Some(reading);
            }
        }
        None
    }

    /// The turn up to a reading that the localizer has not taken.
    pub fn since_taken(&self, reading: Option<TurnReading>) -> Option<MeasuredTurn> {
        reading?.since(&self.taken?)
    }

    /// Records that the localizer has taken the turn up to a reading.
    pub fn take(&mut self, reading: Option<TurnReading>) {
        self.taken = reading.or(self.taken);
    }
}
