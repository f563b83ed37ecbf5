//! One simulated run: the shipped localizer in a true world.
//!
//! - [`Simulation`]: a scenario made ready to run;
//! - `ideal`: a run in which the localizer is told everything at once and on the dot;
//! - `pins`: a run through pins, drivers and the loop that a robot runs;
//! - `score`: what is kept of either;
//! - [`computer`]: what the robot's software runs on.

pub mod computer;
mod ideal;
mod pins;
mod score;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use sonarfix::config::{Config, Rhythm, Timing};
use sonarfix::localizer::{Localizer, Start, StartError};
use sonarfix::map::{Map, MapError, Wall};
use sonarfix::pose::Pose;
use sonarfix::units::{Duration, Instant, Metres, Radians};
use sonarfix_hal::robot::Stamp;
use sonarfix_map::{BakeError, Fidelity, Follow, NamedWall, Scenario, SonarName};
use sonarfix_pil::SetupError;

use self::computer::{Computer, ThisProcess};
use crate::dense::{Line, Model, Vector};
use crate::pil::pair::PilError;
use crate::plant::Plant;
use crate::plant::follower::Follower;
use crate::statistics::RunResult;
use crate::trace::{Recorder, Trace};
use crate::world::obstacle::{Obstacle, Outline};
use crate::world::segment::{Point, Segment};
use crate::world::sensor::SensorModel;
use crate::world::{World, air};

/// A scenario made ready to run any number of times.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// The scenario.
    pub scenario: Scenario,
    /// To which instant the loop says that an echo belongs, at the fidelity of pins.
    pub stamp: Stamp,
    walls: Vec<Wall>,
    /// The walls as a baked map, if that is what the localizer is to read.
    image: Option<Vec<u8>>,
    lines: Vec<Line>,
    world: World,
    sensor: SensorModel,
    /// By how much the ranger reads too long, air included.
    range_scale: f64,
    model: Model,
    /// When the run ends, microseconds.
    end: u64,
}

/// A run that could not go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The localizer could not be made.
    #[error("the localizer refuses to start: {0}")]
    Start(#[from] StartError),
    /// The localizer refused its baked map.
    #[error("the localizer refuses its map: {0}")]
    Map(#[from] MapError),
    /// The robot's devices could not be set up.
    #[error("the robot cannot be set up: {0}")]
    Setup(#[from] SetupError),
    /// The localizer refused a travel of its own simulated wheels.
    #[error("at {time:.1} s the localizer refuses the wheels' travel: {error}")]
    Odometry {
        /// Seconds since the run began.
        time: f64,
        /// Why.
        error: sonarfix::localizer::OdometryError,
    },
    /// The microcontroller in the loop.
    #[error(transparent)]
    Emulated(#[from] PilError),
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
    echoes: ChaCha8Rng,
}

impl Chance {
    fn new(seed: u64) -> Self {
        let stream = |n| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(n);
            rng
        };
        Self { start: stream(0), wheels: stream(1), ranges: stream(2), echoes: stream(3) }
    }
}

impl Simulation {
    /// Prepares a scenario.
    #[must_use]
    pub fn new(scenario: Scenario) -> Self {
        let line = |wall: &NamedWall| Line::through(wall.from(), wall.to());
        let around = &scenario.surroundings;
        let world = World::new(&scenario.floor)
            .with_obstacles(around.obstacles.iter().map(obstacle).collect())
            .at_temperature(around.temperature);
        let believed = air::speed_of_sound(scenario.hardware.set_temperature);
        let stretch = believed / world.speed_of_sound();
        Self {
            stamp: Stamp::Reflection,
            walls: scenario.floor.walls(),
            image: None,
            lines: scenario.floor.named_walls().iter().map(line).collect(),
            world,
            sensor: sensor(&scenario),
            // (1 + scale) · stretch − 1, written so that a stretch of one changes no bit.
            range_scale: scenario.truth.range_scale * stretch + (stretch - 1.0),
            model: Model::of(&scenario.robot.config),
            end: micros(scenario.path.duration()),
            scenario,
        }
    }

    /// The same, but the localizer reads its map as on a robot: baked.
    ///
    /// # Errors
    /// [`BakeError`], if the walls cannot be baked.
    pub fn on_baked_map(self) -> Result<Self, BakeError> {
        Ok(Self { image: Some(self.baked_map()?), ..self })
    }

    /// The same, but it ends after so many seconds, if not before.
    #[must_use]
    pub fn shortened(self, seconds: f64) -> Self {
        Self { end: self.end.min(micros(seconds)), ..self }
    }

    /// The walls as a baked map.
    ///
    /// # Errors
    /// [`BakeError`], if they cannot be baked.
    pub fn baked_map(&self) -> Result<Vec<u8>, BakeError> {
        sonarfix_map::bake(&self.walls)
    }

    /// The same with a sonar that hears the walls that it hears, but never anything else, and says
    /// what is true: what can be known of it before anything is built.
    #[must_use]
    pub fn undistorted(self) -> Self {
        Self { sensor: self.sensor.undistorted(), ..self }
    }

    /// A trace of this scenario with nothing in it yet.
    #[must_use]
    pub fn empty_trace(&self) -> Trace {
        Trace::of(&self.scenario.floor, self.scenario.robot.config.sonar.cone)
    }

    /// Runs once.
    ///
    /// # Errors
    /// [`SimulationError`], if the localizer refuses its start or its wheels, or the hardware
    /// cannot be set up.
    pub fn run(
        &self,
        seed: u64,
        recorder: &mut impl Recorder,
    ) -> Result<RunResult, SimulationError> {
        self.run_on(&mut ThisProcess(self), seed, recorder)
    }

    /// Runs once, with the robot's software on this computer.
    ///
    /// # Errors
    /// [`SimulationError`], as [`Self::run`], or if the computer fails.
    pub fn run_on(
        &self,
        computer: &mut impl Computer,
        seed: u64,
        recorder: &mut impl Recorder,
    ) -> Result<RunResult, SimulationError> {
        match self.scenario.fidelity {
            Fidelity::Ideal => ideal::run(self, seed, recorder, computer),
            Fidelity::Pins => pins::run(self, seed, recorder, computer),
        }
    }

    /// By how much the ranger really reads too long: its own error and that of the temperature
    /// that its driver is set to.
    #[must_use]
    pub fn range_scale(&self) -> f64 {
        self.range_scale
    }

    /// When the run ends, microseconds.
    fn end(&self) -> u64 {
        self.end
    }

    /// How long the run lasts, simulated seconds.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        seconds(self.end)
    }

    fn plant(&self) -> Plant<'_> {
        Plant::new(&self.scenario, self.range_scale)
    }

    /// What the localizer is told of its start.
    fn start(&self, truth: &Vector, rng: &mut ChaCha8Rng) -> Start {
        estimated_start(&self.scenario, truth, rng)
    }

    /// A localizer in this process.
    fn localizer(&self, start: Start, at: Instant) -> Result<Localizer<'_>, SimulationError> {
        let map = match &self.image {
            None => Map::new(&self.walls),
            Some(image) => Map::read(image)?,
        };
        Ok(Localizer::new(self.config(), map, start, at)?)
    }

    /// The robot's configuration, with what a look takes at this fidelity.
    #[must_use]
    pub fn config(&self) -> Config {
        let mut config = self.scenario.robot.config;
        config.sonar.timing = self.timing();
        config
    }

    /// What the localizer is told that a look takes: at the ideal fidelity there is no servo.
    fn timing(&self) -> Timing {
        match self.scenario.fidelity {
            Fidelity::Pins => self.scenario.robot.config.sonar.timing,
            Fidelity::Ideal => {
                Timing { rhythm: Rhythm::Every(self.ideal_period()), ..Timing::EVERY_SECOND }
            }
        }
    }

    /// From look to look at the ideal fidelity, where as fast as possible is once in a cycle of the
    /// ranger, or with every encoder tick if that takes no time.
    fn ideal_period(&self) -> Duration {
        let timing = &self.scenario.robot.config.sonar.timing;
        match timing.rhythm {
            Rhythm::Every(period) => period,
            Rhythm::AsFastAsPossible if timing.cycle.is_zero() => {
                self.scenario.robot.encoder_period
            }
            Rhythm::AsFastAsPossible => timing.cycle,
        }
    }

    /// Who steers, if anybody must.
    fn follower(&self) -> Option<Follower> {
        let period = seconds(self.scenario.robot.encoder_period.to_micros());
        match self.scenario.follow {
            Follow::Truth => None,
            Follow::Estimate => Some(Follower::new(&self.scenario.path, period)),
        }
    }

    /// Where the sonar is on a robot at a pose.
    fn sonar_at(&self, pose: &crate::trace::Pose) -> Point {
        let mount = self.model.mount;
        let (sin, cos) = pose.heading.sin_cos();
        [pose.x + cos * mount[0] - sin * mount[1], pose.y + sin * mount[0] + cos * mount[1]]
    }
}

fn sensor(scenario: &Scenario) -> SensorModel {
    let model = match scenario.hardware.sonar {
        SonarName::Ideal => SensorModel::ideal(scenario),
        SonarName::HcSr04 => SensorModel::hc_sr04(),
        SonarName::Nxt => SensorModel::nxt(),
        SonarName::LvMaxSonar => SensorModel::lv_maxsonar(),
        SonarName::Srf08 => SensorModel::srf08(),
        SonarName::Polaroid6500 => SensorModel::polaroid_6500(),
    };
    SensorModel { scale: scenario.truth.range_scale, ..model }
}

fn obstacle(plan: &sonarfix_map::Obstacle) -> Obstacle {
    let outline = match plan.outline {
        sonarfix_map::Outline::Circle { centre, radius } => Outline::Circle { centre, radius },
        sonarfix_map::Outline::Face { from, to } => Outline::Face(Segment::new(from, to)),
    };
    Obstacle { outline, walk: plan.walk }
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
pub(crate) fn micros(seconds: f64) -> u64 {
    (seconds * 1e6).round() as u64
}

#[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs, 285 years")]
fn seconds(micros: u64) -> f64 {
    micros as f64 * 1e-6
}
