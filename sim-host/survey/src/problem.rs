//! The least-squares problem: poses, lines and constants; residuals of wheel travel and ranges, and their derivatives.

#![expect(
    clippy::indexing_slicing,
    reason = "poses, matches and columns have the lengths that the problem was built with"
)]

use std::ops::Range;

use nalgebra::{Matrix3, Matrix3x2, Vector2, Vector3};
use sonarfix_batch::calibration::Nominal;
use sonarfix_batch::chain::Normal;
use sonarfix_batch::chain_of_poses::{Chain, Event};
use sonarfix_batch::odometry::{Drive, Edge, WheelNoise, compose, integrate, wrap};
use sonarfix_batch::recording::Recording;

use crate::line::Line;

/// Number of constants.
pub const COUNT: usize = 7;
/// Scale of the right wheel minus that of the left one. Their mean is fixed.
pub const DIFFERENCE: usize = 0;
/// Relative error of the track width.
pub const TRACK: usize = 1;
/// Scale error of the ranger, relative to the wheels.
pub const RANGE_SCALE: usize = 2;
/// Constant error of a range, metres.
pub const RANGE_OFFSET: usize = 3;
/// Growth of a range with the angle off the axis, metres per radian.
pub const OFF_AXIS: usize = 4;
/// Position of the sonar ahead of the robot file's, metres.
pub const AHEAD: usize = 5;
/// Direction of the building's axes, radians.
pub const AXES: usize = 6;

/// Noise of an edge that does not come from the wheels, metres and radians.
const EDGE_FLOOR: [f64; 3] = [2e-4, 2e-4, 5e-4];
/// Normalized edge residual beyond which it counts linearly (Huber), for slips.
const HUBER: f64 = 4.0;
/// Standard deviation of a wall's direction from the building's axes, radians.
const SQUARE: f64 = 0.004;
/// Angle at which the prior of the axes loses three quarters of its weight, radians.
const SQUARE_KERNEL: f64 = 0.02;

/// Geometry and noise of the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robot {
    /// Nominal track width, metres.
    pub track_width: f64,
    /// Nominal position of the sonar: ahead, left, metres.
    pub mount: [f64; 2],
    /// Noise of the wheels' travel.
    pub wheel_noise: WheelNoise,
    /// Shortest and longest range, metres.
    pub reach: [f64; 2],
}

impl Robot {
    /// That of a robot file.
    #[must_use]
    pub fn of(nominal: &Nominal) -> Self {
        let Nominal { track_width, mount, reach, noise, .. } = *nominal;
        Self { track_width, mount, wheel_noise: noise.wheel, reach }
    }
}

/// Unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The poses of the chain.
    pub poses: Vec<Vector3<f64>>,
    /// The constants.
    pub constants: [f64; COUNT],
    /// The lines.
    pub lines: Vec<Line>,
}

impl State {
    /// The errors of the drive.
    #[must_use]
    pub fn drive(&self, robot: &Robot) -> Drive {
        let half = 0.5 * self.constants[DIFFERENCE];
        let track = self.constants[TRACK];
        Drive { track_width: robot.track_width, right: half, left: -half, track }
    }
}

/// Position and direction of the sonar at a ping, with the derivatives of the position.
#[derive(Debug, Clone, Copy)]
pub struct Sonar {
    /// Position.
    pub at: Vector2<f64>,
    /// Direction of its axis, radians.
    pub direction: f64,
    /// Derivative of the position by the heading of the pose before the ping.
    pub by_heading: Vector2<f64>,
    /// Derivatives by wheel difference, track width and mount.
    pub by: [Vector2<f64>; 3],
    /// Derivatives of the direction by wheel difference and track width.
    pub direction_by: [f64; 2],
}

/// A point that a line is held to: line, point, standard deviation of its distance.
pub type Hold = (usize, Vector2<f64>, f64);

/// The problem.
#[derive(Debug, Clone)]
pub struct Problem<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// Its poses.
    pub chain: &'a Chain,
    /// The robot.
    pub robot: Robot,
    /// Standard deviation of a range, metres.
    pub range_noise: f64,
    /// The line of each ping.
    pub matches: Vec<Option<usize>>,
    /// Means and standard deviations of the constants; a deviation of zero fixes one.
    pub priors: [(f64, f64); COUNT],
    /// Whether the lines are parallel or perpendicular to the building's axes, apart from single ones.
    pub is_square: bool,
    /// Number of deviations at which a range loses three quarters of its weight (Geman–McClure).
    pub kernel: f64,
}

/// Which part is estimated.
#[derive(Debug, Clone)]
pub struct Window {
    /// The poses.
    pub poses: Range<usize>,
    /// Prior of the first pose: mean and covariance.
    pub first: (Vector3<f64>, Matrix3<f64>),
    /// The pings of these poses, as indices into the chain.
    pub pings: Range<usize>,
    /// Priors of lines.
    pub holds: Vec<Hold>,
}

/// Residual of a range and its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct RangeTerm {
    /// Expected minus measured, metres.
    pub residual: f64,
    /// Derivatives by the pose before the ping.
    pub by_pose: Vector3<f64>,
    /// Derivatives by the constants.
    pub by_constants: [f64; COUNT],
    /// Derivatives by angle and offset of the line.
    pub by_line: [f64; 2],
}

impl Problem<'_> {
    /// The sonar at an event.
    #[must_use]
    pub fn sonar(&self, state: &State, event: &Event) -> Sonar {
        let from = &state.poses[event.pose];
        let motion = integrate(&event.steps, &state.drive(&self.robot));
        let (pose, rotation) = compose(from, &motion.pose);
        let (sin, cos) = pose.z.sin_cos();
        let [ahead, left] = self.robot.mount;
        let ahead = ahead + state.constants[AHEAD];
        let arm = Vector2::new(cos * ahead - sin * left, sin * ahead + cos * left);
        let at = pose.xy() + arm;
        let lever = Vector2::new(-arm.y, arm.x);
        let carried = |column: usize| {
            let by = rotation * motion.by_drive.column(column);
            by.xy() + lever * by.z
        };
        let relative = at - from.xy();
        Sonar {
            at,
            direction: pose.z + self.recording.pings[event.index].bearing,
            by_heading: Vector2::new(-relative.y, relative.x),
            by: [(carried(0) - carried(1)) * 0.5, carried(2), Vector2::new(cos, sin)],
            direction_by: [
                (motion.by_drive[(2, 0)] - motion.by_drive[(2, 1)]) * 0.5,
                motion.by_drive[(2, 2)],
            ],
        }
    }

    /// The range that a line would return to a sonar.
    #[must_use]
    pub fn expected(&self, state: &State, sonar: &Sonar, line: &Line) -> f64 {
        let constants = &state.constants;
        (1.0 + constants[RANGE_SCALE]) * line.distance(&sonar.at)
            + constants[RANGE_OFFSET]
            + constants[OFF_AXIS] * smooth(line.off_axis(sonar.direction)).0
    }

    /// The distance that a range stands for, without the off-axis bias.
    #[must_use]
    pub fn distance(&self, state: &State, range: f64) -> f64 {
        (range - state.constants[RANGE_OFFSET]) / (1.0 + state.constants[RANGE_SCALE])
    }

    /// The term of a range with a line.
    #[must_use]
    pub fn range_term(&self, state: &State, sonar: &Sonar, range: f64, line: &Line) -> RangeTerm {
        let stretch = 1.0 + state.constants[RANGE_SCALE];
        let normal = line.normal();
        let by_point = |by: &Vector2<f64>| -stretch * normal.dot(by);
        let [difference, track, ahead] = &sonar.by;
        let (off_axis, slope) = smooth(line.off_axis(sonar.direction));
        let by_direction = state.constants[OFF_AXIS] * slope;
        let [turn_by_difference, turn_by_track] = sonar.direction_by;
        let mut by_constants = [0.0; COUNT];
        by_constants[DIFFERENCE] = by_point(difference) + by_direction * turn_by_difference;
        by_constants[TRACK] = by_point(track) + by_direction * turn_by_track;
        by_constants[AHEAD] = by_point(ahead);
        by_constants[RANGE_SCALE] = line.distance(&sonar.at);
        by_constants[RANGE_OFFSET] = 1.0;
        by_constants[OFF_AXIS] = off_axis;
        RangeTerm {
            residual: self.expected(state, sonar, line) - range,
            by_pose: Vector3::new(
                -stretch * normal.x,
                -stretch * normal.y,
                by_point(&sonar.by_heading) + by_direction,
            ),
            by_constants,
            by_line: [-stretch * line.along(&sonar.at) - by_direction, stretch],
        }
    }

    /// The normal equations of a window at a state, the cost there, and the lines in the order of their columns.
    #[must_use]
    pub fn linearize(&self, state: &State, window: &Window) -> (Normal, f64, Vec<usize>) {
        let mut columns = vec![usize::MAX; state.lines.len()];
        let mut lines = Vec::new();
        let matched = self.matches[window.pings.clone()].iter().flatten().copied();
        for line in matched.chain(window.holds.iter().map(|hold| hold.0)) {
            if columns[line] == usize::MAX {
                columns[line] = COUNT + 2 * lines.len();
                lines.push(line);
            }
        }
        let mut system = System {
            normal: Normal::new(window.poses.len(), COUNT + 2 * lines.len()),
            cost: 0.0,
            start: window.poses.start,
        };
        self.add_priors(state, window, &mut system);
        for i in window.poses.start..window.poses.end.saturating_sub(1) {
            self.add_edge(state, i, &mut system);
        }
        for k in window.pings.clone() {
            if let Some(line) = self.matches[k] {
                self.add_range(state, k, line, columns[line], &mut system);
            }
        }
        for &(line, point, deviation) in &window.holds {
            let at = &state.lines[line];
            let residual = at.offset - at.normal().dot(&point);
            let row = [-at.along(&point), 1.0];
            system.add_line(columns[line], row, residual, deviation.powi(-2));
        }
        if self.is_square {
            for &line in &lines {
                system.add_square(columns[line], state.lines[line].angle - state.constants[AXES]);
            }
        }
        system.fix(&self.priors);
        // A line without enough pings has a direction all the same.
        for k in COUNT..system.normal.corner.nrows() {
            system.normal.corner[(k, k)] += 1e-6;
        }
        (system.normal, system.cost, lines)
    }

    fn add_priors(&self, state: &State, window: &Window, system: &mut System) {
        let (mean, covariance) = &window.first;
        let mut residual = state.poses[window.poses.start] - mean;
        residual.z = wrap(residual.z);
        if let Some(factor) = covariance.cholesky() {
            let information = factor.inverse();
            system.normal.diagonal[0] += information;
            system.normal.poses[0] -= information * residual;
            system.cost += 0.5 * residual.dot(&(information * residual));
        }
        for (k, &(mean, deviation)) in self.priors.iter().enumerate() {
            if deviation > 0.0 {
                let (information, residual) = (deviation.powi(-2), state.constants[k] - mean);
                system.normal.corner[(k, k)] += information;
                system.normal.constants[k] -= information * residual;
                system.cost += 0.5 * information * residual * residual;
            }
        }
    }

    fn add_edge(&self, state: &State, i: usize, system: &mut System) {
        let motion = integrate(&self.chain.edges[i], &state.drive(&self.robot));
        let poses = [&state.poses[i], &state.poses[i + 1]];
        let Some(edge) = motion.between(poses, self.robot.wheel_noise, EDGE_FLOOR) else { return };
        let by_drive = &motion.by_drive;
        let by = Matrix3x2::from_columns(&[
            (by_drive.column(1) - by_drive.column(0)) * 0.5,
            -by_drive.column(2),
        ]);
        system.add_edge(i, &edge, &by);
    }

    fn add_range(&self, state: &State, k: usize, line: usize, column: usize, system: &mut System) {
        let event = &self.chain.pings[k];
        let Some(range) = self.recording.pings[event.index].range else { return };
        let sonar = self.sonar(state, event);
        let term = self.range_term(state, &sonar, range, &state.lines[line]);
        let square = (term.residual / self.range_noise).powi(2);
        let limit = self.kernel.powi(2);
        let share = limit / (limit + square);
        system.cost += 0.5 * square * share;
        system.add_range(event.pose, column, &term, share * share / self.range_noise.powi(2));
    }
}

/// The equations in progress.
struct System {
    normal: Normal,
    cost: f64,
    start: usize,
}

impl System {
    fn add_edge(&mut self, at: usize, edge: &Edge, by: &Matrix3x2<f64>) {
        let Edge { residual, information, by_from, by_to } = edge;
        let norm = residual.dot(&(information * residual)).max(0.0).sqrt();
        let weight = if norm <= HUBER { 1.0 } else { HUBER / norm };
        self.cost += if norm <= HUBER { 0.5 * norm * norm } else { HUBER * (norm - 0.5 * HUBER) };
        let information = information * weight;
        let i = at - self.start;
        let (from, to) = (by_from.transpose() * information, by_to.transpose() * information);
        let constants = by.transpose() * information;
        let normal = &mut self.normal;
        normal.diagonal[i] += from * by_from;
        normal.diagonal[i + 1] += to * by_to;
        normal.beside[i] += from * by_to;
        let mut add = |i: usize, block: Matrix3x2<f64>| {
            let mut border = normal.border[i].fixed_columns_mut::<2>(0);
            border += block;
        };
        add(i, from * by);
        add(i + 1, to * by);
        let mut corner = normal.corner.fixed_view_mut::<2, 2>(0, 0);
        corner += constants * by;
        normal.poses[i] -= from * residual;
        normal.poses[i + 1] -= to * residual;
        let mut rhs = normal.constants.fixed_rows_mut::<2>(0);
        rhs -= constants * residual;
    }

    /// Adds a range; only the columns of the constants and of its line change.
    fn add_range(&mut self, pose: usize, column: usize, term: &RangeTerm, information: f64) {
        let i = pose - self.start;
        let [by_angle, by_offset] = term.by_line;
        let mut row = [(0, 0.0); COUNT + 2];
        for (k, slot) in row.iter_mut().enumerate() {
            *slot = match k {
                k if k < COUNT => (k, term.by_constants[k]),
                COUNT => (column, by_angle),
                _ => (column + 1, by_offset),
            };
        }
        let normal = &mut self.normal;
        normal.diagonal[i] += term.by_pose * term.by_pose.transpose() * information;
        normal.poses[i] -= term.by_pose * (information * term.residual);
        for &(k, by) in &row {
            let mut border = normal.border[i].column_mut(k);
            border += term.by_pose * (by * information);
            normal.constants[k] -= by * information * term.residual;
            for &(l, other) in &row {
                normal.corner[(k, l)] += by * other * information;
            }
        }
    }

    fn add_line(&mut self, column: usize, row: [f64; 2], residual: f64, information: f64) {
        self.cost += 0.5 * information * residual * residual;
        for (k, by) in row.iter().enumerate() {
            self.normal.constants[column + k] -= by * information * residual;
            for (l, other) in row.iter().enumerate() {
                self.normal.corner[(column + k, column + l)] += by * other * information;
            }
        }
    }

    /// The prior of right angles, with a loss that forgets slanted walls.
    fn add_square(&mut self, column: usize, angle: f64) {
        let residual = from_axis(angle);
        let share = 1.0 / (1.0 + (residual / SQUARE_KERNEL).powi(2));
        let information = share * share / SQUARE.powi(2);
        self.cost += 0.5 * residual * residual * share / SQUARE.powi(2);
        let normal = &mut self.normal;
        normal.corner[(column, column)] += information;
        normal.corner[(AXES, AXES)] += information;
        normal.corner[(column, AXES)] -= information;
        normal.corner[(AXES, column)] -= information;
        normal.constants[column] -= information * residual;
        normal.constants[AXES] += information * residual;
    }

    /// Removes the constants that are fixed: their step is zero.
    fn fix(&mut self, priors: &[(f64, f64); COUNT]) {
        for (k, _) in priors.iter().enumerate().filter(|(_, prior)| prior.1 <= 0.0) {
            for border in &mut self.normal.border {
                border.column_mut(k).fill(0.0);
            }
            self.normal.corner.row_mut(k).fill(0.0);
            self.normal.corner.column_mut(k).fill(0.0);
            self.normal.corner[(k, k)] = 1.0;
            self.normal.constants[k] = 0.0;
        }
    }
}

/// The magnitude of an angle, rounded off within about 2°, and its derivative.
fn smooth(angle: f64) -> (f64, f64) {
    const ROUND: f64 = 0.03;
    let size = angle.hypot(ROUND);
    (size - ROUND, angle / size)
}

/// An angle relative to the nearest multiple of 90°.
#[must_use]
pub fn from_axis(angle: f64) -> f64 {
    use std::f64::consts::FRAC_PI_2;
    angle - (angle / FRAC_PI_2).round() * FRAC_PI_2
}

#[cfg(test)]
mod tests;
