//! The chain of poses of a recording: a pose every few centimetres, the wheel travel between them, and the pings that
//! belong to each.

#![expect(clippy::indexing_slicing, reason = "the edges' times have the length of the edges")]

use std::ops::Range;

use crate::odometry::{Travel, noisy_distances};
use crate::recording::{Ping, Reading, Recording, RecordingError, StartPose};

/// Distance over which the mean speed of the wheels is formed, metres: the length of a block.
const STEADY: f64 = 0.1;

/// When a new pose begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spacing {
    /// After this travel, metres.
    pub travel: f64,
    /// After this difference of the wheels' travel, metres.
    pub turn: f64,
    /// At each echo, too. Otherwise the noise of the wheels between a pose and an echo counts as noise of the range.
    pub at_echoes: bool,
}

impl Spacing {
    /// That of a calibration; the turn is about 10° of a small robot.
    pub const CALIBRATION: Self = Self { travel: 0.05, turn: 0.02, at_echoes: false };
    /// The same with a pose at each echo.
    pub const AT_ECHOES: Self = Self { at_echoes: true, ..Self::CALIBRATION };
}

/// Something that happened at a time between two poses.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Its index in the recording.
    pub index: usize,
    /// The pose at or before it.
    pub pose: usize,
    /// Wheel travel since then.
    pub steps: Vec<Travel>,
}

/// The chain.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chain {
    /// Time of each pose, seconds.
    pub times: Vec<f64>,
    /// Wheel travel from each pose to the next.
    pub edges: Vec<Vec<Travel>>,
    /// For each edge, the distances that both wheels roll at their mean speed in its block, as multiples of those measured.
    pub steadiness: Vec<[f64; 2]>,
    /// The pings between start and end.
    pub pings: Vec<Event>,
    /// Mean of the distances that both wheels have rolled until each pose, metres.
    pub distances: Vec<f64>,
    /// Sum of the differences between the wheels' distances until each pose, without sign, metres.
    pub turns: Vec<f64>,
}

impl Chain {
    /// The chain of a recording from its start on; without a start, from the first pose of the reference.
    ///
    /// # Errors
    /// [`RecordingError`] of the first defect.
    pub fn of(
        recording: &Recording,
        spacing: Spacing,
    ) -> Result<(Self, StartPose), RecordingError> {
        recording.check()?;
        let start = match (recording.start, recording.references.first()) {
            (Some(start), _) => start,
            (None, Some(first)) => {
                StartPose { time: first.time, pose: first.pose, position: 0.1, heading: 0.1 }
            }
            (None, None) => return Err(RecordingError::NoStart),
        };
        let chain = Self::build(recording, start.time, spacing).ok_or(RecordingError::NoTravel)?;
        Ok((chain, start))
    }

    /// The chain from a time on; `None` with fewer than two readings.
    #[must_use]
    pub fn build(recording: &Recording, from: f64, spacing: Spacing) -> Option<Self> {
        let readings = &recording.readings;
        let first = readings.partition_point(|reading| reading.time < from);
        let readings = readings.get(first..)?;
        let (begin, end) = (readings.first()?, readings.last()?);
        if readings.len() < 2 {
            return None;
        }
        let mut pings = recording.pings.iter().enumerate().peekable();
        while pings.next_if(|(_, ping)| ping.time < begin.time).is_some() {}
        let mut builder = Builder::new(begin.time, spacing);
        for (one, next) in readings.iter().zip(readings.iter().skip(1)) {
            let mut passed = 0.0;
            while let Some((index, ping)) = pings.next_if(|(_, ping)| ping.time < next.time) {
                let share = (ping.time - one.time) / (next.time - one.time);
                builder.roll([one, next], share - passed);
                passed = share;
                builder.ping(index, ping);
            }
            builder.roll([one, next], 1.0 - passed);
            builder.read(next.time, next.time >= end.time);
        }
        let Builder { mut chain, moving, .. } = builder;
        chain.steadiness = steadiness(&chain.edges, &moving);
        Some(chain)
    }

    /// Number of poses.
    #[must_use]
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether it has no pose, which a built chain never is.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }
}

/// A chain that grows.
struct Builder {
    chain: Chain,
    spacing: Spacing,
    /// Travel since the last pose.
    steps: Vec<Travel>,
    distance: f64,
    turns: f64,
    /// Of each edge, and of the one that grows, the time in which the robot moves, seconds.
    moving: Vec<f64>,
}

impl Builder {
    fn new(begin: f64, spacing: Spacing) -> Self {
        let chain = Chain {
            times: vec![begin],
            distances: vec![0.0],
            turns: vec![0.0],
            ..Chain::default()
        };
        Self { chain, spacing, steps: Vec::new(), distance: 0.0, turns: 0.0, moving: vec![0.0] }
    }

    /// The wheels roll a share of the travel between two readings.
    fn roll(&mut self, [one, next]: [&Reading; 2], share: f64) {
        let step = travel(one, next, share);
        push(&mut self.steps, step);
        let [right, left] = step;
        if right.abs() + left.abs() > 0.0
            && let Some(moving) = self.moving.last_mut()
        {
            *moving += share * (next.time - one.time);
        }
        self.distance += f64::midpoint(right.abs(), left.abs());
        self.turns += (right - left).abs();
    }

    /// A ping here.
    fn ping(&mut self, index: usize, ping: &Ping) {
        if self.spacing.at_echoes && ping.range.is_some() && !self.steps.is_empty() {
            self.end_edge(ping.time);
        }
        let pose = self.chain.times.len() - 1;
        self.chain.pings.push(Event { index, pose, steps: self.steps.clone() });
    }

    /// A reading of the encoders here: a new pose if it is far from the last, or the end of the recording.
    fn read(&mut self, time: f64, is_last: bool) {
        let sum = |of: fn(&Travel) -> f64| self.steps.iter().map(of).sum::<f64>().abs();
        let is_long = sum(|[right, left]| f64::midpoint(*right, *left)) >= self.spacing.travel;
        let has_turned = sum(|[right, left]| right - left) >= self.spacing.turn;
        if is_long || has_turned || (is_last && !self.steps.is_empty()) {
            self.end_edge(time);
        }
    }

    fn end_edge(&mut self, time: f64) {
        self.chain.edges.push(std::mem::take(&mut self.steps));
        self.moving.push(0.0);
        self.chain.times.push(time);
        self.chain.distances.push(self.distance);
        self.chain.turns.push(self.turns);
    }
}

/// See [`Chain::steadiness`]. The variance of an edge must not depend on its own noise: edges whose wheels measure too little would
/// count more, and scales and track width would be biased. As in a generalized linear model, it is that of the expected distance
/// (Wedderburn, *Biometrika* 61, 1974): that at the mean speed in its block of edges. Blocks do not overlap, so that the expected distances
/// have the sum of the measured ones.
fn steadiness(edges: &[Vec<Travel>], moving: &[f64]) -> Vec<[f64; 2]> {
    // Of the sum, because the magnitudes of short steps would have the mean of their noise, too.
    let rolled: Vec<Travel> =
        edges.iter().map(|steps| sum(steps, |step| step).map(f64::abs)).collect();
    let mut by = Vec::with_capacity(edges.len());
    while by.len() < edges.len() {
        let block = block(&rolled, by.len());
        let distances = sum(&rolled[block.clone()], |distance| distance);
        let seconds: f64 = moving[block.clone()].iter().sum();
        by.extend(block.map(|i| {
            let share = if seconds > 0.0 { moving[i] / seconds } else { 0.0 };
            let expected = noisy_distances(distances.map(|distance| distance * share));
            let measured = noisy_distances(sum(&edges[i], f64::abs));
            let ratio = |k: usize| if measured[k] > 0.0 { expected[k] / measured[k] } else { 1.0 };
            [ratio(0), ratio(1)]
        }));
    }
    by
}

/// The edges from one on in which both wheels roll [`STEADY`] in the mean, or the rest.
fn block(rolled: &[Travel], from: usize) -> Range<usize> {
    let mut distance = 0.0;
    let reached = rolled[from..].iter().position(|[right, left]| {
        distance += f64::midpoint(*right, *left);
        distance >= STEADY
    });
    from..reached.map_or(rolled.len(), |last| from + last + 1)
}

/// The sums of a function of the travel of each wheel.
fn sum(steps: &[Travel], of: fn(f64) -> f64) -> [f64; 2] {
    steps.iter().fold([0.0, 0.0], |sums, step| [sums[0] + of(step[0]), sums[1] + of(step[1])])
}

fn travel(one: &Reading, next: &Reading, share: f64) -> Travel {
    let [r0, l0] = one.travel;
    let [r1, l1] = next.travel;
    [(r1 - r0) * share, (l1 - l0) * share]
}

/// Appends a step, unless the robot stands.
fn push(steps: &mut Vec<Travel>, step: Travel) {
    let [right, left] = step;
    if right.abs() + left.abs() > 0.0 {
        steps.push(step);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wheels at a steady speed that measure more and less in turns: each edge has the variance of the same distance.
    #[test]
    fn the_expected_distance_does_not_depend_on_the_noise_of_an_edge() {
        let edges: Vec<Vec<Travel>> = (0..60)
            .map(|n| vec![if n % 2 == 0 { [0.012, -0.008] } else { [0.008, -0.012] }])
            .collect();
        let moving = vec![0.1; edges.len()];
        for (edge, by) in edges.iter().zip(steadiness(&edges, &moving)) {
            let expected = noisy_distances(edge[0]);
            for k in 0..2 {
                assert!((by[k] * expected[k] - 0.01).abs() < 0.0005, "{by:?}");
            }
        }
    }

    /// A robot that drives fast and turns slowly. Windows about each edge would give the edges of the turn the distances of the
    /// fast ones beside them, and the sum would be too large.
    #[test]
    fn the_expected_distances_have_the_sum_of_the_measured_ones() {
        let edge =
            |n: usize| if (n / 20).is_multiple_of(2) { [0.02, 0.02] } else { [0.004, -0.004] };
        let edges: Vec<Vec<Travel>> = (0..400).map(|n| vec![edge(n)]).collect();
        let moving = vec![0.1; edges.len()];
        let by = steadiness(&edges, &moving);
        for k in 0..2 {
            let measured = |n: usize| noisy_distances(edge(n))[k];
            let expected: f64 = (0..edges.len()).map(|n| by[n][k] * measured(n)).sum();
            let sum: f64 = (0..edges.len()).map(measured).sum();
            assert!((expected / sum - 1.0).abs() < 1e-9, "{expected} and {sum}");
        }
    }
}
