//! Both filters in one run: a recorder that passes the odometry and the pings of the localizer to a particle filter.

use sonarfix::config::{Config, RangerId};
use sonarfix::health::Verdict;
use sonarfix_sim::angle;
use sonarfix_sim::trace::{FixRecord, Pose, Recorder, Tick};

use super::compared::{Compared, Errors};
use super::cone::Segment;
use super::particle_filter::ParticleFilter;

/// A pose is right within this distance, metres.
const RIGHT: f64 = 0.5;
/// Larger deviations of the start mean that it is unknown, metres.
const UNKNOWN: f64 = 10.0;
/// A gap of the reference counts as at most so many seconds.
const LONGEST_GAP: f64 = 10.0;

/// A ping that waits for the encoder sample after it.
#[derive(Debug, Clone, Copy)]
struct Ping {
    time: f64,
    ranger: RangerId,
    bearing: f64,
    range: Option<f64>,
}

/// The particle filter, from the start record on, and the errors of both.
#[derive(Debug)]
pub struct Beside {
    config: Config,
    walls: Vec<Segment>,
    seed: u64,
    filter: Option<ParticleFilter>,
    /// Time and dead-reckoned pose of the last encoder sample.
    last: (f64, Pose),
    /// Time of the last sample with a reference.
    compared_at: f64,
    pings: Vec<Ping>,
    compared: Compared,
}

impl Beside {
    pub fn new(config: &Config, walls: Vec<Segment>, seed: u64) -> Self {
        Self {
            config: *config,
            walls,
            seed,
            filter: None,
            last: (0.0, Pose::default()),
            compared_at: 0.0,
            pings: Vec::new(),
            compared: Compared::default(),
        }
    }

    pub fn compared(self) -> Compared {
        self.compared
    }

    /// Drives on to a sample of the encoders. Pings in between share its travel by their times.
    fn drive_to(&mut self, tick: &Tick) {
        let Some(filter) = &mut self.filter else { return };
        let (began, from) = self.last;
        let turn = angle::wrap(tick.odometry.heading - from.heading);
        let (sin, cos) = (from.heading + 0.5 * turn).sin_cos();
        let advance = (tick.odometry.x - from.x) * cos + (tick.odometry.y - from.y) * sin;
        let mut done = 0.0;
        for ping in self.pings.drain(..) {
            let Some(ranger) = self.config.rangers.get(ping.ranger) else { continue };
            let share = ((ping.time - began) / (tick.time - began)).clamp(done, 1.0);
            filter.drive((share - done) * advance, (share - done) * turn);
            done = share;
            filter.ping(ranger, ping.bearing, ping.range);
            self.compared.pings += 1;
            self.compared.particle_updates += filter.count() as u64;
        }
        filter.drive((1.0 - done) * advance, (1.0 - done) * turn);
        self.last = (tick.time, tick.odometry);
    }

    fn compare(&mut self, tick: &Tick) {
        let (Some(truth), Some(filter)) = (&tick.truth, &self.filter) else { return };
        let seconds = (tick.time - self.compared_at).min(LONGEST_GAP);
        self.compared_at = tick.time;
        let belief = filter.belief();
        let is_tracking = tick.estimate.verdict == Verdict::Tracking;
        let of = |pose: &Pose, is_sure: bool| {
            let error = (pose.x - truth.pose.x).hypot(pose.y - truth.pose.y);
            Errors {
                seconds,
                within: if error <= RIGHT { seconds } else { 0.0 },
                wrong_and_sure: if error > RIGHT && is_sure { seconds } else { 0.0 },
                squares: seconds * error * error,
            }
        };
        let compared = &mut self.compared;
        compared.localizer = compared.localizer.plus(of(&tick.estimate.pose, is_tracking));
        compared.particles = compared.particles.plus(of(&belief.pose, belief.is_sure));
    }
}

impl Recorder for Beside {
    fn started(&mut self, make: impl FnOnce() -> Tick) {
        if self.filter.is_some() {
            return;
        }
        let tick = make();
        let [x, _, heading, ..] = tick.estimate.deviation;
        let (config, walls) = (&self.config, self.walls.clone());
        self.filter = Some(if x > UNKNOWN {
            ParticleFilter::anywhere(config, walls, self.seed)
        } else {
            ParticleFilter::at(config, walls, (tick.estimate.pose, x, heading), self.seed)
        });
        self.last = (tick.time, tick.odometry);
        self.compared_at = tick.time;
    }

    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let tick = make();
        self.drive_to(&tick);
        self.compare(&tick);
    }

    fn fix(&mut self, make: impl FnOnce() -> FixRecord) {
        let fix = make();
        if fix.wall.is_some() {
            let FixRecord { time, bearing, range, .. } = fix;
            self.pings.push(Ping { time, ranger: RangerId(fix.ranger), bearing, range });
        }
    }
}
