//! The least-squares problem: residuals of wheel travel, ranges, reference poses and priors, and their derivatives.

#![expect(
    clippy::indexing_slicing,
    reason = "poses, edges and matches have the lengths of the chain that they were built with"
)]

use std::ops::Range;

use nalgebra::{Matrix3, SMatrix, SVector, Vector2, Vector3};

use crate::chain::{Covariance, Minimum, Normal, Singular};
use crate::chain_of_poses::{Chain, Event};
use crate::constants::{COUNT, Constants, Name, Priors};
use crate::odometry::{Edge, WheelNoise, compose, integrate, wrap};
use crate::recording::{Recording, ReferencePose};
use crate::reflector::Reflector;
use crate::wall::sonar;

/// A row of derivatives by the constants.
pub type Row = SVector<f64, COUNT>;
/// Derivatives of a pose residual by the constants.
pub type Rows = SMatrix<f64, 3, COUNT>;

/// Noise of an edge that does not come from the wheels: ahead, aside (metres) and of the heading (radians). It keeps the
/// covariance of a single step regular, and must be far below the noise of good wheels on the shortest edges.
const EDGE_FLOOR: [f64; 3] = [2e-5, 1e-4, 2e-5];
/// Normalized edge residual beyond which it counts linearly (Huber), so that a slip does not bend the rest.
const HUBER: f64 = 4.0;

/// Standard deviations of the measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of the wheels' travel.
    pub wheel: WheelNoise,
    /// Of a range, metres, at zero range.
    pub range: f64,
    /// Its growth with the range.
    pub range_per_metre: f64,
    /// Of a reference position, metres.
    pub position: f64,
    /// Of a reference heading, radians.
    pub heading: f64,
}

impl Noise {
    /// Standard deviation of a range.
    #[must_use]
    pub fn of_range(&self, range: f64) -> f64 {
        self.range.hypot(self.range_per_metre * range)
    }

    /// With another noise of the wheels, and that of the ranges times a factor.
    #[must_use]
    pub fn with(&self, wheel: WheelNoise, of_ranges: f64) -> Self {
        Self {
            wheel,
            range: self.range * of_ranges,
            range_per_metre: self.range_per_metre * of_ranges,
            ..*self
        }
    }
}

/// Unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The poses.
    pub poses: Vec<Vector3<f64>>,
    /// The constants.
    pub constants: Constants,
}

/// A pose that is known in advance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosePrior {
    /// The pose.
    pub pose: Vector3<f64>,
    /// Standard deviation of x and y, metres.
    pub position: f64,
    /// Standard deviation of the heading, radians.
    pub heading: f64,
}

/// The problem: what was measured, and with what it is associated.
#[derive(Debug, Clone)]
pub struct Problem<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// Its chain of poses.
    pub chain: &'a Chain,
    /// What of the map can answer.
    pub reflectors: &'a [Reflector],
    /// The reflector of each ping of the chain; `None`: not used.
    pub matches: Vec<Option<usize>>,
    /// Noises.
    pub noise: Noise,
    /// Priors of the constants.
    pub priors: Priors,
    /// Which poses are estimated.
    pub window: Range<usize>,
    /// Prior of the first of them.
    pub first: PosePrior,
    /// Number of deviations at which a range loses three quarters of its weight (Geman–McClure).
    pub kernel: f64,
}

/// Residual and derivatives of a range.
#[derive(Debug, Clone, Copy)]
pub struct RangeTerm {
    /// Expected minus measured range, metres.
    pub residual: f64,
    /// Standard deviation, metres.
    pub deviation: f64,
    /// Derivatives by the pose.
    pub by_pose: Vector3<f64>,
    /// Derivatives by the constants.
    pub by_constants: Row,
    /// Angle off the axis, radians.
    pub off_axis: f64,
    /// The expected range, metres.
    pub expected: f64,
}

/// Residual and derivatives of an edge.
#[derive(Debug, Clone, Copy)]
pub struct EdgeTerm {
    /// Residual of the relative pose.
    pub residual: Vector3<f64>,
    /// Inverse of its covariance.
    pub information: Matrix3<f64>,
    /// Derivatives by its first pose.
    pub by_from: Matrix3<f64>,
    /// Derivatives by its second pose.
    pub by_to: Matrix3<f64>,
    /// Derivatives by the constants.
    pub by_constants: Rows,
    /// What the covariance adds to them in the gradient of the cost.
    pub of_covariance: Rows,
}

/// Residual and derivatives of a reference pose.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceTerm {
    /// Estimated marker minus reference.
    pub residual: Vector3<f64>,
    /// Derivatives by the pose.
    pub by_pose: Matrix3<f64>,
    /// Derivatives by the constants.
    pub by_constants: Rows,
}

impl Problem<'_> {
    /// The pose at an event, with its derivatives by the pose before it and by the constants.
    #[must_use]
    pub fn pose_at(&self, state: &State, event: &Event) -> (Vector3<f64>, Matrix3<f64>, Rows) {
        let from = &state.poses[event.pose];
        let motion = integrate(&event.steps, &state.constants.drive());
        let (pose, rotation) = compose(from, &motion.pose);
        let mut by_pose = Matrix3::identity();
        by_pose[(0, 2)] = -(pose.y - from.y);
        by_pose[(1, 2)] = pose.x - from.x;
        let mut by_constants = Rows::zeros();
        by_constants.fixed_columns_mut::<3>(0).copy_from(&(rotation * motion.by_drive));
        (pose, by_pose, by_constants)
    }

    /// The term of ping `k` of the chain with a reflector.
    #[must_use]
    pub fn range_term(&self, state: &State, k: usize, reflector: usize) -> Option<RangeTerm> {
        let event = &self.chain.pings[k];
        let ping = &self.recording.pings[event.index];
        let measured = ping.range?;
        let constants = &state.constants;
        let (pose, by_pose, of_pose) = self.pose_at(state, event);
        let (at, direction) = sonar(&pose, ping.bearing, constants);
        let view = self.reflectors[reflector].view(at, direction);
        let stretch = 1.0 + constants.get(Name::RangeScale);
        let (aside, off_axis) = (view.off_axis.signum(), view.off_axis.abs());
        let slope = constants.get(Name::OffAxis) * aside;
        let expected =
            stretch * view.distance + constants.get(Name::RangeOffset) + slope * view.off_axis;
        let by_position = view.away * stretch + view.turned * slope;
        let (sin, cos) = pose.z.sin_cos();
        let arm = at - Vector2::new(pose.x, pose.y);
        let by_heading = by_position.dot(&Vector2::new(-arm.y, arm.x)) + slope;
        let by_event = Vector3::new(by_position.x, by_position.y, by_heading);
        let mut by_constants = of_pose.tr_mul(&by_event);
        by_constants[Name::RangeScale as usize] = view.distance;
        by_constants[Name::MountAhead as usize] = by_position.dot(&Vector2::new(cos, sin));
        by_constants[Name::MountLeft as usize] = by_position.dot(&Vector2::new(-sin, cos));
        by_constants[Name::RangeOffset as usize] = 1.0;
        by_constants[Name::OffAxis as usize] = off_axis;
        Some(RangeTerm {
            residual: expected - measured,
            deviation: self.noise.of_range(expected),
            by_pose: by_pose.tr_mul(&by_event),
            by_constants,
            off_axis: view.off_axis,
            expected,
        })
    }

    /// The variance of an expected range by the covariance of its pose and of the constants.
    #[must_use]
    pub fn variance(&self, covariance: &Covariance, pose: usize, term: &RangeTerm) -> f64 {
        let i = pose - self.window.start;
        let (by_pose, by) = (&term.by_pose, &term.by_constants);
        by_pose.dot(&(covariance.poses[i] * by_pose))
            + 2.0 * by_pose.dot(&(&covariance.cross[i] * by))
            + by.dot(&(&covariance.constants * by))
    }

    /// The term of the edge after a pose.
    #[must_use]
    pub fn edge_term(&self, state: &State, i: usize) -> Option<EdgeTerm> {
        let drive = state.constants.drive();
        let mut motion = integrate(&self.chain.edges[i], &drive);
        motion.noise = motion.noise.scaled(self.chain.steadiness[i]);
        let poses = [&state.poses[i], &state.poses[i + 1]];
        let edge = motion.between(poses, self.noise.wheel, EDGE_FLOOR)?;
        let mut by_constants = Rows::zeros();
        by_constants.fixed_columns_mut::<3>(0).copy_from(&-motion.by_drive);
        let Edge { residual, information, by_from, by_to } = edge;
        let mut of_covariance = Rows::zeros();
        let weighted = information * residual;
        for (k, by) in motion.noise.by_drive(self.noise.wheel, &drive).iter().enumerate() {
            of_covariance.set_column(k, &(by * weighted * -0.5));
        }
        Some(EdgeTerm { residual, information, by_from, by_to, by_constants, of_covariance })
    }

    /// The term of a pose with the reference stream; `None` outside of the stream.
    #[must_use]
    pub fn reference_term(&self, state: &State, i: usize) -> Option<ReferenceTerm> {
        let constants = &state.constants;
        let middle = self.middle();
        let since = self.chain.times[i] - middle;
        let lag = constants.get(Name::Lag) + constants.get(Name::ClockRate) * since;
        let (reference, velocity) =
            interpolate(&self.recording.references, self.chain.times[i] + lag)?;
        let pose = &state.poses[i];
        let (ahead, left) = (constants.get(Name::MarkerAhead), constants.get(Name::MarkerLeft));
        let arm = Vector3::new(ahead, left, constants.get(Name::MarkerHeading));
        let (marker, rotation) = compose(pose, &arm);
        let mut residual = marker - reference;
        residual.z = wrap(residual.z);
        let mut by_pose = Matrix3::identity();
        by_pose[(0, 2)] = -(marker.y - pose.y);
        by_pose[(1, 2)] = marker.x - pose.x;
        let mut by_constants = Rows::zeros();
        by_constants.set_column(Name::Lag as usize, &-velocity);
        by_constants.set_column(Name::ClockRate as usize, &(-velocity * since));
        by_constants.fixed_columns_mut::<3>(Name::MarkerAhead as usize).copy_from(&rotation);
        Some(ReferenceTerm { residual, by_pose, by_constants })
    }

    /// The reference stream's pose at the time of a pose, without lag; `None` outside of the stream.
    #[must_use]
    pub fn reference_at(&self, i: usize) -> Option<Vector3<f64>> {
        interpolate(&self.recording.references, self.chain.times[i]).map(|(pose, _)| pose)
    }

    /// The middle of the recording, seconds.
    #[must_use]
    pub fn middle(&self) -> f64 {
        let times = &self.chain.times;
        times.first().zip(times.last()).map_or(0.0, |(first, last)| f64::midpoint(*first, *last))
    }

    /// Information of a reference pose.
    #[must_use]
    pub fn reference_information(&self) -> Matrix3<f64> {
        let (position, heading) = (self.noise.position.powi(-2), self.noise.heading.powi(-2));
        Matrix3::from_diagonal(&Vector3::new(position, position, heading))
    }

    /// The normal equations at a state, and the cost there. Constants with a prior deviation of zero do not change.
    #[must_use]
    pub fn linearize(&self, state: &State) -> (Normal, f64) {
        let mut normal = Normal::new(self.window.len(), COUNT);
        let mut cost = self.priors(state, &mut normal);
        for i in self.window.clone() {
            if i + 1 < self.window.end
                && let Some(term) = self.edge_term(state, i)
            {
                cost += self.add_edge(i, &term, &mut normal);
            }
            if let Some(term) = self.reference_term(state, i) {
                let information = self.reference_information();
                let (weight, share) = huber(&term.residual, &information);
                cost += share;
                self.add_pose_term(i, &term, &(information * weight), &mut normal);
            }
        }
        for (k, event) in self.chain.pings.iter().enumerate() {
            if let Some(reflector) = self.matches[k]
                && self.window.contains(&event.pose)
                && let Some(term) = self.range_term(state, k, reflector)
            {
                cost += self.add_range(event.pose, &term, &mut normal);
            }
        }
        self.fix(&mut normal);
        (normal, cost)
    }

    /// Negative logarithm of the likelihood of the recording by the noises, up to a constant: poses and constants are integrated
    /// out by Laplace's method (Tierney and Kadane 1986) about the minimum of the cost near a state. For a linear problem this
    /// is the likelihood of the innovations of a Kalman filter (Schweppe 1965).
    ///
    /// # Errors
    /// [`Singular`].
    pub fn marginal(&self, state: &State) -> Result<f64, Singular> {
        let (normal, cost) = self.linearize(state);
        let Minimum { decrease, log_determinant } = normal.minimum()?;
        let edges = self.window.start..self.window.end.saturating_sub(1);
        let informations =
            edges.filter_map(|i| self.edge_term(state, i)).map(|term| term.information);
        let of_edges: f64 = informations.map(|information| information.determinant().ln()).sum();
        Ok(cost - decrease + 0.5 * (log_determinant - of_edges))
    }

    /// The weight of a range, and its share of the cost (Geman–McClure).
    #[must_use]
    pub fn kernel(&self, term: &RangeTerm) -> (f64, f64) {
        let (square, limit) = ((term.residual / term.deviation).powi(2), self.kernel.powi(2));
        let share = limit / (limit + square);
        (share * share, 0.5 * square * share)
    }

    fn add_range(&self, pose: usize, term: &RangeTerm, normal: &mut Normal) -> f64 {
        let (weight, cost) = self.kernel(term);
        let information = weight / term.deviation.powi(2);
        let i = pose - self.window.start;
        let (by_pose, by_constants) = (&term.by_pose, &term.by_constants);
        normal.diagonal[i] += by_pose * by_pose.transpose() * information;
        normal.border[i] += by_pose * by_constants.transpose() * information;
        normal.corner += by_constants * by_constants.transpose() * information;
        normal.poses[i] -= by_pose * (information * term.residual);
        normal.constants -= by_constants * (information * term.residual);
        cost
    }

    fn add_edge(&self, at: usize, term: &EdgeTerm, normal: &mut Normal) -> f64 {
        let (weight, cost) = huber(&term.residual, &term.information);
        let information = term.information * weight;
        let i = at - self.window.start;
        let (from, to) =
            (term.by_from.transpose() * information, term.by_to.transpose() * information);
        let by_constants = term.by_constants + term.of_covariance;
        let constants = by_constants.transpose() * information;
        normal.diagonal[i] += from * term.by_from;
        normal.diagonal[i + 1] += to * term.by_to;
        normal.beside[i] += from * term.by_to;
        normal.border[i] += from * by_constants;
        normal.border[i + 1] += to * by_constants;
        normal.corner += constants * by_constants;
        normal.poses[i] -= from * term.residual;
        normal.poses[i + 1] -= to * term.residual;
        normal.constants -= constants * term.residual;
        cost
    }

    fn add_pose_term(
        &self,
        at: usize,
        term: &ReferenceTerm,
        information: &Matrix3<f64>,
        normal: &mut Normal,
    ) {
        let i = at - self.window.start;
        let pose = term.by_pose.transpose() * information;
        let constants = term.by_constants.transpose() * information;
        normal.diagonal[i] += pose * term.by_pose;
        normal.border[i] += pose * term.by_constants;
        normal.corner += constants * term.by_constants;
        normal.poses[i] -= pose * term.residual;
        normal.constants -= constants * term.residual;
    }

    /// The priors' part of the equations, and of the cost.
    fn priors(&self, state: &State, normal: &mut Normal) -> f64 {
        let first = &self.first;
        let (position, heading) = (first.position.powi(-2), first.heading.powi(-2));
        let information = Matrix3::from_diagonal(&Vector3::new(position, position, heading));
        let mut residual = state.poses[self.window.start] - first.pose;
        residual.z = wrap(residual.z);
        normal.diagonal[0] += information;
        normal.poses[0] -= information * residual;
        let mut cost = 0.5 * residual.dot(&(information * residual));
        let mut add = |row: &Row, residual: f64, deviation: f64| {
            let information = deviation.powi(-2);
            normal.corner += row * row.transpose() * information;
            normal.constants -= row * (residual * information);
            cost += 0.5 * residual * residual * information;
        };
        for name in Name::ALL {
            let k = name as usize;
            if self.priors.is_free(name) {
                let mut row = Row::zeros();
                row[k] = 1.0;
                add(
                    &row,
                    state.constants.values[k] - self.priors.means[k],
                    self.priors.deviations[k],
                );
            }
        }
        let (right, left) = (Name::Right as usize, Name::Left as usize);
        let is_free = self.priors.is_free(Name::Right) && self.priors.is_free(Name::Left);
        if is_free && self.priors.wheel_difference.is_finite() {
            let mut row = Row::zeros();
            (row[right], row[left]) = (1.0, -1.0);
            let difference = |values: &[f64; COUNT]| values[right] - values[left];
            let residual = difference(&state.constants.values) - difference(&self.priors.means);
            add(&row, residual, self.priors.wheel_difference);
        }
        cost
    }

    /// Removes the constants that are fixed: their step is zero.
    fn fix(&self, normal: &mut Normal) {
        for name in Name::ALL.into_iter().filter(|name| !self.priors.is_free(*name)) {
            let k = name as usize;
            for border in &mut normal.border {
                border.column_mut(k).fill(0.0);
            }
            normal.corner.row_mut(k).fill(0.0);
            normal.corner.column_mut(k).fill(0.0);
            normal.corner[(k, k)] = 1.0;
            normal.constants[k] = 0.0;
        }
    }
}

/// Huber's weight of a residual, and its share of the cost.
fn huber(residual: &Vector3<f64>, information: &Matrix3<f64>) -> (f64, f64) {
    let norm = residual.dot(&(information * residual)).max(0.0).sqrt();
    if norm <= HUBER {
        (1.0, 0.5 * norm * norm)
    } else {
        (HUBER / norm, HUBER * (norm - 0.5 * HUBER))
    }
}

/// The reference at a time, and its velocity; `None` outside, and in gaps of over a second.
///
/// A cubic B-spline with the rows as its control points. Linear interpolation would average the noise of two rows in the
/// middle between them and of none at a row, which attracts the lag to half a period; the spline averages alike everywhere.
fn interpolate(rows: &[ReferencePose], time: f64) -> Option<(Vector3<f64>, Vector3<f64>)> {
    const GAP: f64 = 1.0;
    let after = rows.partition_point(|row| row.time <= time);
    let four = rows.get(after.checked_sub(2)?..)?;
    let [before, one, next, last, ..] = four else { return None };
    let span = next.time - one.time;
    if last.time - before.time > 3.0 * GAP || span <= 0.0 {
        return None;
    }
    let f = (time - one.time) / span;
    let g = 1.0 - f;
    let weights = [
        g.powi(3) / 6.0,
        (4.0 - 6.0 * f * f + 3.0 * f.powi(3)) / 6.0,
        (4.0 - 6.0 * g * g + 3.0 * g.powi(3)) / 6.0,
        f.powi(3) / 6.0,
    ];
    let slopes = [-0.5 * g * g, -2.0 * f + 1.5 * f * f, 2.0 * g - 1.5 * g * g, 0.5 * f * f];
    let (mut pose, mut velocity) = (one.pose, Vector3::zeros());
    for (row, (weight, slope)) in [before, one, next, last].iter().zip(weights.iter().zip(slopes)) {
        let mut apart = row.pose - one.pose;
        apart.z = wrap(apart.z);
        pose += apart * *weight;
        velocity += apart * (slope / span);
    }
    Some((pose, velocity))
}

#[cfg(test)]
mod tests;
