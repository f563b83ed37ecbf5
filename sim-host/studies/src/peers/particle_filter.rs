//! A particle filter as robots with a laser use it: Monte Carlo localization with a beam model, as many particles as the spread of the
//! belief requires (KLD sampling, Fox 2001), and random particles when the measurements fit worse than they did (augmented MCL; Thrun,
//! Burgard, Fox: Probabilistic Robotics, tables 6.1, 8.3 and 8.4).

use std::collections::{HashMap, HashSet};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use sonarfix::config::{Config, RangerParameters};
use sonarfix_sim::angle;
use sonarfix_sim::trace::Pose;

use super::cone::{Cone, Nearest, Segment};

/// Fewest particles.
pub const FEWEST: usize = 2_000;
/// Most particles.
pub const MOST: usize = 10_000;
/// Bins of KLD sampling, metres and radians, its error and the quantile of the normal distribution that it holds with.
const BIN: (f64, f64) = (0.25, 0.175);
const KLD_ERROR: f64 = 0.05;
const KLD_QUANTILE: f64 = 2.326;
/// Rates of the mean likelihoods that recovery compares.
const SLOW: f64 = 0.001;
const FAST: f64 = 0.1;
/// Noise of the wheels, as a multiple of the robot file's.
const WHEEL_NOISE: f64 = 1.5;
/// What each resampling adds to the errors of the wheels, as a part of their prior deviations.
const JITTER: f64 = 0.05;
/// Shares of the beam model where a wall is square to the beam, at the rim of the cone, and where it is not square: hit, something before
/// the wall, no echo. What is left is an echo anywhere.
const SQUARE: [f64; 3] = [0.80, 0.08, 0.07];
const AT_RIM: [f64; 3] = [0.40, 0.10, 0.35];
const OBLIQUE: [f64; 3] = [0.05, 0.05, 0.55];
/// The rim of the cone, as a multiple of its half-angle.
const RIM: f64 = 1.6;
/// Where no wall is in reach: no echo.
const EMPTY: f64 = 0.9;
/// Least deviation of a range, metres: that of the map, and for the distance between particles.
const LEAST_DEVIATION: f64 = 0.1;
/// Exponent of a ping's likelihood: the errors of consecutive pings are correlated.
const INDEPENDENT: f64 = 0.3;
/// Size of a cluster around the bin with the most weight, metres and radians.
const CLUSTER: (f64, f64) = (1.0, 0.8);
/// A pose is sure if its cluster has this weight and deviation, metres.
const SURE: (f64, f64) = (0.95, 0.25);

#[derive(Debug, Clone, Copy)]
struct Particle {
    pose: Pose,
    /// Errors of the travel of the right and of the left wheel.
    scales: [f64; 2],
    weight: f64,
}

/// Parameters of the robot.
#[derive(Debug, Clone, Copy)]
struct Robot {
    track_width: f64,
    /// Metres per root metre.
    noise: f64,
    /// Deviations of the errors of the wheels' travel.
    scales: [f64; 2],
}

/// The estimated pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Belief {
    /// The mean.
    pub pose: Pose,
    /// Whether nearly all of the weight is there.
    pub is_sure: bool,
}

/// Poses with weights.
#[derive(Debug, Clone)]
pub struct ParticleFilter {
    walls: Vec<Segment>,
    robot: Robot,
    particles: Vec<Particle>,
    /// Means of the likelihood of a ping, long and short.
    slow: f64,
    fast: f64,
    /// Whether random particles are added when the pings fit worse than they did.
    recovers: bool,
    rng: ChaCha8Rng,
}

impl ParticleFilter {
    /// A filter with a known start: the pose and its deviations in metres and radians. It has no recovery, which makes it worse where much is not in the
    /// map.
    #[must_use]
    pub fn at(
        config: &Config,
        walls: Vec<Segment>,
        (pose, at, turn): (Pose, f64, f64),
        seed: u64,
    ) -> Self {
        let mut filter = Self { recovers: false, ..Self::anywhere(config, walls, seed) };
        for particle in &mut filter.particles {
            let [x, y, heading] = [(); 3].map(|()| filter.rng.sample::<f64, _>(StandardNormal));
            particle.pose = Pose {
                x: pose.x + at * x,
                y: pose.y + at * y,
                heading: angle::wrap(pose.heading + turn * heading),
            };
        }
        filter
    }

    /// A filter with an unknown start: particles anywhere within the rectangle around the walls.
    #[must_use]
    pub fn anywhere(config: &Config, walls: Vec<Segment>, seed: u64) -> Self {
        let drive = &config.drive;
        let robot = Robot {
            track_width: drive.track_width.0.into(),
            noise: WHEEL_NOISE * f64::from(drive.wheel_noise.0.0),
            scales: [config.prior.scale_right, config.prior.scale_left].map(f64::from),
        };
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let weight = 1.0 / count(MOST);
        let particle = |_| {
            let scales = robot.scales.map(|scale| scale * rng.sample::<f64, _>(StandardNormal));
            Particle { pose: anywhere(&walls, &mut rng), scales, weight }
        };
        let particles = (0..MOST).map(particle).collect();
        Self { walls, robot, particles, slow: 0.0, fast: 0.0, recovers: true, rng }
    }

    /// How many particles there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.particles.len()
    }

    /// Moves all particles by what the encoders count: metres along the mean heading and radians.
    pub fn drive(&mut self, advance: f64, turn: f64) {
        let Robot { track_width, noise, .. } = self.robot;
        let half = 0.5 * turn * track_width;
        let wheels = [advance + half, advance - half];
        let [by_right, by_left] = wheels.map(|travel| (travel, noise * travel.abs().sqrt()));
        for particle in &mut self.particles {
            let [of_right, of_left] = particle.scales;
            let wheels = [(by_right, of_right), (by_left, of_left)];
            let [right, left] = wheels.map(|((travel, deviation), scale)| {
                travel * (1.0 + scale) + deviation * self.rng.sample::<f64, _>(StandardNormal)
            });
            let turn = (right - left) / track_width;
            let pose = &mut particle.pose;
            let (sin, cos) = (pose.heading + 0.5 * turn).sin_cos();
            let advance = f64::midpoint(right, left);
            pose.x += advance * cos;
            pose.y += advance * sin;
            pose.heading = angle::wrap(pose.heading + turn);
        }
    }

    /// Updates the weights by a ping at a bearing, radians, robot frame, and its range, metres; `None`: no echo.
    pub fn ping(&mut self, ranger: &RangerParameters, bearing: f64, range: Option<f64>) {
        let mut sum = 0.0;
        for particle in &mut self.particles {
            let nearest = cone(ranger, &particle.pose, bearing).nearest(&self.walls);
            particle.weight *= likelihood(ranger, nearest, range).powf(INDEPENDENT);
            sum += particle.weight;
        }
        if sum <= 0.0 || !sum.is_finite() {
            return;
        }
        for rate in [(&mut self.slow, SLOW), (&mut self.fast, FAST)] {
            let (mean, rate) = rate;
            *mean = if *mean > 0.0 { *mean + rate * (sum - *mean) } else { sum };
        }
        let mut squares = 0.0;
        for particle in &mut self.particles {
            particle.weight /= sum;
            squares += particle.weight * particle.weight;
        }
        if 1.0 / squares < 0.5 * count(self.particles.len()) {
            self.resample();
        }
    }

    /// Draws as many particles as the spread requires; a share of them anywhere if the last pings fit worse than those before.
    fn resample(&mut self) {
        let lost = if self.recovers { (1.0 - self.fast / self.slow).max(0.0) } else { 0.0 };
        if lost > 0.0 {
            (self.slow, self.fast) = (0.0, 0.0);
        }
        let mut cumulated = Vec::with_capacity(self.particles.len());
        let mut sum = 0.0;
        for particle in &self.particles {
            sum += particle.weight;
            cumulated.push(sum);
        }
        let mut bins = HashSet::new();
        let mut drawn = Vec::new();
        while drawn.len() < MOST && (drawn.len() < FEWEST || drawn.len() < required(bins.len())) {
            let at = sum * self.rng.random::<f64>();
            let number = cumulated.partition_point(|sum| *sum < at);
            let chosen = self.particles.get(number).or(self.particles.last());
            let Some(mut particle) = chosen.copied() else { return };
            for (scale, deviation) in particle.scales.iter_mut().zip(self.robot.scales) {
                *scale += JITTER * deviation * self.rng.sample::<f64, _>(StandardNormal);
            }
            if self.rng.random_bool(lost) {
                particle.pose = anywhere(&self.walls, &mut self.rng);
            }
            bins.insert(bin(&particle.pose, BIN));
            drawn.push(particle);
        }
        let weight = 1.0 / count(drawn.len());
        for particle in &mut drawn {
            particle.weight = weight;
        }
        self.particles = drawn;
    }

    /// The mean of the heaviest cluster.
    #[must_use]
    pub fn belief(&self) -> Belief {
        let mut weights: HashMap<_, f64> = HashMap::new();
        for Particle { pose, weight, .. } in &self.particles {
            *weights.entry(bin(pose, (0.5, 0.5))).or_default() += weight;
        }
        let heaviest =
            weights.iter().max_by(|one, other| one.1.total_cmp(other.1).then(one.0.cmp(other.0)));
        let inside = |particle: &&Particle| {
            heaviest.is_some_and(|(at, _)| bin(&particle.pose, (0.5, 0.5)) == *at)
        };
        let (centre, ..) = mean(self.particles.iter().filter(inside));
        let is_near = |particle: &&Particle| {
            let pose = &particle.pose;
            (pose.x - centre.x).hypot(pose.y - centre.y) < CLUSTER.0
                && angle::wrap(pose.heading - centre.heading).abs() < CLUSTER.1
        };
        let (pose, weight, deviation) = mean(self.particles.iter().filter(is_near));
        Belief { pose, is_sure: weight > SURE.0 && deviation < SURE.1 }
    }
}

fn cone(ranger: &RangerParameters, pose: &Pose, bearing: f64) -> Cone {
    let (sin, cos) = pose.heading.sin_cos();
    let [x, y] = [ranger.mount.x, ranger.mount.y].map(|at| f64::from(at.0));
    Cone {
        from: [pose.x + cos * x - sin * y, pose.y + sin * x + cos * y],
        axis: pose.heading + bearing,
        half: RIM * f64::from(ranger.cone.0),
        reach: ranger.max_range.0.into(),
    }
}

/// The beam model: density of a range, per metre, or probability of no echo.
fn likelihood(ranger: &RangerParameters, nearest: Option<Nearest>, range: Option<f64>) -> f64 {
    let reach = f64::from(ranger.max_range.0);
    let Some(Nearest { distance, off_axis }) = nearest else {
        return if range.is_some() { (1.0 - EMPTY) / reach } else { EMPTY };
    };
    let [hit, short, none] = match off_axis {
        Some(angle) if angle <= f64::from(ranger.cone.0) => SQUARE,
        Some(_) => AT_RIM,
        None => OBLIQUE,
    };
    let Some(range) = range else { return none };
    let of_sonar = f64::from(ranger.noise.floor.0) + f64::from(ranger.noise.per_metre) * distance;
    let deviation = LEAST_DEVIATION.hypot(of_sonar);
    let ratio = (range - distance) / deviation;
    let peak = 1.0 / (deviation * (2.0 * std::f64::consts::PI).sqrt());
    let before = if range < distance { short / distance } else { 0.0 };
    hit * peak * (-0.5 * ratio * ratio).exp() + before + (1.0 - hit - short - none) / reach
}

/// Mean pose, weight and deviation of the position of some particles.
fn mean<'p>(particles: impl Iterator<Item = &'p Particle> + Clone) -> (Pose, f64, f64) {
    let mut sums = [0.0; 5];
    for Particle { pose, weight, .. } in particles.clone() {
        let (sin, cos) = pose.heading.sin_cos();
        let terms = [1.0, pose.x, pose.y, cos, sin];
        sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += weight * term);
    }
    let [weight, x, y, cos, sin] = sums;
    let pose = Pose { x: x / weight, y: y / weight, heading: sin.atan2(cos) };
    let squares = particles.map(|Particle { pose: at, weight, .. }| {
        weight * ((at.x - pose.x).powi(2) + (at.y - pose.y).powi(2))
    });
    (pose, weight, (squares.sum::<f64>() / weight).sqrt())
}

#[expect(clippy::cast_possible_truncation, reason = "a map is far smaller")]
fn bin(pose: &Pose, (metres, radians): (f64, f64)) -> (i32, i32, i32) {
    let of = |value: f64, size: f64| (value / size).floor() as i32;
    (of(pose.x, metres), of(pose.y, metres), of(angle::wrap(pose.heading), radians))
}

/// The particles that so many bins require (Fox 2001, with the approximation of Wilson and Hilferty).
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousands")]
fn required(bins: usize) -> usize {
    if bins < 2 {
        return FEWEST;
    }
    let degrees = count(bins - 1);
    let part = 2.0 / (9.0 * degrees);
    let cube = (1.0 - part + part.sqrt() * KLD_QUANTILE).powi(3);
    (degrees / (2.0 * KLD_ERROR) * cube).ceil() as usize
}

/// A pose anywhere in the rectangle around the walls.
fn anywhere(walls: &[Segment], rng: &mut ChaCha8Rng) -> Pose {
    let ends = || walls.iter().flatten().copied();
    let least = ends().fold([f64::INFINITY; 2], |[x, y], [a, b]| [x.min(a), y.min(b)]);
    let most = ends().fold([f64::NEG_INFINITY; 2], |[x, y], [a, b]| [x.max(a), y.max(b)]);
    let mut within = |(least, most): (f64, f64)| least + (most - least) * rng.random::<f64>();
    let ([left, below], [right, above]) = (least, most);
    let (x, y) = (within((left, right)), within((below, above)));
    let turn = std::f64::consts::PI;
    Pose { x, y, heading: rng.random_range(-turn..turn) }
}

fn count(of: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "some thousands")]
    let count = of as f64;
    count
}

#[cfg(test)]
mod tests {
    use sonarfix::geometry::units::Metres;

    use super::*;

    const ROOM: [Segment; 4] = [
        [[0.0, 0.0], [4.0, 0.0]],
        [[4.0, 0.0], [4.0, 3.0]],
        [[4.0, 3.0], [0.0, 3.0]],
        [[0.0, 3.0], [0.0, 0.0]],
    ];

    #[test]
    fn ranges_and_silence_have_a_probability_of_one_in_all() {
        let ranger = Config::for_track_width(Metres(0.2)).rangers.first;
        let reach = f64::from(ranger.max_range.0);
        let walls =
            [None, Some(0.1), Some(0.4)].map(|off_axis| Some(Nearest { distance: 2.0, off_axis }));
        for nearest in walls.into_iter().chain([None]) {
            let step = reach / 1e5;
            let of = |n: u32| likelihood(&ranger, nearest, Some(step * (f64::from(n) + 0.5)));
            let ranges = (0..100_000).map(of).sum::<f64>() * step;
            let all = ranges + likelihood(&ranger, nearest, None);
            assert!((all - 1.0).abs() < 1e-3, "{nearest:?}: {all}");
        }
    }

    /// Figure of Fox's method: 100 bins need the 99 % quantile of chi squared with 99 degrees of freedom, 134.64, over twice the error.
    #[test]
    fn the_number_of_particles_is_that_of_a_table() {
        assert!(required(100).abs_diff(1_347) <= 2, "{}", required(100));
    }

    /// Wheels of which one is larger by 2 %: with its own errors of the wheels the filter stays at the pose.
    #[test]
    fn it_keeps_a_pose_although_the_wheels_are_wrong() {
        let mut config = Config::for_track_width(Metres(0.2));
        config.prior.scale_right = 0.02;
        config.prior.scale_left = 0.02;
        let mut truth = Pose { x: 1.0, y: 1.0, heading: 0.0 };
        let mut filter = ParticleFilter::at(&config, ROOM.to_vec(), (truth, 0.02, 0.02), 1);
        for n in 0..1_200_u32 {
            // A circle of 60 cm.
            let (advance, turn) = (0.01, 0.01 / 0.6);
            truth.heading = angle::wrap(truth.heading + turn);
            truth.x += advance * truth.heading.cos();
            truth.y += advance * truth.heading.sin();
            filter.drive(1.01 * advance, turn + 0.02 * advance / 0.2);
            let bearing = f64::from(n % 36) * 0.174;
            let ranger = config.rangers.first;
            let nearest = cone(&ranger, &truth, bearing).nearest(&ROOM);
            let is_heard = nearest.is_some_and(|nearest| nearest.off_axis.is_some());
            filter.ping(
                &ranger,
                bearing,
                nearest.filter(|_| is_heard).map(|nearest| nearest.distance),
            );
        }
        let belief = filter.belief();
        let error = (belief.pose.x - truth.x).hypot(belief.pose.y - truth.y);
        assert!(belief.is_sure && error < 0.15, "{belief:?} {truth:?}");
        assert!(filter.count() == FEWEST, "{}", filter.count());
    }
}
