//! Wheel travel between two readings of the encoders.

use sonarfix_hal::config::RobotConfig;

/// The travel of the right and of the left wheel at these counts, metres.
#[must_use]
pub fn of_counts(robot: &RobotConfig, counts: [f64; 2]) -> [f64; 2] {
    let [right, left] = counts;
    let wheels = [&robot.right_wheel, &robot.left_wheel];
    let [per_right, per_left] = wheels.map(|wheel| f64::from(wheel.signed_travel().0));
    [right * per_right, left * per_left]
}

/// A reading of the encoders.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reading {
    /// Microseconds of the log's clock.
    pub time: i64,
    /// Travel of the right and of the left wheel since the log began, metres.
    pub wheels: [f64; 2],
}

impl Reading {
    /// The interpolated reading at a time between this one and a later one, for constant speeds.
    #[must_use]
    pub fn between(self, later: Self, time: i64) -> Self {
        if time == later.time {
            return later;
        }
        #[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs, 285 years")]
        let share = (time - self.time) as f64 / (later.time - self.time) as f64;
        let [right, left] = self.wheels;
        let [later_right, later_left] = later.wheels;
        Self {
            time,
            wheels: [right + share * (later_right - right), left + share * (later_left - left)],
        }
    }

    /// The extrapolated reading at the time of `next`, for the speeds from `next` to `after`.
    #[must_use]
    pub fn rolling_on(self, next: Self, after: Self) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs, 285 years")]
        let share = (next.time - self.time) as f64 / (after.time - next.time) as f64;
        let [right, left] = self.wheels;
        let rolled = [after.wheels[0] - next.wheels[0], after.wheels[1] - next.wheels[1]];
        Self { time: next.time, wheels: [right + share * rolled[0], left + share * rolled[1]] }
    }

    /// Speed of the faster wheel from this reading to a later one, metres per second.
    #[must_use]
    pub fn speed_to(self, later: Self) -> f64 {
        let [right, left] = self.wheels;
        let [later_right, later_left] = later.wheels;
        let farther = (later_right - right).abs().max((later_left - left).abs());
        #[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs, 285 years")]
        let seconds = (later.time - self.time) as f64 * 1e-6;
        farther / seconds
    }

    /// The travel from this reading to a later one in `f32`, as the localizer takes it; and this
    /// reading plus exactly that travel, so that the rounding error becomes part of the next travel.
    #[must_use]
    pub fn advanced_to(self, later: Self) -> ([f32; 2], Self) {
        let [right, left] = self.wheels;
        let [later_right, later_left] = later.wheels;
        #[expect(clippy::cast_possible_truncation, reason = "the robot counts in f32")]
        let travel = [later_right - right, later_left - left].map(|metres| metres as f32);
        let advanced = Self {
            time: later.time,
            wheels: [right + f64::from(travel[0]), left + f64::from(travel[1])],
        };
        (travel, advanced)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The parts of a travel add up to it for any number of splits, to within one rounding of
        /// the last part.
        #[test]
        fn splitting_conserves_the_travel(
            from in -1e4_f64..1e4,
            travel in prop::array::uniform2(-0.5_f64..0.5),
            mut times in prop::collection::vec(0_i64..1_000_000, 0..50),
        ) {
            let first = Reading { time: 0, wheels: [from, -from] };
            let wheels = [from + travel[0], travel[1] - from];
            let last = Reading { time: 1_000_000, wheels };
            times.sort_unstable();
            times.push(last.time);
            let mut received = first;
            let (mut sums, mut last_part) = ([0.0, 0.0], 0.0);
            for time in times {
                let (part, advanced) = received.advanced_to(first.between(last, time));
                for (sum, part) in sums.iter_mut().zip(part) {
                    *sum += f64::from(part);
                }
                last_part = f64::from(part[0].abs().max(part[1].abs()));
                received = advanced;
            }
            for (sum, travel) in sums.iter().zip(travel) {
                prop_assert!((sum - travel).abs() < 6e-8 * last_part + 1e-11, "{sum} of {travel}");
            }
        }

        /// The share of the travel is the share of the time.
        #[test]
        fn wheels_roll_evenly(time in 1_i64..999_999, travel in -0.5_f64..0.5) {
            let first = Reading { time: 0, wheels: [1.0, 2.0] };
            let last = Reading { time: 1_000_000, wheels: [1.0 + travel, 2.0] };
            let between = first.between(last, time);
            #[expect(clippy::cast_precision_loss, reason = "small")]
            let expected = 1.0 + travel * time as f64 * 1e-6;
            prop_assert!((between.wheels[0] - expected).abs() < 1e-12);
            prop_assert!((between.wheels[1] - 2.0).abs() < 1e-12);
        }
    }
}
