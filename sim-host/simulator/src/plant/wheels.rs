//! Converts the distance that the wheels roll on the ground to encoder readings.

use crate::random;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{HeadingSlip, Truth as Parameters, Upsets};

/// The travel of the wheels between two instants.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Travel {
    /// The encoder readings, right and left, metres.
    pub measured: [f64; 2],
    /// The readings without noise, slip and bumps, metres.
    pub noiseless: [f64; 2],
    /// The true turn of the robot, radians.
    pub turn: f64,
    /// The time of the travel, seconds.
    pub seconds: f64,
}

impl Travel {
    /// This travel and another one after it.
    #[must_use]
    pub fn plus(&self, more: &Self) -> Self {
        let sum = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
        Self {
            measured: sum(self.measured, more.measured),
            noiseless: sum(self.noiseless, more.noiseless),
            turn: self.turn + more.turn,
            seconds: self.seconds + more.seconds,
        }
    }
}

/// Two wheels with their systematic and random errors.
#[derive(Debug, Clone)]
pub struct Wheels {
    parameters: Parameters,
    upsets: Upsets,
    slipping: Slipping,
}

/// A wheel that spins: which one, by how much, and for how long from now.
#[derive(Debug, Clone, Copy, Default)]
struct Slipping {
    wheel: usize,
    /// Metres per second.
    speed: f64,
    /// Seconds.
    left: f64,
}

/// How long a slip lasts that turns the odometry, seconds.
const SLIP_TIME: f64 = 0.5;

impl Wheels {
    /// Wheels with these true parameters.
    #[must_use]
    pub fn new(parameters: &Parameters, upsets: Upsets) -> Self {
        Self { parameters: *parameters, upsets, slipping: Slipping::default() }
    }

    /// The true parameters now.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Rolls both wheels by these distances over the ground, metres, in this time, seconds, and reads the encoders.
    pub fn roll(
        &mut self,
        rolled: [f64; 2],
        seconds: f64,
        rng: &mut ChaCha8Rng,
        slips: &mut ChaCha8Rng,
    ) -> Travel {
        let p = &self.parameters;
        let noiseless = [rolled[0] / (1.0 + p.scale_right), rolled[1] / (1.0 + p.scale_left)];
        let mut measured = noiseless;
        for travel in &mut measured {
            *travel += p.wheel_noise * travel.abs().sqrt() * random::normal(rng);
        }
        for travel in &mut measured {
            *travel += upset(&self.upsets, *travel, rng);
        }
        let turn = (rolled[0] - rolled[1]) / self.parameters.track_width;
        self.slip(&mut measured, seconds, slips);
        let root_distance = (0.5 * (noiseless[0].abs() + noiseless[1].abs())).sqrt();
        self.let_parameters_walk(root_distance, rng);
        Travel { measured, noiseless, turn, seconds }
    }

    /// Begins a slip of the right (0) or left (1) wheel that turns the odometry by this angle, radians, while the robot drives.
    pub fn begin_slip(&mut self, wheel: usize, turn: f64) {
        let speed = turn * self.parameters.track_width / SLIP_TIME;
        self.slipping = Slipping { wheel, speed, left: SLIP_TIME };
    }

    /// Adds a slip that turns the odometry. A wheel that stands does not slip. No draw for a robot without slips.
    fn slip(&mut self, measured: &mut [f64; 2], seconds: f64, rng: &mut ChaCha8Rng) {
        let HeadingSlip { every, least, most } = self.upsets.heading_slip;
        let is_driving = measured.iter().any(|travel| travel.abs() > 0.0);
        if !is_driving {
            return;
        }
        if every.is_finite() && rng.random::<f64>() < seconds / every {
            let turn = least + (most - least) * rng.random::<f64>();
            self.begin_slip(usize::from(rng.random::<bool>()), turn);
        }
        let Slipping { wheel, speed, left } = &mut self.slipping;
        let now = left.min(seconds);
        if let Some(travel) = measured.get_mut(*wheel) {
            *travel += *speed * now * travel.signum();
        }
        *left -= now;
    }

    fn let_parameters_walk(&mut self, root_distance: f64, rng: &mut ChaCha8Rng) {
        let p = &mut self.parameters;
        // No draw without a random walk, so that the noise of a constant robot does not change.
        if p.scale_walk > 0.0 {
            p.scale_right += p.scale_walk * root_distance * random::normal(rng);
            p.scale_left += p.scale_walk * root_distance * random::normal(rng);
        }
        if p.track_width_walk > 0.0 {
            let step = random::normal(rng);
            p.track_width += p.track_width_walk * root_distance * step;
        }
    }
}

/// The error of slip and bumps in an encoder reading. A slipping wheel turns further than it rolls;
/// a bump has either sign.
fn upset(upsets: &Upsets, travel: f64, rng: &mut ChaCha8Rng) -> f64 {
    let mut added = 0.0;
    if happens(upsets.slip.every, travel, rng) {
        added += upsets.slip.by * travel.signum();
    }
    if happens(upsets.bump.every, travel, rng) {
        added += upsets.bump.by * random::normal(rng);
    }
    added
}

/// Whether an event with a mean distance of `every` metres happens on this travel. No draw for a
/// probability of zero.
fn happens(every: f64, travel: f64, rng: &mut ChaCha8Rng) -> bool {
    every.is_finite() && rng.random::<f64>() < travel.abs() / every
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use sonarfix_map::{Scenario, Upset};

    /// Rolls 400 m in steps of 4 cm; returns the excess of the right encoder.
    fn excess(upsets: Upsets, seed: u64) -> f64 {
        let scenario = Scenario::paper().unwrap();
        let truth = Parameters { wheel_noise: 0.0, ..scenario.truth };
        let mut wheels = Wheels::new(&truth, upsets);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut slips = rng.clone();
        (0..10_000)
            .map(|_| wheels.roll([0.04, 0.04], 0.1, &mut rng, &mut slips))
            .map(|travel| travel.measured[0] - travel.noiseless[0])
            .sum()
    }

    #[test]
    fn a_slip_turns_the_odometry_by_its_angle_while_the_robot_drives() {
        let scenario = Scenario::paper().unwrap();
        let truth = Parameters { wheel_noise: 0.0, ..scenario.truth };
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut slips = rng.clone();
        for (wheel, speed, turn) in [(0, 0.04, 0.3), (1, 0.04, -0.3), (0, -0.04, -0.3)] {
            let mut wheels = Wheels::new(&truth, Upsets::default());
            wheels.begin_slip(wheel, 0.3);
            let standing = wheels.roll([0.0, 0.0], 1.0, &mut rng, &mut slips);
            assert_eq!(standing.measured.map(f64::to_bits), [0; 2]);
            let [mut right, mut left] = [0.0, 0.0];
            for _ in 0..10 {
                let travel = wheels.roll([speed, speed], 0.1, &mut rng, &mut slips);
                right += travel.measured[0] - travel.noiseless[0];
                left += travel.measured[1] - travel.noiseless[1];
            }
            let turned = (right - left) / wheels.parameters().track_width;
            assert!((turned - turn).abs() < 1e-9, "{turned}");
        }
    }

    #[test]
    fn slips_add_counts_and_bumps_have_either_sign() {
        let often = Upset { every: 2.0, by: 0.01 };
        let slips = excess(Upsets { slip: often, ..Upsets::default() }, 1);
        // About 200 slips (403 m / 2 m) of 1 cm, ± 4 deviations of 14.
        assert!((1.45..2.6).contains(&slips), "{slips}");
        let bumps = (0..8).map(|seed| excess(Upsets { bump: often, ..Upsets::default() }, seed));
        let bumps: Vec<f64> = bumps.collect();
        // 200 bumps of 1 cm with random signs: 14 cm.
        assert!(bumps.iter().all(|sum| sum.abs() > 1e-6 && sum.abs() < 0.6), "{bumps:?}");
        assert!(bumps.iter().any(|sum| *sum < 0.0) && bumps.iter().any(|sum| *sum > 0.0));
    }
}
