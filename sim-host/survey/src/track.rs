//! The map in progress. For each pose the track predicts the pose, associates its pings with lines, solves a window of poses
//! behind it, and proposes new lines. Every two metres it associates and solves everything again.

#![expect(
    clippy::indexing_slicing,
    reason = "poses, covariances, matches and spans have the lengths that they were built with"
)]

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use sonarfix_batch::chain_of_poses::Chain;
use sonarfix_batch::odometry::{compose, integrate, wrap};
use sonarfix_batch::recording::Recording;

use crate::line::Span;
use crate::problem::{
    AHEAD, AXES, COUNT, DIFFERENCE, OFF_AXIS, Problem, RANGE_OFFSET, RANGE_SCALE, Robot, State,
    TRACK, Window, from_axis,
};
use crate::propose::{Sighting, propose};
use crate::solve::{covariance, solve};

/// Poses in the window that is solved at every pose.
const WINDOW: usize = 30;
/// Distance after which everything is solved, metres.
const WHOLE: f64 = 2.0;
/// Distance over which echoes without a line are kept, metres.
const KEPT: f64 = 4.0;
/// Distance between two proposals, metres.
const PROPOSE: f64 = 0.35;
/// Largest angle off the axis at which an echo is associated, radians.
const CONE: f64 = 0.4;
/// How far beyond the known part of a line an echo may come from, metres.
const BEYOND: f64 = 0.7;
/// Narrowest and widest gate of the association, metres.
const GATES: [f64; 2] = [0.03, 0.3];
/// Fewest earlier echoes of a line that is held in a window.
const FEWEST: usize = 6;
/// Share of the echoes that must agree on the axes of the building before they are used.
const AGREE: f64 = 0.65;
/// Largest gap between echoes of one wall, metres.
pub const GAP: f64 = 0.6;

/// Priors of the constants; the wheel difference is that of the attempt.
fn priors(difference: f64) -> [(f64, f64); COUNT] {
    let mut priors = [(0.0, 0.0); COUNT];
    priors[DIFFERENCE] = (difference, 0.006);
    priors[TRACK] = (0.0, 0.06);
    priors[RANGE_SCALE] = (0.0, 0.015);
    priors[RANGE_OFFSET] = (0.0, 0.003);
    priors[OFF_AXIS] = (0.01, 0.015);
    priors[AHEAD] = (0.0, 0.005);
    priors[AXES] = (0.0, 1.0);
    priors
}

/// The map in progress.
#[derive(Debug, Clone)]
pub struct Track<'a> {
    /// The problem, with the association.
    pub problem: Problem<'a>,
    /// Its state.
    pub state: State,
    /// Supported parts of each line.
    pub spans: Vec<Vec<Span>>,
    /// Number of poses that are estimated.
    pub known: usize,
    covariances: Vec<Matrix3<f64>>,
    solved_at: f64,
    proposed_at: f64,
    whole_priors: [(f64, f64); COUNT],
}

impl<'a> Track<'a> {
    /// A track at its first pose, with wheel difference and error of the track width to begin with.
    #[must_use]
    pub fn new(
        recording: &'a Recording,
        chain: &'a Chain,
        robot: Robot,
        start: Vector3<f64>,
        [difference, track]: [f64; 2],
    ) -> Self {
        let mut constants = [0.0; COUNT];
        constants[DIFFERENCE] = difference;
        constants[TRACK] = track;
        constants[OFF_AXIS] = 0.01;
        let whole_priors = priors(difference);
        let problem = Problem {
            recording,
            chain,
            robot,
            range_noise: 0.007,
            matches: vec![None; chain.pings.len()],
            priors: whole_priors,
            is_square: false,
            kernel: 4.0,
        };
        let first = Matrix3::from_diagonal(&Vector3::new(1e-6, 1e-6, 1e-6));
        Self {
            problem,
            state: State { poses: vec![start; chain.len()], constants, lines: Vec::new() },
            spans: Vec::new(),
            known: 1,
            covariances: vec![first; chain.len()],
            solved_at: 0.0,
            proposed_at: 0.0,
            whole_priors,
        }
    }

    /// Extends the map until a distance, metres.
    pub fn run(&mut self, until: f64) {
        let chain = self.problem.chain;
        while self.known < chain.len() && chain.distances[self.known] <= until {
            self.extend();
        }
    }

    /// The last rounds over everything.
    pub fn finish(&mut self) {
        for _ in 0..3 {
            self.solve_whole();
        }
    }

    fn extend(&mut self) {
        let k = self.known;
        let chain = self.problem.chain;
        let drive = self.state.drive(&self.problem.robot);
        let motion = integrate(&chain.edges[k - 1], &drive);
        let (mut pose, rotation) = compose(&self.state.poses[k - 1], &motion.pose);
        pose.z = wrap(pose.z);
        let moved = pose - self.state.poses[k - 1];
        self.state.poses[k] = pose;
        let mut carry = Matrix3::identity();
        (carry[(0, 2)], carry[(1, 2)]) = (-moved.y, moved.x);
        let spread = self.problem.priors;
        let by = rotation * motion.by_drive;
        let of_difference = (by.column(0) - by.column(1)) * (0.5 * spread[DIFFERENCE].1);
        let of_track = by.column(2) * spread[TRACK].1;
        self.covariances[k] = carry * self.covariances[k - 1] * carry.transpose()
            + rotation
                * motion.noise.covariance(self.problem.robot.wheel_noise)
                * rotation.transpose()
            + of_difference * of_difference.transpose()
            + of_track * of_track.transpose();
        self.known = k + 1;
        self.solve_window();
        let driven = chain.distances[k];
        if driven - self.proposed_at >= PROPOSE {
            self.proposed_at = driven;
            self.propose();
        }
        if driven - self.solved_at >= WHOLE {
            self.solve_whole();
            self.solved_at = driven;
        }
    }

    /// The pings of some poses; those after the last pose of the range are not included.
    fn pings(&self, poses: &Range<usize>) -> Range<usize> {
        let pings = &self.problem.chain.pings;
        let before = |pose: usize| pings.partition_point(|event| event.pose < pose);
        before(poses.start)..before(poses.end.saturating_sub(1))
    }

    pub(crate) fn window(&self, poses: Range<usize>) -> Window {
        let mut first = self.covariances[poses.start];
        if poses.start > 0 {
            // What the window itself has contributed to it counts twice.
            first *= 2.0;
            first += Matrix3::from_diagonal(&Vector3::new(2.5e-5, 2.5e-5, 2.5e-5));
        }
        let pings = self.pings(&poses);
        Window { first: (self.state.poses[poses.start], first), poses, pings, holds: Vec::new() }
    }

    /// The window of everything.
    #[must_use]
    pub fn whole(&self) -> Window {
        self.window(0..self.known)
    }

    fn solve_window(&mut self) {
        let from = self.known.saturating_sub(WINDOW);
        let mut window = self.window(from..self.known);
        window.holds = self.holds(&window.pings);
        let priors = self.problem.priors;
        if from > 0 {
            // Other constants would contradict the travel before the window.
            self.problem.priors = [(0.0, 0.0); COUNT];
        }
        for kernel in [10.0, 4.0] {
            let recent = self.known.saturating_sub(8)..self.known;
            self.associate(self.pings(&recent));
            self.problem.kernel = kernel;
            solve(&self.problem, &mut self.state, &window, 3);
        }
        let covariance = covariance(&self.problem, &self.state, &window);
        self.problem.priors = priors;
        if let Ok((covariance, _)) = covariance {
            self.covariances[self.known - 1] = covariance.poses[covariance.poses.len() - 1];
        }
    }

    /// Lines that earlier pings have determined are held at the ends of their known parts.
    fn holds(&self, pings: &Range<usize>) -> Vec<(usize, nalgebra::Vector2<f64>, f64)> {
        const HELD: f64 = 0.008;
        let mut earlier = vec![0_usize; self.state.lines.len()];
        for line in self.problem.matches[..pings.start].iter().flatten() {
            earlier[*line] += 1;
        }
        let mut holds = Vec::new();
        for (index, line) in self.state.lines.iter().enumerate() {
            let ends = self.spans[index].first().zip(self.spans[index].last());
            if let Some((first, last)) = ends.filter(|_| earlier[index] >= FEWEST) {
                // Apart at least, so that a short line keeps its direction loosely.
                let (from, to) = (first.from.min(last.to - 0.3), last.to.max(first.from + 0.3));
                holds.push((index, line.point(from), HELD));
                holds.push((index, line.point(to), HELD));
            }
        }
        holds
    }

    fn associate(&mut self, pings: Range<usize>) {
        for k in pings {
            self.problem.matches[k] = self.association(k);
        }
    }

    /// The line whose expected range is nearest to that of a ping, within four deviations.
    fn association(&self, k: usize) -> Option<usize> {
        let problem = &self.problem;
        let event = &problem.chain.pings[k];
        let range = problem.recording.pings[event.index].range?;
        let sonar = problem.sonar(&self.state, event);
        let covariance = self.covariances[event.pose].fixed_view::<2, 2>(0, 0).into_owned();
        let mut best: Option<(usize, f64)> = None;
        for (index, line) in self.state.lines.iter().enumerate() {
            let distance = line.distance(&sonar.at);
            if distance <= 0.02 || line.off_axis(sonar.direction).abs() > CONE {
                continue;
            }
            let along = line.along(&sonar.at);
            if !self.spans[index].iter().any(|span| span.has(along, BEYOND)) {
                continue;
            }
            let error = (problem.expected(&self.state, &sonar, line) - range).abs();
            let normal = line.normal();
            let variance = normal.dot(&(covariance * normal)) + problem.range_noise.powi(2);
            let gate = (4.0 * variance.sqrt()).clamp(GATES[0], GATES[1]);
            if error <= gate && best.is_none_or(|(_, least)| error < least) {
                best = Some((index, error));
            }
        }
        best.map(|(index, _)| index)
    }

    /// Adds lines for the echoes of the last metres that have none.
    fn propose(&mut self) {
        let chain = self.problem.chain;
        let here = chain.distances[self.known - 1];
        for _ in 0..3 {
            let mut sightings = Vec::new();
            let all = self.pings(&(0..self.known));
            for k in all.rev() {
                let event = &chain.pings[k];
                if chain.distances[event.pose] < here - KEPT {
                    break;
                }
                if self.problem.matches[k].is_none() {
                    sightings.extend(self.sighting(k));
                }
            }
            let axes = self.problem.is_square.then(|| self.state.constants[AXES]);
            let found = propose(&sightings, self.problem.range_noise, axes);
            let Some((line, pings)) = found else { break };
            let index = self.state.lines.len();
            self.state.lines.push(line);
            self.spans.push(Vec::new());
            for ping in pings {
                self.problem.matches[ping] = Some(index);
            }
            self.measure_spans();
            self.solve_window();
        }
    }

    /// The supported parts of each line, from its echoes.
    pub(crate) fn measure_spans(&mut self) {
        let mut feet: Vec<Vec<f64>> = vec![Vec::new(); self.state.lines.len()];
        for (k, line) in self.problem.matches.iter().enumerate() {
            if let Some(line) = *line {
                let sonar = self.problem.sonar(&self.state, &self.problem.chain.pings[k]);
                let at = &self.state.lines[line];
                let range = self.problem.recording.pings[self.problem.chain.pings[k].index].range;
                let expected = self.problem.expected(&self.state, &sonar, at);
                if range.is_some_and(|range| {
                    (range - expected).abs() <= 0.01 + 3.0 * self.problem.range_noise
                }) {
                    feet[line].push(at.along(&sonar.at));
                }
            }
        }
        self.spans = feet.into_iter().map(|feet| clusters(feet, GAP)).collect();
    }

    /// Associates and solves everything, and removes lines that the pings contradict.
    pub fn solve_whole(&mut self) {
        self.problem.priors = self.whole_priors;
        let window = self.window(0..self.known);
        self.find_axes();
        for kernel in [8.0, 4.0] {
            self.measure_spans();
            self.associate(window.pings.clone());
            self.problem.kernel = kernel;
            solve(&self.problem, &mut self.state, &window, 8);
        }
        self.measure_spans();
        self.remove_refuted();
        self.merge();
        solve(&self.problem, &mut self.state, &window, 3);
        self.measure_spans();
        self.fit_noise();
        if let Ok((covariance, _)) = covariance(&self.problem, &self.state, &window) {
            self.covariances[..self.known].copy_from_slice(&covariance.poses);
            for k in 0..COUNT {
                let deviation = covariance.constants[(k, k)].max(1e-12).sqrt();
                self.problem.priors[k] = (self.state.constants[k], 1.5 * deviation);
            }
        }
    }

    fn fit_noise(&mut self) {
        let problem = &self.problem;
        let mut residuals: Vec<f64> = Vec::new();
        for (k, line) in problem.matches.iter().enumerate() {
            let event = &problem.chain.pings[k];
            if let Some((line, range)) = line.zip(problem.recording.pings[event.index].range) {
                let sonar = problem.sonar(&self.state, event);
                let expected = problem.expected(&self.state, &sonar, &self.state.lines[line]);
                residuals.push((expected - range).abs());
            }
        }
        residuals.sort_by(f64::total_cmp);
        if residuals.len() > 30 {
            let median = residuals[residuals.len() / 2];
            self.problem.range_noise = (1.6 * median).clamp(0.005, 0.015);
        }
    }

    /// The axes of the building, if most echoes come from walls along them.
    fn find_axes(&mut self) {
        let mut weights = vec![0.0; self.state.lines.len()];
        for line in self.problem.matches.iter().flatten() {
            weights[*line] += 1.0;
        }
        let total: f64 = weights.iter().sum();
        let near = |axes: f64| -> f64 {
            let lines = self.state.lines.iter().zip(&weights);
            let agreeing = lines.filter(|(line, _)| from_axis(line.angle - axes).abs() < 0.06);
            agreeing.map(|(_, weight)| weight).sum()
        };
        let best = self.state.lines.iter().map(|line| (near(line.angle), line.angle));
        let best = best.max_by(|one, other| one.0.total_cmp(&other.0));
        let was_square = self.problem.is_square;
        self.problem.is_square =
            self.state.lines.len() >= 2 && best.is_some_and(|(share, _)| share >= AGREE * total);
        if let Some((_, angle)) = best.filter(|_| self.problem.is_square && !was_square) {
            self.state.constants[AXES] = from_axis(angle);
        }
    }

    /// An echo at its estimated place.
    #[must_use]
    pub fn sighting(&self, k: usize) -> Option<Sighting> {
        let problem = &self.problem;
        let event = &problem.chain.pings[k];
        let range = problem.recording.pings[event.index].range?;
        let sonar = problem.sonar(&self.state, event);
        let (at, direction) = (sonar.at, sonar.direction);
        let distance = problem.distance(&self.state, range);
        Some(Sighting { ping: k, pose: event.pose, at, direction, distance })
    }

    /// The cost of the state with the priors of the whole recording.
    #[must_use]
    pub fn cost(&self) -> f64 {
        let mut problem = self.problem.clone();
        problem.priors = self.whole_priors;
        problem.linearize(&self.state, &self.window(0..self.known)).1
    }

    /// Log-likelihood of the map so far against that of echoes from nowhere, with a penalty for each line.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "numbers of echoes and lines")]
    pub fn score(&self) -> f64 {
        4.0 * self.explained().0 as f64 - self.cost() - 12.0 * self.state.lines.len() as f64
    }

    /// Numbers of echoes that fit their line, and of all echoes so far.
    #[must_use]
    pub fn explained(&self) -> (usize, usize) {
        let problem = &self.problem;
        let (mut fitting, mut all) = (0, 0);
        for k in self.pings(&(0..self.known)) {
            let event = &problem.chain.pings[k];
            let Some(range) = problem.recording.pings[event.index].range else { continue };
            all += 1;
            if let Some(line) = problem.matches[k] {
                let sonar = problem.sonar(&self.state, event);
                let expected = problem.expected(&self.state, &sonar, &self.state.lines[line]);
                fitting += usize::from((expected - range).abs() <= 0.012);
            }
        }
        (fitting, all)
    }
}

/// Clusters of positions with gaps of at most `gap`.
#[must_use]
pub fn clusters(mut feet: Vec<f64>, gap: f64) -> Vec<Span> {
    feet.sort_by(f64::total_cmp);
    let mut spans: Vec<Span> = Vec::new();
    for at in feet {
        match spans.last_mut() {
            Some(span) if at - span.to <= gap => span.to = at,
            _ => spans.push(Span { from: at, to: at }),
        }
    }
    spans
}
