//! A trace of bounded size: when it is full, every second record is dropped, and from then on only
//! every second one is kept.

use sonarfix::geometry::units::Radians;
use sonarfix_map::Floor;

use sonarfix_sim::trace::{AbsoluteRecord, FixRecord, Recorder, Tick, Trace};

/// Default capacity: more than the pixels of a figure and the frames of the player.
pub const CAPACITY: usize = 16_384;

/// Records a run of any length into a trace of bounded size.
#[derive(Debug)]
pub struct Thinned {
    trace: Trace,
    ticks: Spacing,
    fixes: Spacing,
    absolutes: Spacing,
    capacity: usize,
}

/// Selects every `every`-th record of a sequence.
#[derive(Debug)]
struct Spacing {
    every: u64,
    seen: u64,
}

impl Spacing {
    const ALL: Self = Self { every: 1, seen: 0 };

    fn record<T>(&mut self, kept: &mut Vec<T>, capacity: usize, make: impl FnOnce() -> T) {
        if self.seen.is_multiple_of(self.every) {
            if kept.len() >= capacity {
                let mut index = 0_u64;
                kept.retain(|_| {
                    index += 1;
                    !index.is_multiple_of(2)
                });
                self.every *= 2;
            }
            if self.seen.is_multiple_of(self.every) {
                kept.push(make());
            }
        }
        self.seen += 1;
    }
}

impl Thinned {
    /// An empty trace on a floor, of at most `capacity` ticks, and as many fixes and absolute measurements.
    #[must_use]
    pub fn new(floor: &Floor, cone: Radians, capacity: usize) -> Self {
        Self {
            trace: Trace::of(floor, cone),
            ticks: Spacing::ALL,
            fixes: Spacing::ALL,
            absolutes: Spacing::ALL,
            capacity: capacity.max(2),
        }
    }

    /// The records that were kept.
    #[must_use]
    pub fn trace(&self) -> &Trace {
        &self.trace
    }

    /// One in how many ticks was kept.
    #[must_use]
    pub fn every(&self) -> u64 {
        self.ticks.every
    }
}

impl Recorder for Thinned {
    fn started(&mut self, make: impl FnOnce() -> Tick) {
        self.trace.started(make);
    }

    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        self.ticks.record(&mut self.trace.ticks, self.capacity, make);
    }

    fn fix(&mut self, make: impl FnOnce() -> FixRecord) {
        self.fixes.record(&mut self.trace.fixes, self.capacity, make);
    }

    fn absolute(&mut self, make: impl FnOnce() -> AbsoluteRecord) {
        self.absolutes.record(&mut self.trace.absolutes, self.capacity, make);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// For any number of records: at most the capacity, at least half of it, evenly spaced
        /// from the first.
        #[test]
        fn kept_samples_are_bounded_and_evenly_spaced(count in 1_u64..5000, capacity in 2_usize..64) {
            let mut spacing = Spacing::ALL;
            let mut kept = Vec::new();
            for value in 0..count {
                spacing.record(&mut kept, capacity, || value);
                prop_assert!(kept.len() <= capacity);
            }
            let even: Vec<u64> = (0..count).step_by(usize::try_from(spacing.every).unwrap()).collect();
            prop_assert_eq!(&kept, &even);
            prop_assert!(count <= capacity as u64 || 2 * kept.len() >= capacity);
        }
    }
}
