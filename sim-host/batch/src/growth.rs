//! How the window grows over the recording.
//!
//! A loss that forgets outliers has wrong minima, whose likelihood can be higher than that of the right one. A window from the
//! start is therefore extended by at most 15 % of its length, so that it predicts the poses beyond it. Where the noise of the
//! wheels makes that prediction uncertain, the new poses are first tracked in shorter steps.

#![expect(clippy::indexing_slicing, reason = "poses and edges have the lengths of the chain")]

use std::ops::Range;

use nalgebra::Matrix3;

use crate::calibration::CalibrateError;
use crate::chain::Covariance;
use crate::constants::Priors;
use crate::fit::{Fit, NOISIEST, ROUNDS};
use crate::noise;
use crate::odometry::{WheelNoise, compose, integrate, wrap};
use crate::problem::PosePrior;
use crate::solve::{SolveError, covariance};

/// Growth of the window, as a share of the distance and of the turns in it, because those determine how well the motion beyond is
/// predicted.
const GROWTH: f64 = 0.15;
/// Shortest growth, metres.
const DISTANCE: f64 = 0.08;
/// Deviations of a predicted pose up to which echoes find their reflectors: position, metres, and heading, radians.
const PREDICTABLE: [f64; 2] = [0.05, 0.1];
/// Distance from which on the noise of the wheels is estimated while the window grows, metres.
const NOISE_FROM: f64 = 1.5;

impl Fit<'_> {
    /// Grows the window over the whole recording.
    pub(crate) fn grow(&mut self) -> Result<(), CalibrateError> {
        // 20° of a robot with a track width of 12 cm.
        let turn = 0.35 * self.nominal.track_width;
        let chain = self.problem.chain;
        let count = chain.len();
        let mut known = 1;
        let mut before = [self.problem.first.position, self.problem.first.heading];
        while known < count {
            let until = |values: &[f64], least: f64| {
                let reached = values[known - 1];
                let limit = reached + least.max(GROWTH * reached);
                values.partition_point(|&value| value <= limit)
            };
            let end = until(&chain.distances, DISTANCE).min(until(&chain.turns, turn));
            let end = end.max(known + 1).min(count);
            self.track(known..end, before, &ROUNDS)?;
            self.problem.window = 0..end;
            known = end;
            self.refine(&ROUNDS)?;
            let covariance = covariance(&self.problem, &self.state).map_err(SolveError::from)?;
            self.adapt_wheel_noise(&covariance);
            before = covariance.poses.last().map_or(before, deviations);
        }
        self.problem.priors = self.priors;
        self.refine(&[ROUNDS[1], ROUNDS[2], ROUNDS[2]])
    }

    /// Finds the poses again, from the start, with the constants that the growth has found: at its beginning it knew them less, and
    /// may have taken wrong reflectors. Associates with these gates.
    pub(crate) fn retrace(&mut self, gates: &[f64]) -> Result<(), CalibrateError> {
        let count = self.problem.chain.len();
        let PosePrior { position, heading, .. } = self.problem.first;
        self.problem.matches.fill(None);
        self.track(1..count, [position, heading], gates)?;
        self.problem.window = 0..count;
        self.refine(&[ROUNDS[1], ROUNDS[2], ROUNDS[2]])
    }

    /// Predicts poses by odometry from the one before.
    pub(crate) fn predict(&mut self, poses: Range<usize>) {
        let drive = self.state.constants.drive();
        for i in poses {
            let motion = integrate(&self.problem.chain.edges[i - 1], &drive);
            let (mut pose, _) = compose(&self.state.poses[i - 1], &motion.pose);
            pose.z = wrap(pose.z);
            self.state.poses[i] = pose;
        }
    }

    /// Finds poses beyond the window: by odometry as far as it predicts them, then corrected by their echoes with the constants
    /// so far, and so on.
    fn track(
        &mut self,
        poses: Range<usize>,
        mut before: [f64; 2],
        gates: &[f64],
    ) -> Result<(), CalibrateError> {
        let (first, priors) = (self.problem.first, self.problem.priors);
        let mut from = poses.start;
        while from < poses.end {
            let to = self.predictable(from..poses.end, before);
            self.predict(from..to);
            if to < poses.end {
                let [position, heading] = before;
                self.problem.first =
                    PosePrior { pose: self.state.poses[from - 1], position, heading };
                self.problem.priors = Priors::fixed_at(&self.state.constants);
                self.problem.window = from - 1..to;
                self.refine(gates)?;
                let covariance =
                    covariance(&self.problem, &self.state).map_err(SolveError::from)?;
                before = covariance.poses.last().map_or(before, deviations);
            }
            from = to;
        }
        (self.problem.first, self.problem.priors) = (first, priors);
        Ok(())
    }

    /// The end of the poses that odometry predicts, from the deviations of the pose before them; at least one.
    fn predictable(&self, poses: Range<usize>, before: [f64; 2]) -> usize {
        let drive = self.state.constants.drive();
        let [position, heading] = before.map(|deviation: f64| deviation.powi(2));
        let mut spread = Matrix3::from_diagonal(&[position, position, heading].into());
        for i in poses.clone() {
            let motion = integrate(&self.problem.chain.edges[i - 1], &drive);
            let mut carry = Matrix3::identity();
            (carry[(0, 2)], carry[(1, 2)]) = (-motion.pose.y, motion.pose.x);
            let (_, back) = compose(&motion.pose, &motion.pose);
            let here = carry * spread * carry.transpose()
                + motion.noise.covariance(self.problem.noise.wheel);
            // In the frame of the next pose.
            spread = back.transpose() * here * back;
            let reached = deviations(&spread);
            if i > poses.start && reached.iter().zip(PREDICTABLE).any(|(at, limit)| *at > limit) {
                return i;
            }
        }
        poses.end
    }

    /// Raises the noise of the wheels above that of the robot file where the window shows more: the gates of the next echoes would
    /// otherwise be too narrow.
    fn adapt_wheel_noise(&mut self, covariance: &Covariance) {
        let reached = self.problem.chain.distances[self.problem.window.end - 1];
        if reached >= NOISE_FROM {
            let seen = noise::estimate(&self.problem, &self.state, covariance).wheel.turn;
            let least = self.nominal.noise.wheel.turn;
            let noise = seen.clamp(least, NOISIEST.max(least));
            self.problem.noise.wheel = WheelNoise::independent(noise);
        }
    }
}

/// Deviations of position and heading.
fn deviations(covariance: &Matrix3<f64>) -> [f64; 2] {
    let position = covariance.fixed_view::<2, 2>(0, 0).symmetric_eigenvalues().max();
    [position.max(0.0).sqrt(), covariance[(2, 2)].max(0.0).sqrt()]
}
