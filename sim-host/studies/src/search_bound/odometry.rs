//! What is known of the motion since the first ping: all, or what the encoders tell.
//!
//! The wheels of a trial have scale errors, each uniform up to [`WHEEL_ERROR`]. Their difference turns the true heading against that of the
//! encoders by a constant drift per metre, which is one more dimension of the grid. What else is wrong, the mean of both scales and the
//! noise of the wheels, is counted as a deviation of the place, which is independent from ping to ping.

use sonarfix_plan::trial::{Heard, WHEEL_ERROR};
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Pose;

/// What is known of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Odometry {
    /// All of it.
    Exact,
    /// What the encoders tell.
    Measured,
}

/// The pose at each ping for one drift, in the frame of the pose at the first.
#[derive(Debug, Clone)]
struct Path {
    /// Radians per metre.
    drift: f64,
    poses: Vec<Pose>,
}

/// The motion since the first ping, for each drift of the grid.
#[derive(Debug, Clone)]
pub(super) struct Motions {
    odometry: Odometry,
    /// The largest drift, radians per metre; zero if the motion is known.
    most: f64,
    /// Heading noise of the encoders, rad/√m, and that of their travel, m/√m.
    noise: (f64, f64),
    paths: Vec<Path>,
    /// The distance driven until each ping, metres.
    driven: Vec<f64>,
}

impl Motions {
    pub(super) fn new(simulation: &Simulation, odometry: Odometry) -> Self {
        let width: f64 = simulation.config().drive.track_width.0.into();
        let noise = simulation.scenario.truth.wheel_noise;
        let most = match odometry {
            Odometry::Exact => 0.0,
            Odometry::Measured => 2.0 * WHEEL_ERROR / width,
        };
        Self {
            odometry,
            most,
            noise: (noise * 2.0_f64.sqrt() / width, noise / 2.0_f64.sqrt()),
            paths: vec![Path { drift: 0.0, poses: Vec::new() }],
            driven: Vec::new(),
        }
    }

    /// Goes on to the last of all pings so far.
    pub(super) fn add(&mut self, pings: &[Heard]) {
        let Some(last) = pings.last() else { return };
        let before = self.driven.last().copied();
        self.driven.push(before.map_or(0.0, |driven| driven + last.travel[0].abs()));
        for path in &mut self.paths {
            let next = next(self.odometry, path, pings);
            path.poses.push(next);
        }
    }

    /// Halves the cells of the drift, whose path has the number of the cell, and computes the motion again. Returns the parts of a cell.
    pub(super) fn halve(&mut self, pings: &[Heard]) -> usize {
        if self.odometry == Odometry::Exact {
            return 1;
        }
        let half = self.half_cell() / 2.0;
        let halves = |path: &Path| [path.drift - half, path.drift + half];
        let drifts: Vec<f64> = self.paths.iter().flat_map(halves).collect();
        let path = |&drift: &f64| {
            let mut path = Path { drift, poses: Vec::with_capacity(pings.len()) };
            for n in 1..=pings.len() {
                let next = next(self.odometry, &path, pings.get(..n).unwrap_or_default());
                path.poses.push(next);
            }
            path
        };
        self.paths = drifts.iter().map(path).collect();
        2
    }

    /// Half of the edge of a cell, radians per metre.
    #[expect(clippy::cast_precision_loss, reason = "at most 16 cells")]
    fn half_cell(&self) -> f64 {
        self.most / self.paths.len() as f64
    }

    /// ln of the density of a drift, up to a constant: the difference of two uniform errors.
    pub(super) fn log_prior(&self, drift: usize) -> f64 {
        let share = |path: &Path| if self.most > 0.0 { path.drift.abs() / self.most } else { 0.0 };
        self.paths.get(drift).map_or(0.0, |path| (1.0 - share(path)).ln())
    }

    /// The pose at a ping in the frame of the pose at the first.
    pub(super) fn at(&self, drift: usize, ping: usize) -> Pose {
        let pose = self.paths.get(drift).and_then(|path| path.poses.get(ping));
        pose.copied().unwrap_or(HERE)
    }

    /// Half of the spread of the place at a ping in a cell of the drift, metres.
    pub(super) fn spread(&self, ping: usize) -> f64 {
        0.5 * self.half_cell() * self.driven(ping).powi(2)
    }

    /// Deviation of the place at a ping, metres, by what no dimension of the grid has.
    pub(super) fn deviation(&self, ping: usize) -> f64 {
        if self.odometry == Odometry::Exact {
            return 0.0;
        }
        let driven = self.driven(ping);
        let (heading, travel) = self.noise;
        let aside = heading * (driven.powi(3) / 3.0).sqrt();
        let along = travel * driven.sqrt();
        // The mean of two uniform errors.
        let scale = WHEEL_ERROR / 6.0_f64.sqrt() * driven;
        aside.hypot(along).hypot(scale)
    }

    fn driven(&self, ping: usize) -> f64 {
        self.driven.get(ping).copied().unwrap_or(0.0)
    }
}

/// The origin of a frame.
const HERE: Pose = Pose { x: 0.0, y: 0.0, heading: 0.0 };

/// The pose at the last ping in the frame of the first, after a path that leads to the ping before.
fn next(odometry: Odometry, path: &Path, pings: &[Heard]) -> Pose {
    let (Some(first), Some(last)) = (pings.first(), pings.last()) else { return HERE };
    let Some(before) = path.poses.last() else { return HERE };
    match odometry {
        Odometry::Exact => seen_from(&first.pose, &last.pose),
        Odometry::Measured => {
            let [advance, turn] = last.travel;
            let turn = turn + path.drift * advance;
            let middle = before.heading + 0.5 * turn;
            Pose {
                x: before.x + advance * middle.cos(),
                y: before.y + advance * middle.sin(),
                heading: before.heading + turn,
            }
        }
    }
}

/// A pose in the frame of another one.
fn seen_from(frame: &Pose, pose: &Pose) -> Pose {
    let (sin, cos) = frame.heading.sin_cos();
    let (dx, dy) = (pose.x - frame.x, pose.y - frame.y);
    Pose { x: cos * dx + sin * dy, y: cos * dy - sin * dx, heading: pose.heading - frame.heading }
}

/// The pose that is `motion` in the frame of a pose.
pub(super) fn moved(pose: &Pose, motion: &Pose) -> Pose {
    let (sin, cos) = pose.heading.sin_cos();
    Pose {
        x: pose.x + cos * motion.x - sin * motion.y,
        y: pose.y + sin * motion.x + cos * motion.y,
        heading: pose.heading + motion.heading,
    }
}

#[cfg(test)]
mod tests {
    use sonarfix_plan::trial::{SetDown, TrialError, observed_trial};

    use super::*;
    use crate::floor_plan::FloorPlan;

    /// The path of the nearest drift ends where the robot is, within the deviation that the other errors have; without drift
    /// it is far beside in at least one of the plans. The true path is exact.
    #[test]
    fn one_of_the_drifts_leads_to_where_the_robot_is() -> Result<(), TrialError> {
        let mut worst_without = 0.0_f64;
        for seed in 0..4 {
            let scenario = FloorPlan::new(seed).scenario()?;
            let simulation = Simulation::new(scenario.clone());
            let mut pings = Vec::new();
            let mut exact = Motions::new(&simulation, Odometry::Exact);
            let mut measured = Motions::new(&simulation, Odometry::Measured);
            observed_trial(scenario, seed, SetDown::Anywhere, 20.0, |heard, _| {
                pings.push(heard);
                exact.add(&pings);
                true
            })?;
            for n in 1..=pings.len() {
                measured.add(&pings[..n]);
            }
            let straight = measured.at(0, pings.len() - 1);
            for _ in 0..5 {
                assert_eq!(measured.halve(&pings), 2);
            }
            let (first, last) = (pings[0].pose, pings.len() - 1);
            let truth = pings[last].pose;
            let away = |motion: &Pose| {
                let end = moved(&first, motion);
                (end.x - truth.x).hypot(end.y - truth.y)
            };
            assert!(away(&exact.at(0, last)) < 1e-9 && exact.halve(&pings) == 1);
            let nearest = (0..32).map(|drift| away(&measured.at(drift, last)));
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            let allowed = 3.0 * (measured.deviation(last) + measured.spread(last));
            assert!(nearest < allowed, "seed {seed}: {nearest} m, {allowed}");
            worst_without = worst_without.max(away(&straight) / allowed);
        }
        assert!(worst_without > 1.0, "{worst_without}");
        Ok(())
    }
}
