//! Periods in which a robot could not read its encoders, in the log that it recorded itself.
//!
//! The log of a robot has a record for every encoder sample that it took, also while it stood. A sample that failed has no
//! record; it was due at a multiple of the robot's period since its start.

use sonarfix::health::DEGRADED_WITHOUT_ODOMETRY;

use crate::wheels::Reading;

/// Most failed samples of a gap that are replayed; of a longer gap, every second or third sample and so on.
const MOST_SAMPLES: i64 = 1_000;

/// The gap between two encoder records. Times in microseconds.
#[derive(Debug, Clone, Copy)]
pub struct Gap {
    after: i64,
    before: i64,
    /// The robot's start, and the period of its samples.
    epoch: i64,
    period: i64,
}

impl Gap {
    /// The gap between two records, if the robot was without odometry for longer than it forgives.
    pub fn between(from: Reading, to: Reading, epoch: i64, period: i64) -> Option<Self> {
        let shortest = i64::try_from(DEGRADED_WITHOUT_ODOMETRY.to_micros()).unwrap_or(i64::MAX);
        let is_gap = to.time - from.time > shortest;
        is_gap.then_some(Self { after: from.time, before: to.time, epoch, period: period.max(1) })
    }

    /// The next failed sample after one of these times, the later one, and up to a time within the gap.
    pub fn next_failed(&self, after: i64, until: i64) -> Option<i64> {
        let stride = self.period * ((self.before - self.after) / (MOST_SAMPLES * self.period) + 1);
        let after = after.max(self.after);
        let next = self.epoch + ((after - self.epoch).div_euclid(stride) + 1) * stride;
        (next <= until && next < self.before).then_some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(time: i64) -> Reading {
        Reading { time, wheels: [0.0; 2] }
    }

    fn failed(gap: Gap, until: i64) -> Vec<i64> {
        let next = |after: &i64| gap.next_failed(*after, until);
        std::iter::successors(gap.next_failed(i64::MIN, until), next).collect()
    }

    #[test]
    fn samples_fail_on_the_grid_of_the_robot_between_the_records() {
        // A ping's reflection at 1.234 s; the next tick that could be read at 1.8 s.
        let gap = Gap::between(reading(1_234_000), reading(1_800_000), 100_000, 100_000).unwrap();
        assert_eq!(failed(gap, 1_800_000), [1_300_000, 1_400_000, 1_500_000, 1_600_000, 1_700_000]);
        assert_eq!(failed(gap, 1_450_000), [1_300_000, 1_400_000]);
        assert_eq!(gap.next_failed(1_400_000, i64::MAX), Some(1_500_000));
    }

    #[test]
    fn half_a_second_is_no_gap() {
        let between = |end| Gap::between(reading(0), reading(end), 0, 100_000);
        assert!(between(500_000).is_none());
        assert_eq!(failed(between(500_001).unwrap(), i64::MAX).len(), 5);
    }

    #[test]
    fn the_samples_of_an_endless_gap_are_bounded() {
        let end = 1_000_000 * 3_600 * 24 * 365;
        let gap = Gap::between(reading(0), reading(end), 0, 100_000).unwrap();
        let times = failed(gap, i64::MAX);
        assert!((900..=1_000).contains(&times.len()), "{}", times.len());
        assert!(times.is_sorted() && times.last().is_some_and(|last| *last > end / 1_000 * 998));
    }
}
