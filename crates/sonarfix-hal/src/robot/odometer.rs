//! The ledger of ticks: what the counters have counted, and how much of it the localizer knows.
//!
//! It is kept in whole halves of a tick, so that a step can end between two ticks (at a
//! reflection) and yet none is lost, doubled or rounded, however the steps are cut.

use sonarfix::motion::WheelTravel;
use sonarfix::units::Instant;

use super::{EncoderFaults, Faults, Hardware};
use crate::encoder::{Counter, Unwrapped, Wheels};
use crate::time::since;

/// Where both wheels are, in half ticks since the first reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Position {
    right: i64,
    left: i64,
}

/// A position and when it was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Reading {
    pub at: Instant,
    pub position: Position,
}

impl Reading {
    /// The position at a time between this reading and a later one, if the wheels rolled evenly;
    /// to the nearest half tick. Half-way between two readings it is their mean, exactly.
    pub fn between(&self, later: &Self, at: Instant) -> Position {
        let whole = since(later.at, self.at).ticks();
        let part = since(at, self.at).ticks().min(whole);
        let mix = |from, to| interpolate(from, to, part, whole);
        Position {
            right: mix(self.position.right, later.position.right),
            left: mix(self.position.left, later.position.left),
        }
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

/// One wheel's counter, followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Channel {
    ticks: Unwrapped,
    illegal: u32,
}

impl Channel {
    /// Half ticks since the first reading, unless the counter fails.
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
    /// Up to where the localizer has been told; `None` before both counters were first read.
    told: Option<Position>,
}

impl Odometer {
    /// A ledger that begins with its first reading.
    pub fn new(wheels: Wheels) -> Self {
        Self { wheels, right: Channel::default(), left: Channel::default(), told: None }
    }

    /// Begins the ledger, if that has not been possible yet.
    pub fn begin(&mut self, now: Instant, hardware: &mut impl Hardware, faults: &mut Faults) {
        if self.told.is_none() {
            let reading = self.read(now, hardware, faults);
            self.told = reading.map(|reading| reading.position);
        }
    }

    /// Reads both counters; `None` if one fails.
    pub fn read(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        faults: &mut Faults,
    ) -> Option<Reading> {
        let right = self.right.read(hardware.right(), &mut faults.right);
        let left = self.left.read(hardware.left(), &mut faults.left);
        let (right, left) = (right?, left?);
        let position = Position { right, left };
        Some(Reading { at: now, position })
    }

    /// How far the wheels rolled since what the localizer was told.
    pub fn travel_to(&self, position: Position) -> WheelTravel {
        let told = self.told.unwrap_or(position);
        self.wheels
            .travel(position.right.wrapping_sub(told.right), position.left.wrapping_sub(told.left))
    }

    /// Settles the ledger up to here.
    pub fn settle(&mut self, position: Position) {
        self.told = Some(position);
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
        /// Half-way between two readings is their mean, whatever they are: in halves of a tick,
        /// without rounding.
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
