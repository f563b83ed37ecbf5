//! One simulated run: the shipped localizer in a true world.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use sonarfix::aim::Aim;
use sonarfix::localizer::{Fix, Localizer, Start, StartError};
use sonarfix::map::{Map, Wall};
use sonarfix::motion::WheelTravel;
use sonarfix::pose::Pose;
use sonarfix::units::{Instant, Metres, Radians};
use sonarfix_map::{NamedWall, Scenario};

use crate::angle;
use crate::bound::Bound;
use crate::dense::{Line, Model, Vector};
use crate::observe::{self, Look};
use crate::odometry::DeadReckoning;
use crate::plant::Plant;
use crate::statistics::{NisSum, RunResult};
use crate::trace::{Recorder, Tick, Trace};
use crate::world::{Ping, World};

/// A scenario made ready to run any number of times.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// The scenario.
    pub scenario: Scenario,
    walls: Vec<Wall>,
    lines: Vec<Line>,
    world: World,
    model: Model,
}

/// A run that could not go on.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The localizer could not be made.
    #[error("the localizer refuses to start: {0}")]
    Start(#[from] StartError),
    /// The localizer refused a travel of its own simulated wheels.
    #[error("at {time:.1} s the localizer refuses the wheels' travel: {error}")]
    Odometry {
        /// Seconds since the run began.
        time: f64,
        /// Why.
        error: sonarfix::localizer::OdometryError,
    },
    /// The filter's covariance is no longer positive definite.
    #[error("at the end of the run the covariance is not positive definite")]
    Covariance,
}

/// The independent sources of chance in a run. Each has a stream of its own, so that two policies
/// with the same seed meet the same wheels.
struct Chance {
    start: ChaCha8Rng,
    wheels: ChaCha8Rng,
    ranges: ChaCha8Rng,
}

impl Chance {
    fn new(seed: u64) -> Self {
        let stream = |n| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(n);
            rng
        };
        Self { start: stream(0), wheels: stream(1), ranges: stream(2) }
    }
}

impl Simulation {
    /// Prepares a scenario.
    #[must_use]
    pub fn new(scenario: Scenario) -> Self {
        let walls = scenario.floor.walls();
        let line = |wall: &NamedWall| Line::through(wall.from(), wall.to());
        let lines = scenario.floor.named_walls().iter().map(line).collect();
        let world = World::new(&scenario.floor);
        let model = Model::of(&scenario.robot.config);
        Self { scenario, walls, lines, world, model }
    }

    /// A trace of this scenario with nothing in it yet.
    #[must_use]
    pub fn empty_trace(&self) -> Trace {
        Trace::of(&self.scenario.floor, self.scenario.robot.config.sonar.cone)
    }

    /// Runs once.
    ///
    /// # Errors
    /// [`SimulationError`], if the localizer refuses its start or its wheels.
    pub fn run(
        &self,
        seed: u64,
        recorder: &mut impl Recorder,
    ) -> Result<RunResult, SimulationError> {
        let mut run = Run::new(self, seed)?;
        let tick_period = self.scenario.robot.encoder_period.to_micros();
        let fix_period = self.scenario.robot.fix_period.to_micros();
        let end = micros(self.scenario.path.duration());
        let (mut next_tick, mut next_fix) = (tick_period, fix_period);
        while next_tick.min(next_fix) <= end {
            let now = next_tick.min(next_fix);
            run.drive_to(now)?;
            if now == next_fix {
                run.take_fix(recorder);
                next_fix += fix_period;
            }
            if now == next_tick {
                run.end_tick(recorder);
                next_tick += tick_period;
            }
        }
        run.result()
    }
}

/// A run under way.
struct Run<'a> {
    simulation: &'a Simulation,
    chance: Chance,
    plant: Plant<'a>,
    localizer: Localizer<'a>,
    odometry: DeadReckoning,
    bound: Bound,
    /// Microseconds since the run began.
    now: u64,
    result: RunResult,
    nis: NisSum,
}

impl<'a> Run<'a> {
    fn new(simulation: &'a Simulation, seed: u64) -> Result<Self, SimulationError> {
        let Simulation { scenario, walls, model, .. } = simulation;
        let mut chance = Chance::new(seed);
        let plant = Plant::new(&scenario.path, &scenario.truth, model.track_width);
        let start = estimated_start(scenario, &plant.state(), &mut chance.start);
        let config = scenario.robot.config;
        let localizer = Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0))?;
        let deviation = localizer.filter().deviation();
        let deviation = Vector::from([
            deviation.x.into(),
            deviation.y.into(),
            deviation.heading.into(),
            deviation.scale_right.into(),
            deviation.scale_left.into(),
            deviation.track_width_error.into(),
            deviation.range_scale.into(),
        ]);
        let odometry = DeadReckoning::new(observe::estimate(&localizer).pose, model.track_width);
        let bound = Bound::new(*model, plant.state(), &deviation);
        Ok(Self {
            simulation,
            chance,
            plant,
            localizer,
            odometry,
            bound,
            now: 0,
            result: RunResult::default(),
            nis: NisSum::default(),
        })
    }

    fn time(&self) -> f64 {
        seconds(self.now)
    }

    fn drive_to(&mut self, now: u64) -> Result<(), SimulationError> {
        self.now = now;
        let time = seconds(now);
        let travel = self.plant.drive_to(time, &mut self.chance.wheels);
        self.bound.moved(travel.noiseless, self.plant.state());
        self.odometry.moved(travel.measured);
        #[expect(clippy::cast_possible_truncation, reason = "the robot counts in f32")]
        let [right, left] = travel.measured.map(|metres| metres as f32);
        self.localizer
            .odometry(Instant::from_ticks(now), WheelTravel::new(right, left))
            .map_err(|error| SimulationError::Odometry { time, error })
    }

    fn take_fix(&mut self, recorder: &mut impl Recorder) {
        let truth = self.plant.truth().pose;
        let mount = self.simulation.model.mount;
        let (sin, cos) = truth.heading.sin_cos();
        let sonar =
            [truth.x + cos * mount[0] - sin * mount[1], truth.y + sin * mount[0] + cos * mount[1]];
        let mut look = Look { time: self.time(), sonar, heading: truth.heading, range: None };
        let aim = match self.localizer.aim() {
            Ok(aim) => aim,
            Err(no_aim) => {
                self.localizer.skip();
                self.result.fixes.refused += 1;
                recorder.fix(|| observe::no_aim_record(look, no_aim));
                return;
            }
        };
        look.range = self.ping(sonar, truth.heading, &aim);
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let fix = self.localizer.fix(&aim, look.range.map(|range| Metres(range as f32)));
        self.account(&aim, &fix);
        recorder.fix(|| observe::fix_record(look, &aim, &fix));
    }

    fn ping(&mut self, from: [f64; 2], heading: f64, aim: &Aim) -> Option<f64> {
        let truth = &self.simulation.scenario.truth;
        let config = &self.simulation.scenario.robot.config.sonar;
        let echo = self.simulation.world.first_echo(&Ping {
            from,
            direction: angle::wrap(heading + f64::from(aim.bearing.0)),
            cone: truth.cone,
            reach: (config.min_range.0.into(), config.max_range.0.into()),
        });
        // Drawn whether or not an echo came, so that runs stay comparable ping by ping.
        let normal: f64 = self.chance.ranges.sample(StandardNormal);
        let distance = echo?.distance;
        let sigma = truth.range_noise.hypot(truth.range_noise_per_metre * distance);
        Some((1.0 + truth.range_scale) * distance + sigma * normal)
    }

    fn account(&mut self, aim: &Aim, fix: &Fix) {
        let counts = &mut self.result.fixes;
        match fix {
            Fix::Accepted(innovation) => {
                counts.accepted += 1;
                self.nis.add(innovation.nis().into());
                let wall = usize::try_from(aim.wall.0).ok();
                if let Some(line) = wall.and_then(|wall| self.simulation.lines.get(wall)) {
                    self.bound.fixed(line);
                }
            }
            Fix::Gated(innovation) => {
                counts.gated += 1;
                self.nis.add(innovation.nis().into());
            }
            Fix::Refused(_) => counts.refused += 1,
        }
    }

    fn end_tick(&mut self, recorder: &mut impl Recorder) {
        let error = observe::error(self.localizer.filter(), &self.plant.state());
        self.result.path.add(&error);
        recorder.tick(|| Tick {
            time: self.time(),
            truth: Some(self.plant.truth()),
            estimate: observe::estimate(&self.localizer),
            bound: Some(self.bound.deviation().into()),
            odometry: self.odometry.pose(),
        });
    }

    fn result(mut self) -> Result<RunResult, SimulationError> {
        let ekf = self.localizer.filter();
        let error = observe::error(ekf, &self.plant.state());
        let (nees, estimated) =
            observe::nees(&error, &observe::covariance(ekf)).ok_or(SimulationError::Covariance)?;
        self.result.error = error;
        self.result.bound_variance = self.bound.variance();
        self.result.nees = nees;
        self.result.estimated_states = estimated;
        self.result.nis = self.nis;
        self.result.judge(self.localizer.health().verdict);
        Ok(self.result)
    }
}

/// What the filter is told of its start: the truth, or a draw around it.
fn estimated_start(scenario: &Scenario, truth: &Vector, rng: &mut ChaCha8Rng) -> Start {
    let start = &scenario.start;
    let mut draw = |sigma: f64| {
        let normal: f64 = rng.sample(StandardNormal);
        if start.drawn { sigma * normal } else { 0.0 }
    };
    let pose = [
        truth[0] + draw(start.position),
        truth[1] + draw(start.position),
        truth[2] + draw(start.heading),
    ];
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    let [x, y, heading, position, doubt] =
        [pose[0], pose[1], pose[2], start.position, start.heading].map(|v| v as f32);
    Start {
        pose: Pose::new(x, y, Radians(heading)),
        position_deviation: Metres(position),
        heading_deviation: Radians(doubt),
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a run's length is positive and far below 2^63 µs"
)]
fn micros(seconds: f64) -> u64 {
    (seconds * 1e6).round() as u64
}

#[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs, 285 years")]
fn seconds(micros: u64) -> f64 {
    micros as f64 * 1e-6
}
