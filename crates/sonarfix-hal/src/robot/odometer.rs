//! The ledger of encoder edges: what the counters have counted, and how much of it the localizer has taken.
//!
//! It counts whole half edges, so that a step can end between two edges (at a reflection) without losing,
//! duplicating or rounding any.

use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::Instant;
use sonarfix::sensor::gyro::TurnReading;

use super::poll::Poll;
use super::{EncoderFaults, Hardware};
use crate::encoder::{Counter, Unwrapped, Wheels};
use crate::time::since;

/// The position of both wheels, in half edges since the first reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Position {
    right: i64,
    left: i64,
}

/// A position and the time of its reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Reading {
    pub at: Instant,
    pub position: Position,
    /// The gyro at the same time, if the robot has one.
    pub turn: Option<TurnReading>,
}

impl Reading {
    /// The reading at a time between this one and a later one at constant speed, rounded to half an edge.
    /// In the middle between two readings it is exactly their mean.
    pub fn between(&self, later: &Self, at: Instant) -> Self {
        let whole = since(later.at, self.at).ticks();
        let part = since(at, self.at).ticks().min(whole);
        let mix = |from, to| interpolate(from, to, part, whole);
        let position = Position {
            right: mix(self.position.right, later.position.right),
            left: mix(self.position.left, later.position.left),
        };
        let turn = self.turn.zip(later.turn).map(|(turn, later)| turn.between(&later, at));
        Self { at, position, turn }
    }
}

/// `from + (to − from) · part / whole`, rounded; `to` if `whole` is zero.
fn interpolate(from: i64, to: i64, part: u64, whole: u64) -> i64 {
    let wide = |value: u64| i64::try_from(value).unwrap_or(i64::MAX);
    let (part, whole) = (wide(part), wide(whole));
    let scaled = to.wrapping_sub(from).saturating_mul(part);
    let rounded = scaled.saturating_add(whole / 2).checked_div_euclid(whole);
    rounded.map_or(to, |moved| from.wrapping_add(moved))
}

/// The unwrapped counter of one wheel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Channel {
    ticks: Unwrapped,
    illegal: u32,
}

impl Channel {
    /// Half edges since the first reading; `None` if the counter fails.
    fn read<C: Counter>(&mut self, counter: &mut C, faults: &mut EncoderFaults) -> Option<i64> {
        let illegal = counter.illegal();
        let more = illegal.wrapping_sub(self.illegal);
        faults.illegal = faults.illegal.saturating_add(more);
        self.illegal = illegal;
        let Ok(ticks) = self.ticks.read(counter) else {
            faults.errors = faults.errors.saturating_add(1);
            return None;
        };
        Some(ticks.wrapping_mul(2))
    }
}

/// The ledger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Odometer {
    wheels: Wheels,
    right: Channel,
    left: Channel,
    /// The position that the localizer has taken; `None` before the first reading of both counters.
    taken: Option<Position>,
}

impl Odometer {
    /// A ledger that starts with its first reading.
    pub fn new(wheels: Wheels) -> Self {
        Self { wheels, right: Channel::default(), left: Channel::default(), taken: None }
    }

    /// Starts the ledger, if it has not started yet.
    pub fn begin(&mut self, poll: &mut Poll<'_, '_, impl Hardware>) {
        if self.taken.is_none() {
            self.taken = self.read(poll).map(|reading| reading.position);
        }
    }

    /// Whether the ledger has started.
    pub fn has_begun(&self) -> bool {
        self.taken.is_some()
    }

    /// Reads both counters; `None` if one fails.
    pub fn read(&mut self, poll: &mut Poll<'_, '_, impl Hardware>) -> Option<Reading> {
        let right = self.right.read(poll.hardware.right(), &mut poll.faults.right);
        let left = self.left.read(poll.hardware.left(), &mut poll.faults.left);
        let position = Position { right: right?, left: left? };
        Some(Reading { at: poll.now, position, turn: None })
    }

    /// The travel of the wheels since the position that the localizer has taken.
    pub fn travel_to(&self, position: Position) -> WheelTravel {
        let taken = self.taken.unwrap_or(position);
        self.wheels.travel(
            position.right.wrapping_sub(taken.right),
            position.left.wrapping_sub(taken.left),
        )
    }

    /// Records that the localizer has taken the travel up to this position.
    pub fn settle(&mut self, position: Position) {
        self.taken = Some(position);
    }

    /// Starts the ledger again with the next reading.
    pub fn forget(&mut self) {
        self.taken = None;
    }

    pub fn wheels(&self) -> &Wheels {
        &self.wheels
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The middle between two readings is exactly their mean.
        #[test]
        fn the_midpoint_is_the_mean(
            from in -1_000_000_000_i64..1_000_000_000,
            ticks in -100_000_i64..100_000,
            half in 1_u64..1_000_000,
        ) {
            let (from, to) = (2 * from, 2 * (from + ticks));
            prop_assert_eq!(2 * interpolate(from, to, half, 2 * half), from + to);
        }

        /// Anywhere else it is the nearest half tick, and between the two.
        #[test]
        fn elsewhere_it_is_the_nearest(
            ticks in -100_000_i64..100_000,
            part in 0_u64..1_000_000,
            rest in 1_u64..1_000_000,
        ) {
            let whole = i64::try_from(part + rest).unwrap();
            let got = interpolate(0, 2 * ticks, part, part + rest);
            let exact_times_whole = 2 * ticks * i64::try_from(part).unwrap();
            prop_assert!(2 * (got * whole - exact_times_whole).abs() <= whole);
        }
    }

    #[test]
    fn no_time_between_readings_is_the_later_one() {
        assert_eq!(interpolate(3, 8, 0, 0), 8);
    }
}
