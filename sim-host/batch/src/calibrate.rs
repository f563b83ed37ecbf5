//! The calibration of a robot from a recording, with a known map or a reference stream.

#![expect(clippy::indexing_slicing, reason = "arrays with an element for each constant")]

use std::ops::Range;

use crate::bearings::Bearings;
pub use crate::calibration::{
    BOTH_WAYS, CalibrateError, Calibration, Determined, Estimate, FEWEST_EXPLAINED, FEWEST_INLIERS,
    Nominal, Residual,
};
use crate::chain_of_poses::{Chain, Spacing};
use crate::constants::{COUNT, Name};
use crate::fit::{Fit, ROUNDS, Start};
use crate::problem::PosePrior;
use crate::recording::Recording;
use crate::reflector::Reflector;
use crate::solve::{SolveError, covariance, solve};
use crate::wall::Wall;
use crate::wheel_noise::Estimated;

/// Bearing of the zero of a servo whose horn is fitted aside, radians: 8°.
pub(crate) const ASIDE: f64 = 0.14;

/// What the estimates start from: the robot file, noisy wheels, a servo horn fitted aside, and wheels that differ by 12 %. Where one
/// of them ends in a wrong minimum, another does not.
const STARTS: [Start; 6] = [
    Start { bearing: 0.0, wheel_difference: None, wheel_noise: 0.0 },
    Start { bearing: 0.0, wheel_difference: None, wheel_noise: 0.015 },
    Start { bearing: ASIDE, wheel_difference: None, wheel_noise: 0.0 },
    Start { bearing: -ASIDE, wheel_difference: None, wheel_noise: 0.0 },
    Start { bearing: 0.0, wheel_difference: Some(0.12), wheel_noise: 0.0 },
    Start { bearing: 0.0, wheel_difference: Some(-0.12), wheel_noise: 0.0 },
];
/// Difference of the losses of two starts that have ended in the same minimum.
const SAME: f64 = 1.0;
/// How often the poses are found again, at most, while this makes them more likely.
const RETRACED: usize = 3;
/// The gates of each such attempt, metres. Through a wide gate the echoes of an object beside a wall are associated with the wall, and the
/// poses follow its ranges as the robot drives; with a narrow one poses that odometry predicts badly find no wall.
const RETRACED_WITH: [&[f64]; 3] = [&ROUNDS, &[0.04, 0.04], &[0.02, 0.02]];
/// Assumed where a half alone has no solution.
const UNKNOWN_SCATTER: f64 = 3.0;

/// Estimates the calibration, from several starts until two of them agree: the solution with the highest likelihood counts, of those
/// whose wheels are within the limit of their noise, if there are any.
///
/// # Errors
/// [`CalibrateError`], also if the result is not trustworthy.
pub fn calibrate(
    recording: &Recording,
    walls: &[Wall],
    nominal: &Nominal,
) -> Result<Calibration, CalibrateError> {
    let (chain, start) = Chain::of(recording, Spacing::CALIBRATION)?;
    let (at_echoes, _) = Chain::of(recording, Spacing::AT_ECHOES)?;
    let reflectors = Reflector::of_walls(walls);
    // With a reference there is one minimum.
    let starts = if recording.references.is_empty() { STARTS.len() } else { 1 };
    let attempt =
        |from| Attempt::of(Fit::new(recording, &chain, &reflectors, nominal, start)?, from);
    let mut best = attempt(STARTS[0]);
    for &from in &STARTS[1..starts] {
        let known = best.as_ref().map_or(0.0, Attempt::known_noise);
        let next = attempt(Start { wheel_noise: from.wheel_noise.max(known), ..from });
        // A bearing that the recording does not determine stays that of the start.
        if from.bearing != 0.0 && next.as_ref().is_ok_and(|next| next.bearings.is_none()) {
            continue;
        }
        let is_confirmed = best.as_ref().is_ok_and(|best| best.is_confirmed_by(&next));
        best = match (best, next) {
            (Ok(best), Ok(next)) if next.is_better_than(&best, 0.0) => Ok(next),
            (Err(_), Ok(next)) => Ok(next),
            (best, _) => best,
        };
        if is_confirmed {
            break;
        }
    }
    let mut best = best?;
    best.fit.check()?;
    let wheel_noise = best.fit.finish_at_echoes(&at_echoes)?;
    best.fit.check()?;
    best.fit.finish(best.bearings, wheel_noise)
}

/// How badly a recording fits the map, for the comparison of start poses: the loss from the robot file with this bearing of the servo's
/// zero, radians.
pub(crate) fn loss(
    recording: &Recording,
    walls: &[Wall],
    nominal: &Nominal,
    bearing: f64,
) -> Result<f64, CalibrateError> {
    let (chain, start) = Chain::of(recording, Spacing::CALIBRATION)?;
    let reflectors = Reflector::of_walls(walls);
    let mut fit = Fit::new(recording, &chain, &reflectors, nominal, start)?;
    fit.start_from(Start { bearing, ..STARTS[0] });
    fit.run()?;
    Ok(fit.loss()?)
}

/// The solution from one start.
struct Attempt<'a> {
    fit: Fit<'a>,
    bearings: Option<Bearings>,
    loss: f64,
}

impl<'a> Attempt<'a> {
    fn of(mut fit: Fit<'a>, from: Start) -> Result<Self, CalibrateError> {
        fit.start_from(from);
        let bearings = fit.run()?;
        let grown = Self { loss: fit.loss()?, fit, bearings };
        if grown.fit.has_references {
            return Ok(grown);
        }
        let mut best = grown;
        for _ in 0..RETRACED {
            let mut is_better = false;
            for gates in RETRACED_WITH {
                if let Ok(next) = best.retraced(gates)
                    && next.is_better_than(&best, SAME)
                {
                    (best, is_better) = (next, true);
                }
            }
            if !is_better {
                break;
            }
        }
        Ok(best)
    }

    /// The solution about the poses that its constants lead to.
    fn retraced(&self, gates: &[f64]) -> Result<Self, CalibrateError> {
        let mut fit = self.fit.clone();
        fit.retrace(gates)?;
        let bearings = fit.settle()?;
        Ok(Self { loss: fit.loss()?, fit, bearings })
    }

    /// Whether this solution counts, and not another: its likelihood is higher by a margin. A solution with wheels beyond the limit of
    /// their noise never counts where another is within it: its poses follow any echoes.
    fn is_better_than(&self, other: &Self, margin: f64) -> bool {
        match (self.fit.is_too_noisy(), other.fit.is_too_noisy()) {
            (false, true) => true,
            (true, false) => false,
            _ => self.loss < other.loss - margin,
        }
    }

    /// The noise of the wheels that the next starts assume at least, m/√m. That of a failed start would make their gates too wide for
    /// the right reflectors.
    fn known_noise(&self) -> f64 {
        if self.fit.is_too_noisy() { 0.0 } else { self.fit.problem.noise.wheel.turn }
    }

    /// Whether another start has ended in the same minimum, and the solution there is plausible.
    fn is_confirmed_by(&self, other: &Result<Self, CalibrateError>) -> bool {
        let is_same = other.as_ref().is_ok_and(|other| (other.loss - self.loss).abs() < SAME);
        is_same && self.fit.check().is_ok()
    }
}

impl Fit<'_> {
    /// The constants of one half of the recording alone, and their variances.
    fn half(&self, window: Range<usize>) -> Result<([f64; COUNT], [f64; COUNT]), SolveError> {
        let mut problem = self.problem.clone();
        problem.first =
            PosePrior { pose: self.state.poses[window.start], position: 0.3, heading: 0.3 };
        problem.window = window;
        let mut state = self.state.clone();
        solve(&problem, &mut state, 15)?;
        let covariance = covariance(&problem, &state)?;
        let mut variances = [0.0; COUNT];
        for (k, variance) in variances.iter_mut().enumerate() {
            *variance = covariance.constants[(k, k)];
        }
        Ok((state.constants.values, variances))
    }

    fn finish(
        self,
        bearings: Option<Bearings>,
        wheel_noise: Estimated,
    ) -> Result<Calibration, CalibrateError> {
        let covariance = covariance(&self.problem, &self.state).map_err(SolveError::from)?;
        let distances = &self.problem.chain.distances;
        let distance = distances.last().copied().unwrap_or(0.0);
        let middle = distances.partition_point(|&d| d < 0.5 * distance);
        let halves = [0..middle, middle..distances.len()].map(|window| self.half(window));
        let [one, other] = halves;
        let halves = one.ok().zip(other.ok());
        let estimates = Name::ALL.into_iter().filter(|name| self.problem.priors.is_free(*name));
        let estimates = estimates.map(|name| {
            let k = name as usize;
            let scatter = halves.as_ref().map_or(UNKNOWN_SCATTER, |((a, var_a), (b, var_b))| {
                (a[k] - b[k]).abs() / (var_a[k] + var_b[k]).sqrt().max(1e-12)
            });
            let deviation = covariance.constants[(k, k)].max(0.0).sqrt() * scatter.max(1.0);
            let value = self.state.constants.values[k];
            Estimate {
                name,
                value,
                deviation,
                scatter,
                determined: self.determined(name, deviation),
            }
        });
        let (inliers, expected) = self.counted();
        let trajectory =
            self.problem.chain.times.iter().zip(&self.state.poses).zip(&covariance.poses);
        let trajectory = trajectory.map(|((time, pose), covariance)| {
            (*time, *pose, covariance.diagonal().map(|variance| variance.max(0.0).sqrt()))
        });
        let referenced = self.problem.window.clone();
        let referenced =
            referenced.filter(|i| self.problem.reference_term(&self.state, *i).is_some()).count();
        Ok(Calibration {
            estimates: estimates.collect(),
            constants: self.state.constants,
            bearings,
            noise: self.problem.noise,
            wheel_noise,
            trajectory: trajectory.collect(),
            residuals: self.residuals(),
            echoes: self.echoes(bearings.map(|found| found.half_cone)),
            inliers,
            expected,
            referenced: if self.has_references { referenced } else { 0 },
            turned: self.turned,
            distance,
        })
    }

    fn determined(&self, name: Name, deviation: f64) -> Determined {
        let is_paired = matches!(name, Name::Right | Name::Left | Name::Track);
        if is_paired && self.is_joint {
            return Determined::Jointly;
        }
        let prior = self.problem.priors.deviations[name as usize];
        if deviation < 0.5 * prior { Determined::Yes } else { Determined::No }
    }

    fn residuals(&self) -> Vec<Residual> {
        let problem = &self.problem;
        let associated = problem.matches.iter().enumerate();
        let residuals = associated.filter_map(|(k, reflector)| {
            let reflector = (*reflector)?;
            let term = problem.range_term(&self.state, k, reflector)?;
            let time = problem.recording.pings[problem.chain.pings[k].index].time;
            let value = -term.residual;
            Some(Residual { time, value, normalized: value / term.deviation, reflector })
        });
        residuals.collect()
    }
}
