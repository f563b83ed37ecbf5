//! The estimation in progress.
//!
//! The window of the estimate grows over the recording (`growth`). In three rounds its pings are associated again with the
//! reflectors, each round with a narrower kernel.

#![expect(clippy::indexing_slicing, reason = "matches have the length of the chain")]

use nalgebra::Vector3;

use crate::bearings::{self, Bearings, WallPing};
use crate::calibration::{
    BOTH_WAYS, CalibrateError, FEWEST_EXPLAINED, FEWEST_INLIERS, Nominal, share,
};
use crate::chain::Covariance;
use crate::chain_of_poses::Chain;
use crate::constants::{Constants, Name, Priors};
use crate::noise;
use crate::odometry::{WheelNoise, turned, wrap};
use crate::problem::{Noise, PosePrior, Problem, State};
use crate::recording::{Recording, StartPose};
use crate::reflector::{Gate, Reflector, associate};
use crate::solve::{SolveError, covariance, solve};
use crate::wall::sonar;
use crate::wheel_noise;

/// Shortest drive, metres.
const SHORTEST: f64 = 3.0;
/// Largest noise of a wheel, m/√m: twice that of a bad floor.
pub(crate) const NOISIEST: f64 = 0.04;
/// Standard deviations of the wheel difference and of the relative track width below which straight legs separate them
/// even if the robot turns to one side only.
const SEPARATE: [f64; 2] = [0.003, 0.01];
/// Deviations of the prior beyond which a constant is implausible.
const IMPLAUSIBLE: f64 = 3.0;
/// Standard deviation of the difference of the wheels' scales if the turns cannot separate it.
const SAME_WHEELS: f64 = 0.005;

/// Gate of the association, metres, and the same as the kernel's width; narrowed in rounds.
pub(crate) const ROUNDS: [f64; 3] = [0.30, 0.15, 0.08];
/// Largest innovation of an echo that is associated, in its standard deviations.
const COMPATIBLE: f64 = 4.0;
/// Angle off the axis at which an echo can still be a reflector's, radians: servo and mount may be wrong by 15°.
const WIDE: f64 = 0.6;
/// The same once the bearings are known.
const NARROW: f64 = 0.45;

/// Deviation of the wheels' difference while the window grows from a given one.
const NEAR_START: f64 = 0.03;

/// What the growth starts from, apart from the robot file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Start {
    /// True bearing of a command of zero, radians.
    pub(crate) bearing: f64,
    /// Difference of the wheels' scales; `None`: only the prior bounds it.
    pub(crate) wheel_difference: Option<f64>,
    /// Least noise of the wheels that the growth assumes at first, m/√m.
    pub(crate) wheel_noise: f64,
}

/// The estimation in progress.
#[derive(Clone)]
pub(crate) struct Fit<'a> {
    pub(crate) problem: Problem<'a>,
    pub(crate) state: State,
    pub(crate) nominal: &'a Nominal,
    pub(crate) cone: f64,
    pub(crate) has_ranges: bool,
    pub(crate) has_references: bool,
    pub(crate) turned: [f64; 2],
    /// Whether wheel difference and track width are not separated.
    pub(crate) is_joint: bool,
    /// Priors of the constants once the window is the whole recording.
    pub(crate) priors: Priors,
}

impl<'a> Fit<'a> {
    pub(crate) fn new(
        recording: &'a Recording,
        chain: &'a Chain,
        reflectors: &'a [Reflector],
        nominal: &'a Nominal,
        start: StartPose,
    ) -> Result<Self, CalibrateError> {
        let distance = chain.distances.last().copied().unwrap_or(0.0);
        if distance < SHORTEST {
            return Err(CalibrateError::TooShort(distance));
        }
        let echoes = chain.pings.iter().any(|event| recording.pings[event.index].range.is_some());
        let has_ranges = echoes && !reflectors.is_empty();
        let has_references = !recording.references.is_empty();
        if !has_ranges && !has_references {
            return Err(CalibrateError::NothingMeasured);
        }
        let constants = Constants::nominal(nominal.track_width, nominal.mount);
        let priors = Priors::of_a_builder(&constants, has_ranges, has_references);
        // A start that is better known than it can be would bend the calibration.
        let (position, heading) = (start.position.max(0.02), start.heading.max(0.02));
        let problem = Problem {
            recording,
            chain,
            reflectors,
            matches: vec![None; chain.pings.len()],
            noise: nominal.noise,
            priors,
            window: 0..chain.len(),
            first: PosePrior { pose: start.pose, position, heading },
            kernel: 3.0,
        };
        let state = State { poses: vec![start.pose; chain.len()], constants };
        Ok(Self {
            problem,
            state,
            nominal,
            cone: WIDE,
            has_ranges,
            has_references,
            turned: [0.0; 2],
            is_joint: false,
            priors,
        })
    }

    /// Sets what the growth starts from. A narrower prior around it takes the place of the prior until the window is the whole
    /// recording: the first step would otherwise return to the mean of the prior.
    pub(crate) fn start_from(&mut self, start: Start) {
        self.state.constants.bearing_offset = start.bearing;
        let noise = start.wheel_noise.max(self.nominal.noise.wheel.turn);
        self.problem.noise.wheel = WheelNoise::independent(noise);
        if let Some(difference) = start.wheel_difference {
            for (name, share) in [(Name::Right, 0.5), (Name::Left, -0.5)] {
                self.state.constants.set(name, share * difference);
            }
            self.problem.priors.means = self.state.constants.values;
            self.problem.priors.wheel_difference = NEAR_START;
        }
    }

    /// Estimates everything.
    pub(crate) fn run(&mut self) -> Result<Option<Bearings>, CalibrateError> {
        if self.has_references {
            self.follow_references();
            self.refine(&ROUNDS)?;
        } else {
            self.grow()?;
        }
        self.separate()?;
        self.settle()
    }

    /// Estimates bearings and noises about the poses so far.
    pub(crate) fn settle(&mut self) -> Result<Option<Bearings>, CalibrateError> {
        let mut bearings = None;
        if self.has_ranges {
            for _ in 0..2 {
                bearings = self.fit_bearings();
                self.refine(&[ROUNDS[2]])?;
            }
        }
        self.fit_noise()?;
        Ok(bearings)
    }

    /// Starts at the poses of the reference stream, and between and beyond them by odometry.
    fn follow_references(&mut self) {
        for i in 0..self.problem.chain.len() {
            match self.problem.reference_at(i) {
                Some(pose) => self.state.poses[i] = pose,
                None if i > 0 => self.predict(i..i + 1),
                None => {}
            }
        }
    }

    /// Assumes that the wheels are nearly equal if the recording cannot separate their difference from the track width:
    /// the robot turns to one side only, and their deviations show it.
    fn separate(&mut self) -> Result<(), CalibrateError> {
        let headings = self.state.poses.iter().map(|pose| pose.z);
        self.turned = turned(headings);
        if self.turned.iter().all(|&angle| angle >= BOTH_WAYS) {
            return Ok(());
        }
        let covariance =
            covariance(&self.problem, &self.state).map_err(SolveError::from)?.constants;
        let [right, left, track] = [Name::Right, Name::Left, Name::Track].map(|name| name as usize);
        let difference =
            covariance[(right, right)] + covariance[(left, left)] - 2.0 * covariance[(right, left)];
        if difference.max(0.0).sqrt() < SEPARATE[0]
            && covariance[(track, track)].sqrt() < SEPARATE[1]
        {
            return Ok(());
        }
        self.is_joint = true;
        self.problem.priors.wheel_difference = SAME_WHEELS;
        self.refine(&[ROUNDS[1], ROUNDS[2]])
    }

    /// Associates and solves, once for each gate.
    pub(crate) fn refine(&mut self, gates: &[f64]) -> Result<(), CalibrateError> {
        const ITERATIONS: usize = 8;
        let covariance = covariance(&self.problem, &self.state).map_err(SolveError::from)?;
        for &gate in gates {
            let mut widest = gate;
            if self.has_ranges {
                widest = self.associate(gate, &covariance);
            }
            // The kernel is as wide as the gate, in deviations of a range of a metre.
            let deviations = 0.5 * widest / self.problem.noise.of_range(1.0);
            self.problem.kernel = deviations.max(noise::INLIER);
            solve(&self.problem, &mut self.state, ITERATIONS)?;
        }
        Ok(())
    }

    /// Associates each ping with the reflector whose expected range is nearest, within [`COMPATIBLE`] deviations of the
    /// innovation, and `widest` metres at most. Returns the widest gate used.
    fn associate(&mut self, widest: f64, covariance: &Covariance) -> f64 {
        let problem = &self.problem;
        let constants = &self.state.constants;
        let scale = 1.0 + constants.get(Name::RangeScale);
        let mut used = 0.0_f64;
        let matches = problem.chain.pings.iter().enumerate().map(|(k, event)| {
            if !problem.window.contains(&event.pose) {
                return problem.matches[k];
            }
            let ping = &problem.recording.pings[event.index];
            let (pose, ..) = problem.pose_at(&self.state, event);
            let (at, direction) = sonar(&pose, ping.bearing, constants);
            let range = ping.range? - constants.get(Name::RangeOffset);
            let gate = Gate { range: widest, cone: self.cone };
            let reflector = associate(problem.reflectors, at, direction, range, scale, gate)?;
            let term = problem.range_term(&self.state, k, reflector)?;
            let spread = problem.variance(covariance, event.pose, &term) + term.deviation.powi(2);
            let limit = COMPATIBLE * spread.sqrt();
            used = used.max(limit.min(widest));
            (term.residual.abs() <= limit).then_some(reflector)
        });
        self.problem.matches = matches.collect();
        used
    }

    /// Estimates the line of the bearings from answers and missing answers of isolated walls.
    fn fit_bearings(&mut self) -> Option<Bearings> {
        const ENOUGH: f64 = 0.02;
        if !self.nominal.has_servo {
            return None;
        }
        let found = bearings::fit(&self.wall_pings())?;
        if found.offset_deviation > ENOUGH {
            return None;
        }
        self.state.constants.bearing_offset = found.offset;
        self.state.constants.bearing_scale =
            if found.scale_deviation < ENOUGH { found.scale } else { 1.0 };
        self.cone = NARROW;
        Some(found)
    }

    /// The pings towards the nearest wall ahead, where nothing else of the map is near.
    fn wall_pings(&self) -> Vec<WallPing> {
        const ASIDE: f64 = 0.8;
        const FROM_END: f64 = 0.2;
        let (problem, constants) = (&self.problem, &self.state.constants);
        let [nearest, farthest] = self.nominal.reach;
        let mut wall_pings = Vec::new();
        let mut before: Option<f64> = None;
        for (k, event) in problem.chain.pings.iter().enumerate() {
            let ping = &problem.recording.pings[event.index];
            let moved = before.map_or(0.0, |before| ping.bearing - before);
            before = Some(ping.bearing);
            let (pose, ..) = problem.pose_at(&self.state, event);
            let (at, direction) = sonar(&pose, ping.bearing, constants);
            let walls = problem.reflectors.iter().enumerate().filter_map(|(i, reflector)| {
                let Reflector::Wall(wall) = reflector else { return None };
                Some((i, wall, reflector.view(at, direction)))
            });
            let ahead = walls.filter(|(.., view)| view.answers && view.off_axis.abs() < ASIDE);
            let first = ahead.min_by(|a, b| a.2.distance.total_cmp(&b.2.distance));
            let Some((reflector, wall, view)) = first else { continue };
            let foot = wall.foot(at, direction);
            let inside = foot.along > FROM_END && foot.along < wall.length() - FROM_END;
            let distance = view.distance;
            if !inside || distance < nearest + 0.05 || distance > 0.8 * farthest {
                continue;
            }
            let term = problem.range_term(&self.state, k, reflector);
            let answered = term.is_some_and(|term| term.residual.abs() < 5.0 * term.deviation);
            // Another object was nearer: the wall had no chance.
            let is_hidden = term.is_some_and(|term| term.residual > 5.0 * term.deviation);
            if is_hidden {
                continue;
            }
            wall_pings.push(WallPing {
                commanded: ping.bearing,
                perpendicular: wrap(direction - foot.off_axis - pose.z),
                distance,
                moved: if moved.abs() > 1e-6 { moved.signum() } else { 0.0 },
                answered,
            });
        }
        wall_pings
    }

    fn fit_noise(&mut self) -> Result<(), CalibrateError> {
        for _ in 0..4 {
            let covariance = covariance(&self.problem, &self.state).map_err(SolveError::from)?;
            self.problem.noise = noise::estimate(&self.problem, &self.state, &covariance);
            if self.has_ranges {
                self.associate(self.gate(), &covariance);
            }
            self.problem.kernel = 2.0 * noise::INLIER;
            solve(&self.problem, &mut self.state, 10)?;
        }
        Ok(())
    }

    /// Continues with a chain that has a pose at each echo, and estimates the noises there.
    pub(crate) fn finish_at_echoes(
        &mut self,
        chain: &'a Chain,
    ) -> Result<wheel_noise::Estimated, CalibrateError> {
        self.state.poses = interpolated(self.problem.chain, &self.state.poses, &chain.times);
        self.problem.chain = chain;
        self.problem.window = 0..chain.len();
        for _ in 0..2 {
            solve(&self.problem, &mut self.state, 10)?;
            let covariance = covariance(&self.problem, &self.state).map_err(SolveError::from)?;
            if self.has_ranges {
                self.associate(self.gate(), &covariance);
            }
            let wheel = wheel_noise::of_wheels(&self.problem, &self.state)?.value;
            self.problem.noise = Noise {
                wheel: WheelNoise::independent(wheel),
                ..noise::estimate(&self.problem, &self.state, &covariance)
            };
        }
        solve(&self.problem, &mut self.state, 10)?;
        Ok(wheel_noise::estimate(&self.problem, &self.state)?)
    }

    /// The final gate: eight deviations, at least 5 cm.
    fn gate(&self) -> f64 {
        (8.0 * self.problem.noise.of_range(1.0)).clamp(0.05, 0.3)
    }

    /// Numbers of inliers, and of echoes that the map should explain. Echoes of corners count as neither: they answer less often, and not
    /// to light, and in a wrong map some echo is always as far as a corner.
    pub(crate) fn counted(&self) -> (usize, usize) {
        let problem = &self.problem;
        let (mut inliers, mut expected) = (0, 0);
        for (k, event) in problem.chain.pings.iter().enumerate() {
            let ping = &problem.recording.pings[event.index];
            if ping.range.is_none() {
                continue;
            }
            if let Some(reflector) = problem.matches[k].filter(|of| self.is_inlier(k, *of)) {
                let of_wall = usize::from(problem.reflectors[reflector].is_wall());
                inliers += of_wall;
                expected += of_wall;
                continue;
            }
            let (pose, ..) = problem.pose_at(&self.state, event);
            let (at, direction) = sonar(&pose, ping.bearing, &self.state.constants);
            let has_wall = problem.reflectors.iter().any(|reflector| {
                let view = reflector.view(at, direction);
                let is_near = view.off_axis.abs() < 0.15 && view.distance < self.nominal.reach[1];
                reflector.is_wall() && view.answers && is_near
            });
            expected += usize::from(has_wall);
        }
        (inliers, expected)
    }

    /// Whether ping `k` of the chain is within three deviations of a reflector.
    fn is_inlier(&self, k: usize, reflector: usize) -> bool {
        let term = self.problem.range_term(&self.state, k, reflector);
        term.is_some_and(|term| term.residual.abs() <= noise::INLIER * term.deviation)
    }

    /// Negative logarithm of the marginal likelihood, for the comparison of solutions: with the noise of the wheels that each has, and
    /// the other noises of the robot file, which are the same for all. An echo without a reflector costs as much as one far from it.
    pub(crate) fn loss(&self) -> Result<f64, SolveError> {
        let mut problem = self.problem.clone();
        problem.noise = Noise { wheel: problem.noise.wheel, ..self.nominal.noise };
        problem.kernel = noise::INLIER;
        let unmatched = problem.chain.pings.iter().zip(&problem.matches).filter(|(event, of)| {
            of.is_none() && problem.recording.pings[event.index].range.is_some()
        });
        #[expect(clippy::cast_precision_loss, reason = "numbers of pings")]
        let unmatched = unmatched.count() as f64;
        Ok(problem.marginal(&self.state)? + unmatched * 0.5 * problem.kernel.powi(2))
    }

    pub(crate) fn check(&self) -> Result<(), CalibrateError> {
        if self.has_ranges {
            let (inliers, expected) = self.counted();
            if expected == 0 || share(inliers, expected) < FEWEST_INLIERS {
                return Err(CalibrateError::FewInliers { inliers, expected });
            }
            let pings = &self.problem.recording.pings;
            let echoes = pings.iter().filter(|ping| ping.range.is_some()).count();
            if share(inliers, echoes) < FEWEST_EXPLAINED {
                return Err(CalibrateError::Unexplained { inliers, echoes });
            }
        }
        for name in Name::ALL.into_iter().filter(|name| self.problem.priors.is_free(*name)) {
            let priors = &self.problem.priors;
            let (mean, deviation) = (priors.means[name as usize], priors.deviations[name as usize]);
            if (self.state.constants.get(name) - mean).abs() > IMPLAUSIBLE * deviation {
                return Err(CalibrateError::Implausible(name));
            }
        }
        if self.is_too_noisy() {
            return Err(CalibrateError::NoisyWheels(self.problem.noise.wheel.turn * 1e3));
        }
        Ok(())
    }

    /// Whether the noise of the wheels is beyond the limit up to which a drive fits its model.
    pub(crate) fn is_too_noisy(&self) -> bool {
        self.problem.noise.wheel.turn > NOISIEST.max(self.nominal.noise.wheel.turn)
    }
}

/// The poses of a chain at other times within it, in order.
fn interpolated(chain: &Chain, poses: &[Vector3<f64>], times: &[f64]) -> Vec<Vector3<f64>> {
    let at = |time: &f64| {
        let next = chain.times.partition_point(|other| other < time).min(poses.len() - 1);
        let one = next.saturating_sub(1);
        let span = chain.times[next] - chain.times[one];
        let share = if span > 0.0 { (time - chain.times[one]) / span } else { 1.0 };
        let mut by = poses[next] - poses[one];
        by.z = wrap(by.z);
        let mut pose = poses[one] + by * share;
        pose.z = wrap(pose.z);
        pose
    };
    times.iter().map(at).collect()
}
