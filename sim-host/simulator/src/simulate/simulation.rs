//! A scenario, prepared to be run.

use rand_chacha::ChaCha8Rng;
use sonarfix::config::{Config, PingSchedule, PingTiming, RangerId, RangerParameters, Ranging};
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::{Map, Wall};
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::robot::Stamp;
use sonarfix_map::{BakeError, Fidelity, Follow, NamedWall, Scenario, SonarName};

use super::error::SimulationError;
use crate::bound::Noise;
use crate::dense::{Line, Model, Vector};
use crate::plant::Plant;
use crate::plant::follower::Follower;
use crate::plant::gyro::Gyro;
use crate::random;
use crate::time::{micros, seconds};
use crate::trace::{self, Trace};
use crate::world::obstacle::{Obstacle, Outline};
use crate::world::segment::{Point, Segment};
use crate::world::sensor::SensorModel;
use crate::world::{World, air};

/// Above this number of walls the localizer reads a baked map, as on a robot: without its index an aim tests every wall.
pub const MANY: usize = 128;

/// A scenario, prepared to be run any number of times.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// The scenario.
    pub scenario: Scenario,
    /// The instant that the loop assigns to a range, at the fidelity of pins.
    pub stamp: Stamp,
    walls: Vec<Wall>,
    /// The baked map, if the localizer reads one: as on a robot, or because there are many walls.
    image: Option<Vec<u8>>,
    pub(super) lines: Vec<Line>,
    pub(super) world: World,
    pub(super) sensor: SensorModel,
    /// Scale error of the ranger, including that of the speed of sound.
    pub(super) range_scale: f64,
    /// Whether the bound is computed with the noise that the filter assumes.
    bound_of_filter: bool,
    /// When the run ends, microseconds.
    end: u64,
    /// When the robot is carried along its path, and how far.
    pub(super) carried: Option<Carried>,
    /// When a wheel slips, and how far.
    pub(super) slipped: Option<Slipped>,
    /// When the robot is kidnapped, in order of time.
    pub(super) put_down: Vec<PutDown>,
    /// The robot file of the robot's software, if it is not that of the true robot.
    assumed: Option<RobotConfig>,
    /// The robot of the scenario with the true mount and servo.
    pub(super) built: RobotConfig,
}

/// A robot that is carried along its path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carried {
    /// When, microseconds since the run began.
    pub(super) at: u64,
    /// How far, as the time in which it would drive there, seconds.
    pub(super) by: f64,
}

/// A slip of one wheel that turns the odometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slipped {
    /// When, microseconds since the run began.
    pub(super) at: u64,
    /// The right wheel (0) or the left (1).
    pub(super) wheel: usize,
    /// The turn of the odometry, radians.
    pub(super) turn: f64,
}

/// A kidnapping: the robot is moved elsewhere, without odometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PutDown {
    /// When, microseconds since the run began.
    pub(super) at: u64,
    /// Its new true pose.
    pub(super) pose: trace::Pose,
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
        let assumed = air::speed_of_sound(scenario.robot.rangers.first.temperature.0.into());
        let stretch = match scenario.robot.localizer.rangers.first.ranging {
            Ranging::Sound => assumed / world.speed_of_sound(),
            Ranging::Light(_) => 1.0,
        };
        let walls = scenario.floor.walls();
        Self {
            stamp: Stamp::Reflection,
            // A map that cannot be baked is read without an index, which is slow.
            image: (walls.len() > MANY).then(|| sonarfix_map::bake(&walls).ok()).flatten(),
            walls,
            lines: scenario.floor.named_walls().iter().map(line).collect(),
            world,
            sensor: sensor(&scenario),
            // (1 + scale) · stretch − 1, arranged so that a stretch of one changes no bit.
            range_scale: scenario.truth.range_scale * stretch + (stretch - 1.0),
            bound_of_filter: false,
            end: micros(scenario.path.duration()),
            carried: None,
            slipped: None,
            put_down: Vec::new(),
            assumed: None,
            built: scenario.truth.robot(&scenario.robot),
            scenario,
        }
    }

    /// The same with software that is configured with another robot and another map than the true ones.
    #[must_use]
    pub fn believing(self, robot: RobotConfig, walls: Vec<Wall>) -> Self {
        let image = (walls.len() > MANY).then(|| sonarfix_map::bake(&walls).ok()).flatten();
        Self { assumed: Some(robot), walls, image, ..self }
    }

    /// The same with other unmapped obstacles from a time on, seconds since the run began.
    #[must_use]
    pub fn rearranged(self, from: f64, obstacles: &[sonarfix_map::Obstacle]) -> Self {
        let obstacles = obstacles.iter().map(obstacle).collect();
        Self { world: self.world.rearranged(from, obstacles), ..self }
    }

    /// The same with a baked map, as on a robot.
    ///
    /// # Errors
    /// [`BakeError`], if the walls cannot be baked.
    pub fn on_baked_map(self) -> Result<Self, BakeError> {
        Ok(Self { image: Some(self.baked_map()?), ..self })
    }

    /// The same, with the robot carried along its path: `at` seconds after the start, as far as it would drive in
    /// `by` seconds. Only at the fidelity of pins, and if it follows the path exactly.
    #[must_use]
    pub fn carried(self, at: f64, by: f64) -> Self {
        let left = micros((self.scenario.path.duration() - by).max(0.0));
        let end = self.end.min(left);
        Self { carried: Some(Carried { at: micros(at), by }), end, ..self }
    }

    /// The same, with a slip `at` seconds after the start of the right (0) or left (1) wheel, which turns the odometry by this
    /// angle, radians, and not the robot. Only at the fidelity of pins; a robot that stands slips when it drives on.
    #[must_use]
    pub fn slipped(self, at: f64, wheel: usize, turn: f64) -> Self {
        Self { slipped: Some(Slipped { at: micros(at), wheel, turn }), ..self }
    }

    /// The same, with the robot kidnapped `at` seconds after the start, to a true pose; its wheels do not
    /// roll. Only at the fidelity of pins, and if it steers by its estimate.
    #[must_use]
    pub fn put_down(mut self, at: f64, pose: trace::Pose) -> Self {
        self.put_down.push(PutDown { at: micros(at), pose });
        self.put_down.sort_by_key(|put_down| put_down.at);
        self
    }

    /// The same with the bound for the noise that the filter assumes, instead of that of the simulation.
    #[must_use]
    pub fn bound_of_filter(self) -> Self {
        Self { bound_of_filter: true, ..self }
    }

    /// The same, limited to a duration in seconds.
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

    /// The same with a sonar without errors that only detects walls: the basis of a forecast.
    #[must_use]
    pub fn undistorted(self) -> Self {
        Self { sensor: self.sensor.undistorted(), ..self }
    }

    /// The true world.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The true sonar.
    #[must_use]
    pub fn sensor(&self) -> &SensorModel {
        &self.sensor
    }

    /// An empty trace of this scenario.
    #[must_use]
    pub fn empty_trace(&self) -> Trace {
        let trace =
            Trace::of(&self.scenario.floor, self.scenario.robot.localizer.rangers.first.cone);
        Trace { obstacles: self.world.obstacles().to_vec(), ..trace }
    }

    /// True scale error of the ranger: its own error and that of the air temperature that its driver
    /// assumes.
    #[must_use]
    pub fn range_scale(&self) -> f64 {
        self.range_scale
    }

    /// When the run ends, microseconds.
    pub(super) fn end(&self) -> u64 {
        self.end
    }

    /// How long the run lasts, simulated seconds.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        seconds(self.end)
    }

    pub(super) fn plant(&self) -> Plant<'_> {
        Plant::new(&self.scenario, self.range_scale)
    }

    /// The gyro, if the robot has one.
    pub(super) fn gyro(&self, rng: &mut ChaCha8Rng) -> Option<Gyro> {
        let assumed = self.scenario.robot.localizer.gyro.as_ref()?;
        Some(Gyro::new(&self.scenario.truth.gyro, assumed, rng))
    }

    /// The initial estimate of the localizer; none if the robot starts without a pose.
    pub(super) fn start(&self, truth: &Vector, rng: &mut ChaCha8Rng) -> Option<Start> {
        let is_known = !self.scenario.start.is_unknown;
        is_known.then(|| estimated_start(&self.scenario, truth, rng))
    }

    /// A localizer in this process, with the robot's map and configuration.
    ///
    /// # Errors
    /// [`SimulationError::Start`] or [`SimulationError::Map`], by what the localizer rejects.
    pub fn localizer(&self, start: Start, at: Instant) -> Result<Localizer<'_>, SimulationError> {
        let map = match &self.image {
            None => Map::new(&self.walls),
            Some(image) => Map::read(image)?,
        };
        Ok(Localizer::new(self.config(), map, start, at)?)
    }

    /// The robot's configuration, with the measurement timing of this fidelity.
    #[must_use]
    pub fn config(&self) -> Config {
        let mut config = self.assumed.unwrap_or(self.scenario.robot).localizer;
        for sonar in config.rangers.iter_mut() {
            sonar.timing = self.timing(sonar);
        }
        config
    }

    /// The robot, with the measurement timing of this fidelity.
    #[must_use]
    pub fn robot(&self) -> RobotConfig {
        RobotConfig { localizer: self.config(), ..self.assumed.unwrap_or(self.scenario.robot) }
    }

    /// The measurement timing: at the ideal fidelity there is no servo.
    fn timing(&self, sonar: &RangerParameters) -> PingTiming {
        match self.scenario.fidelity {
            Fidelity::Pins => sonar.timing,
            Fidelity::Ideal => PingTiming {
                schedule: PingSchedule::Every(self.ideal_period()),
                ..PingTiming::EVERY_SECOND
            },
        }
    }

    /// Period of the measurements at the ideal fidelity. As fast as possible means once in a cycle of
    /// the ranger, or with every encoder tick if the cycle is zero.
    pub(super) fn ideal_period(&self) -> Duration {
        let timing = &self.scenario.robot.localizer.rangers.first.timing;
        match timing.schedule {
            PingSchedule::Every(period) => period,
            PingSchedule::AsFastAsPossible if timing.cycle.is_zero() => {
                self.scenario.robot.encoder_period
            }
            PingSchedule::AsFastAsPossible => timing.cycle,
        }
    }

    /// The path follower, if the robot steers by its estimate.
    pub(super) fn follower(&self) -> Option<Follower> {
        let period = seconds(self.scenario.robot.encoder_period.to_micros());
        match self.scenario.follow {
            Follow::Truth => None,
            Follow::Estimate => Some(Follower::new(&self.scenario.path, period)),
        }
    }

    /// Position of the first sonar on a robot at a pose.
    #[must_use]
    pub fn sonar_at(&self, pose: &trace::Pose) -> Point {
        self.ranger_at(RangerId::FIRST, pose)
    }

    /// The model of the bound with a ranger of the robot; with the first, if it has no such one.
    pub(super) fn model_of(&self, ranger: RangerId) -> Model {
        let assumed = self.assumed_model(ranger);
        if self.bound_of_filter { assumed } else { self.true_noise().of(assumed) }
    }

    /// The true robot with the noise that its filter assumes.
    fn assumed_model(&self, ranger: RangerId) -> Model {
        let config = &self.built.localizer;
        Model::of_ranger(config, config.rangers.get(ranger).unwrap_or(&config.rangers.first))
    }

    /// The noise of the simulation, with which the bound is computed.
    #[must_use]
    pub fn true_noise(&self) -> Noise {
        Noise::simulated(&self.scenario.truth, &self.sensor)
    }

    /// The noise that the filter assumes, with the first ranger.
    #[must_use]
    pub fn assumed_noise(&self) -> Noise {
        Noise::assumed(&self.assumed_model(RangerId::FIRST))
    }

    /// Position of a ranger on a robot at a pose.
    #[must_use]
    pub fn ranger_at(&self, ranger: RangerId, pose: &trace::Pose) -> Point {
        let rangers = &self.built.localizer.rangers;
        let mount = rangers.get(ranger).unwrap_or(&rangers.first).mount;
        let [ahead, aside] = [mount.x.0, mount.y.0].map(f64::from);
        let (sin, cos) = libm::sincos(pose.heading);
        [pose.x + cos * ahead - sin * aside, pose.y + sin * ahead + cos * aside]
    }
}

fn sensor(scenario: &Scenario) -> SensorModel {
    let model = match scenario.hardware.sonar {
        SonarName::Ideal => SensorModel::ideal(scenario),
        SonarName::HcSr04 => SensorModel::hc_sr04(),
        SonarName::Nxt => SensorModel::nxt(),
        SonarName::Ev3 => SensorModel::ev3(),
        SonarName::LvMaxSonar => SensorModel::lv_maxsonar(),
        SonarName::Srf08 => SensorModel::srf08(),
        SonarName::Polaroid6500 => SensorModel::polaroid_6500(),
        SonarName::Vl53l1x => SensorModel::vl53l1x(),
        SonarName::Vl53l0x => SensorModel::vl53l0x(),
    };
    let truth = &scenario.truth;
    SensorModel { scale: truth.range_scale, offset: truth.range_offset, ..model }
}

fn obstacle(plan: &sonarfix_map::Obstacle) -> Obstacle {
    let outline = match plan.outline {
        sonarfix_map::Outline::Circle { centre, radius } => Outline::Circle { centre, radius },
        sonarfix_map::Outline::Face { from, to } => Outline::Face(Segment::new(from, to)),
    };
    Obstacle { outline, walk: plan.walk }
}

/// The initial estimate: the truth, or a draw around it.
fn estimated_start(scenario: &Scenario, truth: &Vector, rng: &mut ChaCha8Rng) -> Start {
    let start = &scenario.start;
    let mut draw = |sigma: f64| {
        let normal = random::normal(rng);
        if start.drawn { sigma * normal } else { 0.0 }
    };
    let pose = [
        truth[0] + draw(start.position),
        truth[1] + draw(start.position),
        truth[2] + draw(start.heading),
    ];
    start_at(scenario, pose)
}

/// A start at a pose, metres and radians, with the deviations of the scenario.
#[must_use]
pub fn start_at(scenario: &Scenario, pose: [f64; 3]) -> Start {
    let deviations = &scenario.start;
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    let single = |value: f64| value as f32;
    let [x, y, heading] = pose.map(single);
    Start {
        pose: Pose::new(x, y, Radians(heading)),
        position_deviation: Metres(single(deviations.position)),
        heading_deviation: Radians(single(deviations.heading)),
    }
}
