//! The turn between two times, from the rates of an IMU.

use std::collections::VecDeque;

use crate::motion::seconds;
use crate::problem::Nanoseconds;

/// Longest time between two samples, and between the last sample and the end of a step.
const LONGEST: Nanoseconds = 50_000_000;
/// The most samples that are kept: 5 s at 400 Hz.
const MOST_SAMPLES: usize = 2000;

/// The rates about z of the latest seconds.
#[derive(Debug, Clone, Default)]
pub struct Turns {
    samples: VecDeque<(Nanoseconds, f64)>,
}

impl Turns {
    /// Takes a rate, rad/s counter-clockwise; false if it is not finite. Old and repeated ones are not needed.
    pub fn take(&mut self, at: Nanoseconds, rate: f64) -> bool {
        if rate.is_finite() && self.samples.back().is_none_or(|(last, _)| *last < at) {
            self.samples.push_back((at, rate));
            if self.samples.len() > MOST_SAMPLES {
                self.samples.pop_front();
            }
        }
        rate.is_finite()
    }

    /// Forgets all rates, because the clock was set back.
    pub fn forget(&mut self) {
        self.samples.clear();
    }

    /// The turn between two times, radians; `None` if the samples do not cover them.
    #[must_use]
    pub fn angle(&self, from: Nanoseconds, to: Nanoseconds) -> Option<f64> {
        let first = self.samples.partition_point(|(at, _)| *at <= from).checked_sub(1)?;
        let (mut angle, mut since) = (0.0, from);
        let (mut last, mut rate) = *self.samples.get(first)?;
        for &(at, next) in self.samples.range(first + 1..) {
            if since >= to || at - last > LONGEST {
                break;
            }
            let end = at.min(to);
            let span = seconds(at - last);
            let rate_at = |time: Nanoseconds| rate + (next - rate) * seconds(time - last) / span;
            angle += 0.5 * (rate_at(since) + rate_at(end)) * seconds(end - since);
            since = end;
            (last, rate) = (at, next);
        }
        // The latest rate holds until the next sample arrives.
        (to - since <= LONGEST).then(|| angle + rate * seconds(to - since))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_integrated_between_samples() {
        let mut turns = Turns::default();
        for n in 0..=10_i32 {
            assert!(turns.take(Nanoseconds::from(n) * 10_000_000, f64::from(n)));
        }
        assert!(!turns.take(200_000_000, f64::NAN));
        // The rate grows by 100 rad/s².
        let expected = |from: f64, to: f64| 50.0 * (to * to - from * from);
        for (from, to) in [(0_i32, 100_i32), (15, 47), (93, 94), (20, 21)] {
            let [a, b] = [from, to].map(|milli| Nanoseconds::from(milli) * 1_000_000);
            let found = turns.angle(a, b).unwrap();
            let expected = expected(f64::from(from) * 1e-3, f64::from(to) * 1e-3);
            assert!((found - expected).abs() < 1e-9, "{from} {to}: {found} {expected}");
        }
        assert!((turns.angle(100_000_000, 110_000_000).unwrap() - 0.1).abs() < 1e-9);
        assert_eq!(turns.angle(100_000_000, 200_000_000), None);
        assert_eq!(turns.angle(-1, 1), None);
    }
}
