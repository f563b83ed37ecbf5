//! The chain of poses of a recording: a pose every few centimetres, the wheel travel between them, and the pings that
//! belong to each.

use crate::odometry::Travel;
use crate::recording::{Reading, Recording, RecordingError, StartPose};

/// When a new pose begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spacing {
    /// After this travel, metres.
    pub travel: f64,
    /// After this difference of the wheels' travel, metres.
    pub turn: f64,
}

impl Spacing {
    /// That of a calibration; the turn is about 10° of a small robot.
    pub const CALIBRATION: Self = Self { travel: 0.05, turn: 0.02 };
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
    pub fn of(recording: &Recording) -> Result<(Self, StartPose), RecordingError> {
        recording.check()?;
        let start = match (recording.start, recording.references.first()) {
            (Some(start), _) => start,
            (None, Some(first)) => {
                StartPose { time: first.time, pose: first.pose, position: 0.1, heading: 0.1 }
            }
            (None, None) => return Err(RecordingError::NoStart),
        };
        let chain = Self::build(recording, start.time, Spacing::CALIBRATION)
            .ok_or(RecordingError::NoTravel)?;
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
        let mut chain = Self::default();
        let mut pings = recording.pings.iter().enumerate().peekable();
        while pings.next_if(|(_, ping)| ping.time < begin.time).is_some() {}
        chain.times.push(begin.time);
        chain.distances.push(0.0);
        chain.turns.push(0.0);
        let mut steps: Vec<Travel> = Vec::new();
        let (mut distance, mut turns) = (0.0, 0.0);
        for (one, next) in readings.iter().zip(readings.iter().skip(1)) {
            while let Some((index, ping)) = pings.next_if(|(_, ping)| ping.time < next.time) {
                let mut part = steps.clone();
                push(&mut part, travel(one, next, (ping.time - one.time) / (next.time - one.time)));
                chain.pings.push(Event { index, pose: chain.times.len() - 1, steps: part });
            }
            let step = travel(one, next, 1.0);
            push(&mut steps, step);
            let [right, left] = step;
            distance += f64::midpoint(right.abs(), left.abs());
            turns += (right - left).abs();
            let sum = |of: fn(&Travel) -> f64| steps.iter().map(of).sum::<f64>().abs();
            let long = sum(|[right, left]| f64::midpoint(*right, *left)) >= spacing.travel;
            let is_last = next.time >= end.time;
            if long
                || sum(|[right, left]| right - left) >= spacing.turn
                || (is_last && !steps.is_empty())
            {
                chain.edges.push(std::mem::take(&mut steps));
                chain.times.push(next.time);
                chain.distances.push(distance);
                chain.turns.push(turns);
            }
        }
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
