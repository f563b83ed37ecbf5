//! The spread of the position error over many runs, along time.

use rayon::prelude::*;

use crate::simulate::{Simulation, SimulationError};
use crate::trace::{FixRecord, Recorder, Tick};

/// Number of instants.
const INSTANTS: u16 = 300;
/// The share of runs whose error is at most [`Spread::most`].
const SHARE: f64 = 0.95;

/// Quantiles over runs of the distance between estimated and true position.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spread {
    /// Number of runs.
    pub runs: u32,
    /// Seed of the first; the others count up from it.
    pub seed: u64,
    /// Seconds since the start.
    pub times: Vec<f64>,
    /// Median of the error, metres.
    pub median: Vec<f64>,
    /// 95th percentile of the error, metres.
    pub most: Vec<f64>,
}

impl Spread {
    /// Runs the seeds `seed`, `seed + 1`, …
    ///
    /// # Errors
    /// The [`SimulationError`] of the first run that fails.
    pub fn of(simulation: &Simulation, seed: u64, runs: u32) -> Result<Self, SimulationError> {
        let end = simulation.seconds();
        let errors = |run: u32| -> Result<_, SimulationError> {
            let every = end / f64::from(INSTANTS);
            let mut errors = Errors { every, next: 0.0, points: Vec::new() };
            simulation.run(seed.wrapping_add(run.into()), &mut errors)?;
            Ok(errors.points)
        };
        let errors = (0..runs).into_par_iter().map(errors).collect::<Result<Vec<_>, _>>()?;
        let mut spread = Self { runs, seed, ..Self::default() };
        for instant in 0..INSTANTS.into() {
            let at = errors.iter().filter_map(|points: &Vec<(f64, f64)>| points.get(instant));
            let (times, mut values): (Vec<f64>, Vec<f64>) = at.copied().unzip();
            values.sort_by(f64::total_cmp);
            let Some(time) = times.first() else {
                break;
            };
            spread.times.push(*time);
            spread.median.push(quantile(&values, 0.5));
            spread.most.push(quantile(&values, SHARE));
        }
        Ok(spread)
    }
}

/// The smallest value that a share of ascending values does not exceed.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "a share of a length is a length"
)]
fn quantile(values: &[f64], share: f64) -> f64 {
    let rank = (share * values.len() as f64).ceil() as usize;
    values.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

/// Keeps the position error at the first tick of every interval. Ticks are late by the rest of a ping, intervals are not.
struct Errors {
    /// Length of an interval, seconds.
    every: f64,
    /// When the next interval begins, seconds since the start.
    next: f64,
    points: Vec<(f64, f64)>,
}

impl Recorder for Errors {
    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let tick = make();
        let is_due = tick.time >= self.next - 1e-9;
        if let Some(truth) = tick.truth.filter(|_| is_due) {
            self.next += self.every;
            let (truth, pose) = (truth.pose, tick.estimate.pose);
            self.points.push((tick.time, libm::hypot(pose.x - truth.x, pose.y - truth.y)));
        }
    }

    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_the_value_that_a_share_does_not_exceed() {
        let values: Vec<f64> = (1..=20).map(f64::from).collect();
        let quantiles = [0.5, 0.95, 1.0].map(|share| quantile(&values, share).to_bits());
        assert_eq!(quantiles, [10.0_f64, 19.0, 20.0].map(f64::to_bits));
        assert!(quantile(&[], 0.5).is_nan());
    }

    /// With one run, both quantiles are its error at the instants of the trace.
    #[test]
    fn one_run_is_its_own_spread() {
        let scenario =
            sonarfix_map::Scenario::parse(sonarfix_map::CLASSROOM, "", "".as_ref()).unwrap();
        let simulation = Simulation::new(scenario).shortened(30.0);
        let spread = Spread::of(&simulation, 4, 1).unwrap();
        let mut trace = simulation.empty_trace();
        simulation.run(4, &mut trace).unwrap();
        assert_eq!(spread.median, spread.most);
        assert_eq!(spread.times.len(), 300);
        for (time, error) in spread.times.iter().zip(&spread.median) {
            let tick = trace.ticks.iter().find(|tick| (tick.time - time).abs() < 1e-9).unwrap();
            let (truth, pose) = (tick.truth.unwrap().pose, tick.estimate.pose);
            assert!((error - (pose.x - truth.x).hypot(pose.y - truth.y)).abs() < 1e-12);
        }
    }
}
