//! The board of a pulse-width sonar: it answers a trigger with a pulse as long as the time of flight.

use std::collections::VecDeque;

use sonarfix::geometry::units::Instant;

/// From the end of the trigger to the rise of the echo line, µs: an HC-SR04 first sends its eight
/// cycles (timing diagram: `PulseRanger` in `sonarfix-hal`).
pub const LATENCY: u64 = 460;

/// A board with the pending edges of its echo line.
#[derive(Debug, Default)]
pub struct SonarBoard {
    edges: VecDeque<(u64, bool)>,
}

impl SonarBoard {
    /// Handles a trigger that fell at `now`, µs; the line then is high for `pulse` µs. While the
    /// echo line is still high from the last ping, the board ignores the trigger.
    pub fn answer(&mut self, now: u64, pulse: u64) {
        if !self.edges.is_empty() {
            return;
        }
        let sent = now + LATENCY;
        self.edges.extend([(sent, true), (sent + pulse.max(1), false)]);
    }

    /// When the line falls, µs, if it is high or will rise.
    #[must_use]
    pub fn falls_at(&self) -> Option<u64> {
        self.edges.back().filter(|(_, is_high)| !is_high).map(|&(at, _)| at)
    }

    /// Lets the line fall at `at`, µs, if it falls later, and after it has risen.
    pub fn ends_by(&mut self, at: u64) {
        let rises = self.edges.front().filter(|(_, is_high)| *is_high).map_or(0, |&(at, _)| at);
        if let Some((falls, false)) = self.edges.back_mut() {
            *falls = (*falls).min(at.max(rises + 1));
        }
    }

    /// Time of the next edge, µs.
    #[must_use]
    pub fn next_edge(&self) -> Option<u64> {
        self.edges.front().map(|&(at, _)| at)
    }

    /// The rising and the falling edge up to `now`.
    pub fn edges(&mut self, now: u64) -> (Option<Instant>, Option<Instant>) {
        let mut edges = (None, None);
        while let Some((at, is_high)) = self.edges.pop_front_if(|&mut (at, _)| at <= now) {
            let edge = if is_high { &mut edges.0 } else { &mut edges.1 };
            *edge = Some(Instant::from_ticks(at));
        }
        edges
    }
}
