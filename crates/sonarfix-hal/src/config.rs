//! The configuration of a robot in one structure: everything that its builder measures or chooses.
//!
//! [`RobotConfig`] is what `sonarfix config bake` writes into flash (`sonarfix-link`'s `baked`), and
//! what loop, drivers, planner, simulator and replay read. No fact is in it twice: the servo's limits
//! and timing, the ping schedule and the ranger's cycle are those of
//! [`RangerParameters`] inside [`RobotConfig::localizer`], which the planner uses as
//! well; the other fields are what only the loop and the drivers need.
//!
//! [`Unsupported`] is the reason for which a board cannot be the robot that a configuration describes.
//!
//! # Adding a field
//! `CONTRIBUTING.md` has the recipe: the field in its structure here (or in the localizer's [`Config`]) with its default, and a
//! row in the table of keys of `sonarfix-map`; the version of the baked image rises (`sonarfix-link`, `baked::VERSION`).
//!
//! # Non-finite policy
//! [`RobotConfig::check`] refuses NaN and infinity in every field.

mod feature;

use sonarfix::config::{
    Config, ConfigError, PingSchedule, PingTiming, Policy, RangerId, RangerParameters, Rangers,
    Ranging,
};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::health::{DEGRADED_WITHOUT_ODOMETRY, Verdict};
use sonarfix::localizer::Localizer;
use sonarfix::map::Region;

use crate::encoder::{GeometryError, WheelGeometry, Wheels};
use crate::ranger::{Air, Celsius, PulseTiming, RangerKind, RangerSettings};
use crate::servo::{Calibration, MeasuredPulse, ServoSettings, SettingError};
use crate::time::since;

pub use feature::{Feature, NotLinked};

/// Longest time from one reading of the encoders to the next, as in robot files: without odometry for longer, no pose is known.
const LONGEST_ENCODER_PERIOD: Duration = Duration::from_ticks(1_000_000);
/// Longest time of a ping, a servo or the link, as in robot files: what takes longer never ends for a robot that drives.
const LONGEST_TIME: Duration = Duration::from_ticks(3_600_000_000);

/// The bearing to which the sonar of a robot that drives ahead must turn on both sides, radians: 45°.
const LEAST_SWEEP: f32 = core::f32::consts::FRAC_PI_4;

/// The configuration of a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RobotConfig {
    /// The localizer's configuration. The servo's limits and timing, the ping schedule and the
    /// ranger's cycle are in it.
    pub localizer: Config,
    /// The right wheel and its encoder.
    pub right_wheel: WheelConfig,
    /// The left wheel and its encoder.
    pub left_wheel: WheelConfig,
    /// Time from one reading of the encoders to the next.
    pub encoder_period: Duration,
    /// The drivers of [`Config::rangers`], in the same order.
    pub rangers: Rangers<RangerConfig>,
    /// When the motors are enabled.
    pub motors: MotorPolicy,
    /// Whether the robot needs to know where it starts.
    pub start: StartPose,
}

/// How a robot moves by itself while it searches for its pose.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SearchMotion {
    /// The motion.
    pub kind: SearchMotionKind,
    /// The least range of an echo ahead with which the robot drives on, from the sonar.
    pub bumper: Metres,
}

impl SearchMotion {
    /// The bumper distance of a configuration that does not state one: half of the width of a small robot, and what it needs to stop.
    pub const BUMPER: Metres = Metres(0.3);
}

/// The kinds of [`SearchMotion`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum SearchMotionKind {
    /// It turns once on the spot.
    Spin,
    /// It drives ahead where the sonar finds free floor, and turns where it does not.
    Ahead,
}

/// Whether a robot needs to know where it starts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum StartPose {
    /// The pose must be set before the start. A lost robot stays lost.
    #[default]
    Known,
    /// It searches for its pose if it starts without one, and whenever it is lost (feature `search`).
    Unknown {
        /// The region in which it starts without a pose; anywhere on the map if there is none.
        region: Option<Region>,
    },
    /// The same, and it moves by itself while it searches and nobody else drives it (feature `drive`). A variant of its own, so that the
    /// bytes of the other configurations are those of earlier versions.
    Exploring {
        /// As of [`Self::Unknown`].
        region: Option<Region>,
        /// The motion.
        motion: SearchMotion,
    },
}

impl StartPose {
    /// Whether the robot searches for a pose that it does not have.
    #[must_use]
    pub fn is_unknown(&self) -> bool {
        *self != Self::Known
    }

    /// The region in which a robot without a pose starts, if it is limited.
    #[must_use]
    pub fn region(&self) -> Option<Region> {
        match self {
            Self::Known => None,
            Self::Unknown { region } | Self::Exploring { region, .. } => *region,
        }
    }

    /// How the robot moves by itself while it searches, if it does.
    #[must_use]
    pub fn motion(&self) -> Option<SearchMotion> {
        match self {
            Self::Known | Self::Unknown { .. } => None,
            Self::Exploring { motion, .. } => Some(*motion),
        }
    }
}

/// A wheel and its encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WheelConfig {
    /// The travel of the wheel from one edge of its encoder to the next: its circumference divided by the edges of a
    /// revolution.
    pub travel_per_edge: Metres,
    /// Whether the encoder counts down while the robot drives ahead, because its motor is mounted as a mirror image
    /// of the other.
    pub is_mirrored: bool,
}

impl WheelConfig {
    /// A wheel of this diameter, whose encoder has this many edges in a revolution of the wheel.
    #[must_use]
    pub fn of_diameter(diameter: Metres, edges_per_revolution: f32) -> Self {
        let travel_per_edge = Metres(core::f32::consts::PI * diameter.0 / edges_per_revolution);
        Self { travel_per_edge, is_mirrored: false }
    }

    /// The same wheel with an encoder that counts in the opposite direction.
    #[must_use]
    pub fn mirrored(self) -> Self {
        Self { is_mirrored: !self.is_mirrored, ..self }
    }

    /// The geometry that the loop computes with.
    ///
    /// # Errors
    /// [`GeometryError`] if the travel is not a positive finite length.
    pub fn geometry(&self) -> Result<WheelGeometry, GeometryError> {
        let wheel = WheelGeometry::rolling(self.travel_per_edge)?;
        Ok(if self.is_mirrored { wheel.reversed() } else { wheel })
    }

    /// The travel ahead for a count of plus one: negative if the encoder is mirrored.
    #[must_use]
    pub fn signed_travel(&self) -> Metres {
        if self.is_mirrored { -self.travel_per_edge } else { self.travel_per_edge }
    }
}

/// The drivers of a ranger and of its servo.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangerConfig {
    /// The kind, which determines the driver.
    pub kind: RangerKind,
    /// Temperature of the air that the driver computes ranges with; the same for all rangers.
    pub temperature: Celsius,
    /// Two pulses of the servo, and the bearing of the ranger that was measured with each. Without effect on a ranger at a
    /// fixed bearing ([`RangerParameters::fixed_bearing`]).
    pub servo_pulses: [MeasuredPulse; 2],
}

impl RangerConfig {
    /// The pulses of a ranger without a servo.
    pub const NO_PULSES: [MeasuredPulse; 2] =
        [MeasuredPulse { width: Duration::from_ticks(0), bearing: Radians(0.0) }; 2];

    /// The settings of the servo's driver for this sonar; `None` without a servo.
    #[must_use]
    pub fn servo_settings(&self, sonar: &RangerParameters) -> Option<ServoSettings> {
        sonar.fixed_bearing().is_none().then_some(ServoSettings {
            pulses: self.servo_pulses,
            limits: sonar.servo,
            timing: sonar.timing.servo,
        })
    }

    /// The settings of the ranger's driver for this sonar.
    #[must_use]
    pub fn settings(&self, sonar: &RangerParameters) -> RangerSettings {
        // `check` refuses a temperature out of range; without it the driver uses room temperature.
        let air = Air::at(self.temperature).unwrap_or(Air::ROOM);
        RangerSettings { kind: self.kind, air, cycle: sonar.timing.cycle }
    }

    fn check(&self, sonar: &RangerParameters) -> Result<(), RobotConfigError> {
        if let Some(servo) = self.servo_settings(sonar) {
            let [one, other] = servo.pulses;
            let calibration = Calibration::new(one, other);
            require("servo_pulses", calibration.is_ok(), "two pulses with two bearings")?;
            let fits = servo.fits_its_frame();
            require("servo_pulses", fits, "within the servo's frame at both limits of the servo")?;
        }
        let PingTiming { schedule, servo, cycle } = sonar.timing;
        let period = if let PingSchedule::Every(period) = schedule { period } else { cycle };
        let times = [period, cycle, servo.frame, servo.sixty_degrees, servo.settle];
        require(
            "sonar.timing",
            times.iter().all(|time| *time <= LONGEST_TIME),
            "at most 1 h each",
        )?;
        let air = Air::at(self.temperature);
        require("ranger.temperature", air.is_ok(), "between -40 and 85 degrees Celsius")
    }
}

/// In which of three situations the motor driver stays enabled while the loop runs. While it does not run, the motors
/// are off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotorPolicy {
    /// With the verdict [`Lost`](sonarfix::health::Verdict::Lost).
    pub lost: bool,
    /// Without odometry for more than [`DEGRADED_WITHOUT_ODOMETRY`].
    pub dead_encoder: bool,
    /// Without a frame over the link for [`Self::link_timeout`].
    pub lost_link: bool,
    /// Time without a frame after which the link counts as lost.
    pub link_timeout: Duration,
}

impl MotorPolicy {
    /// Off without odometry: how far the robot rolls is unknown, and so is when to stop. On with the verdict `Lost`,
    /// because a robot relocalizes by driving, and without a link, because an autonomous robot has none.
    pub const DEFAULT: Self = Self {
        lost: true,
        dead_encoder: false,
        lost_link: true,
        link_timeout: Duration::from_ticks(2_000_000),
    };

    /// Whether the motors of a running robot are enabled at `now`. `heard`: when the last frame arrived over the link.
    #[must_use]
    pub fn permits(&self, localizer: &Localizer, now: Instant, heard: Instant) -> bool {
        let has_odometry = since(now, localizer.time()) <= DEGRADED_WITHOUT_ODOMETRY;
        let is_lost = localizer.health().verdict == Verdict::Lost;
        let has_link = since(now, heard) <= self.link_timeout;
        (self.dead_encoder || has_odometry)
            && (self.lost || !is_lost)
            && (self.lost_link || has_link)
    }
}

/// A field that [`RobotConfig::check`] refused, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RobotConfigError {
    /// The field: of the localizer's configuration as a path from [`Config`] (`"sonar.cone"`), of
    /// another one as a path from [`RobotConfig`].
    pub field: &'static str,
    /// What it must be.
    pub rule: &'static str,
}

impl core::fmt::Display for RobotConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} must be {}", self.field, self.rule)
    }
}

impl core::error::Error for RobotConfigError {}

impl From<ConfigError> for RobotConfigError {
    fn from(error: ConfigError) -> Self {
        Self { field: error.field, rule: error.rule }
    }
}

/// Why a board cannot be the robot that a configuration describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Unsupported {
    /// The board has no driver for a ranger of this kind.
    Ranger,
    /// The servo's driver or its PWM channel refuses limits, pulses or timing.
    Servo(SettingError),
    /// A wheel at full speed makes more edges from one reading to the next than half of what a
    /// counter of the board holds, so that its direction would be ambiguous.
    Counter,
    /// The board has no gyro, or it does not respond.
    Gyro,
    /// The configuration has more rangers than the board.
    Rangers,
    /// The program of the board was built without a part that the configuration asks for.
    NotLinked(NotLinked),
}

impl core::fmt::Display for Unsupported {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Ranger => f.write_str("the board has no driver for the configured ranger"),
            Self::Servo(error) => write!(f, "the board cannot drive the configured servo: {error}"),
            Self::Counter => f.write_str(
                "a wheel at max_wheel_speed overruns the board's edge counter within an encoder_period",
            ),
            Self::Gyro => f.write_str("the configured gyro is missing or does not respond"),
            Self::Rangers => f.write_str("the configuration has more rangers than the board"),
            Self::NotLinked(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for Unsupported {}

impl RobotConfig {
    /// A robot with this localizer and the parts that most small robots have: 65 mm wheels with
    /// encoders of 1,496.6 edges a revolution, read every 100 ms, an HC-SR04, and a servo for which
    /// 1 ms and 2 ms are −45° and 45°. A start for one's own; the parts must be measured.
    ///
    /// ```
    /// use sonarfix::{config::{Config, ServoTiming}, geometry::units::{Metres, Radians}};
    /// use sonarfix_hal::config::RobotConfig;
    /// let mut config = RobotConfig::with_common_parts(Config::for_track_width(Metres(0.16)));
    /// config.localizer.rangers.first.timing.servo = ServoTiming::SG90;
    /// config.localizer.rangers.first.servo = (Radians(-1.5), Radians(1.5));
    /// assert!(config.check().is_ok());
    /// config.left_wheel.travel_per_edge = Metres(0.0);
    /// assert_eq!(config.check().unwrap_err().field, "left_wheel.travel_per_edge");
    /// ```
    #[must_use]
    pub fn with_common_parts(localizer: Config) -> Self {
        // 11 lines × 4 edges × 34.014 revolutions of the motor.
        let wheel = WheelConfig::of_diameter(Metres(0.065), 1_496.6);
        let pulse = |width, degrees| MeasuredPulse {
            width: Duration::from_ticks(width),
            bearing: Radians::from_degrees(degrees),
        };
        Self {
            localizer,
            right_wheel: wheel,
            left_wheel: wheel,
            encoder_period: Duration::from_ticks(100_000),
            rangers: Rangers::one(RangerConfig {
                kind: RangerKind::Pulse(PulseTiming::HC_SR04),
                temperature: Celsius(20.0),
                servo_pulses: [pulse(1_000, -45.0), pulse(2_000, 45.0)],
            }),
            motors: MotorPolicy::DEFAULT,
            start: StartPose::Known,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`RobotConfigError`] with the first field that breaks its rule.
    pub fn check(&self) -> Result<(), RobotConfigError> {
        self.localizer.check()?;
        let length = "a positive, finite length";
        require("right_wheel.travel_per_edge", self.right_wheel.geometry().is_ok(), length)?;
        require("left_wheel.travel_per_edge", self.left_wheel.geometry().is_ok(), length)?;
        let sampled =
            !self.encoder_period.is_zero() && self.encoder_period <= LONGEST_ENCODER_PERIOD;
        require("encoder_period", sampled, "longer than zero, and at most 1 s")?;
        let (models, drivers) = (&self.localizer.rangers, &self.rangers);
        let is_each = models.iter().count() == drivers.iter().count();
        require("rangers", is_each, "one for each of localizer.rangers")?;
        for ((_, model), (_, driver)) in models.iter().zip(drivers.iter()) {
            driver.check(model)?;
            let is_shared = driver.temperature == drivers.first.temperature;
            require("rangers.temperature", is_shared, "that of the first ranger")?;
        }
        let timeout = self.motors.link_timeout;
        let ends = !timeout.is_zero() && timeout <= LONGEST_TIME;
        require("motors.link_timeout", ends, "longer than zero, and at most 1 h")?;
        let region = self.start.region().is_none_or(|region| region.is_valid());
        require("start.region", region, "a rectangle from its smaller to its larger coordinates")?;
        self.check_search_motion()
    }

    /// The sonar of a robot that drives ahead must turn ahead, and to both sides.
    fn check_search_motion(&self) -> Result<(), RobotConfigError> {
        let Some(SearchMotion { kind, bumper }) = self.start.motion() else { return Ok(()) };
        let is_length = bumper.0 > 0.0 && bumper.is_finite();
        require("start.motion.bumper", is_length, "a positive, finite length")?;
        let (right, left) = self.localizer.rangers.first.servo;
        let is_wide = right.0 <= -LEAST_SWEEP && left.0 >= LEAST_SWEEP;
        let can_move = kind == SearchMotionKind::Spin || is_wide;
        let rule = "\"spin\" with a servo that does not reach 45 degrees to both sides";
        require("start.motion.kind", can_move, rule)
    }

    /// The geometry of both wheels.
    ///
    /// # Errors
    /// [`GeometryError`], which [`Self::check`] rules out.
    pub fn wheels(&self) -> Result<Wheels, GeometryError> {
        Ok(Wheels { right: self.right_wheel.geometry()?, left: self.left_wheel.geometry()? })
    }

    /// A ranger and its drivers; `None` if the robot has no such one.
    #[must_use]
    pub fn ranger_of(&self, ranger: RangerId) -> Option<(&RangerParameters, &RangerConfig)> {
        self.localizer.rangers.get(ranger).zip(self.rangers.get(ranger))
    }

    /// The settings of the first ranger's servo; `None` without a servo.
    #[must_use]
    pub fn servo_settings(&self) -> Option<ServoSettings> {
        self.rangers.first.servo_settings(&self.localizer.rangers.first)
    }

    /// The settings of the first ranger's driver.
    #[must_use]
    pub fn ranger_settings(&self) -> RangerSettings {
        self.rangers.first.settings(&self.localizer.rangers.first)
    }

    /// Whether this program links all parts that the robot uses.
    ///
    /// # Errors
    /// [`NotLinked`] with the first that it does not link.
    pub fn check_linked(&self) -> Result<(), NotLinked> {
        self.check_features(Feature::is_linked)
    }

    /// Checks that a program with these features has every part that the robot needs.
    ///
    /// # Errors
    /// [`NotLinked`], by the first part that it lacks.
    pub fn check_features(&self, is_linked: impl Fn(Feature) -> bool) -> Result<(), NotLinked> {
        let missing = Feature::ALL.into_iter().filter(|feature| !is_linked(*feature));
        let mut asked = missing.filter(|feature| self.uses(*feature));
        asked.next().map_or(Ok(()), |feature| Err(NotLinked(feature)))
    }

    /// Whether the robot uses a part. The configuration does not say whether measurements come from outside.
    fn uses(&self, feature: Feature) -> bool {
        let localizer = &self.localizer;
        match feature {
            Feature::Light => {
                localizer.rangers.iter().any(|(_, sonar)| sonar.ranging != Ranging::Sound)
            }
            Feature::Gyro => localizer.gyro.is_some(),
            Feature::Rangers => localizer.rangers.are_several(),
            Feature::Absolute => false,
            Feature::Drive => self.start.motion().is_some(),
            Feature::Informative => localizer.policy == Policy::Informative,
            Feature::Mount => localizer.prior.mount.0 > 0.0,
            Feature::Search => self.start.is_unknown(),
        }
    }
}

fn require(field: &'static str, holds: bool, rule: &'static str) -> Result<(), RobotConfigError> {
    if holds { Ok(()) } else { Err(RobotConfigError { field, rule }) }
}
