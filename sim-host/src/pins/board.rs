//! The board of a pulse-width sonar: a trigger goes in, a pulse as long as the flight comes out.

use std::collections::VecDeque;

use sonarfix::units::Instant;

/// From the end of the trigger to the rise of the echo line, µs: an HC-SR04 sends its eight
/// cycles first (`sonarfix-hal`'s `PulseRanger` has the picture).
pub const LATENCY: u64 = 460;

/// A board, with the edges that its echo line will still have.
#[derive(Debug, Default)]
pub struct SonarBoard {
    edges: VecDeque<(u64, bool)>,
}

impl SonarBoard {
    /// The trigger fell at `now`, µs; the line will stay high for `pulse` µs. A board whose line
    /// is still high from the last ping does not listen to its trigger.
    pub fn answer(&mut self, now: u64, pulse: u64) {
        if !self.edges.is_empty() {
            return;
        }
        let sent = now + LATENCY;
        self.edges.extend([(sent, true), (sent + pulse.max(1), false)]);
    }

    /// When the line moves next, µs.
    #[must_use]
    pub fn next_edge(&self) -> Option<u64> {
        self.edges.front().map(|&(at, _)| at)
    }

    /// The edges up to `now`: when the line rose, and when it then fell.
    pub fn edges(&mut self, now: u64) -> (Option<Instant>, Option<Instant>) {
        let mut edges = (None, None);
        while let Some((at, is_high)) = self.edges.pop_front_if(|&mut (at, _)| at <= now) {
            let edge = if is_high { &mut edges.0 } else { &mut edges.1 };
            *edge = Some(Instant::from_ticks(at));
        }
        edges
    }
}
