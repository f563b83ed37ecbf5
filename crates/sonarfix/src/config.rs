//! Everything that can be set, in one place, checked once.
//!
//! # Non-finite policy
//! [`Config::check`] refuses NaN and infinity in every field;
//! [`Localizer::new`](crate::localizer::Localizer::new) calls it.

use crate::motion::Drive;
use crate::pose::Point;
use crate::range::RangeNoise;
use crate::units::{Duration, Metres, MetresPerSecond, PerRootMetre, Radians};

/// The sonar and the servo that carries it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sonar {
    /// Where the sonar turns, in the robot frame.
    pub mount: Point,
    /// The rightmost and leftmost bearing that the servo reaches, relative to the robot's
    /// heading; −π and π for one that turns all the way.
    pub servo: (Radians, Radians),
    /// Half of the cone in which a wall's perpendicular echo is heard.
    pub cone: Radians,
    /// The shortest range it reports.
    pub min_range: Metres,
    /// The longest range it reports.
    pub max_range: Metres,
    /// Noise of a range.
    pub noise: RangeNoise,
    /// How long a look takes.
    pub timing: Timing,
}

/// How often the sonar looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Rhythm {
    /// Once every such period; the servo starts on the dot, the ping follows when it has
    /// settled. A look that takes longer than the period delays the next to the dot after it.
    Every(Duration),
    /// As fast as servo and ranger allow.
    AsFastAsPossible,
}

/// How fast a servo moves. Take the times from its datasheet or better from a film of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pace {
    /// Period of the pulses. A new width takes effect with the next pulse, so up to one frame
    /// passes before the servo hears of it: a whole one is always reckoned with.
    pub frame: Duration,
    /// Time for a turn of 60°, as datasheets give it.
    pub sixty_degrees: Duration,
    /// Time from its arrival until it has stopped shaking.
    pub settle: Duration,
}

impl Pace {
    /// A servo that is at once where it is told to be: the paper's.
    pub const INSTANT: Self = Self {
        frame: Duration::from_ticks(0),
        sixty_degrees: Duration::from_ticks(0),
        settle: Duration::from_ticks(0),
    };

    /// SG90: 0.10–0.12 s/60° by its datasheets (4.8 V), 50 Hz frame; settling 30–60 ms is our
    /// assumption.
    pub const SG90: Self = Self {
        frame: Duration::from_ticks(20_000),
        sixty_degrees: Duration::from_ticks(120_000),
        settle: Duration::from_ticks(60_000),
    };

    /// MG996R: 0.17 s/60° by its datasheet (4.8 V), 50 Hz frame; settling as assumed for SG90.
    pub const MG996R: Self = Self {
        frame: Duration::from_ticks(20_000),
        sixty_degrees: Duration::from_ticks(170_000),
        settle: Duration::from_ticks(60_000),
    };
}

/// How long a look takes: what the choice of a wall reckons with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Timing {
    /// How often the sonar looks.
    pub rhythm: Rhythm,
    /// How fast the servo turns it.
    pub servo: Pace,
    /// Least time from ping to ping, so that old echoes are not taken for new ones.
    pub cycle: Duration,
}

impl Timing {
    /// The paper's: a look a second, by a servo that takes no time.
    pub const EVERY_SECOND: Self = Self {
        rhythm: Rhythm::Every(Duration::from_ticks(1_000_000)),
        servo: Pace::INSTANT,
        cycle: Duration::from_ticks(0),
    };
}

/// How sure the filter is of the robot's calibration before the first range: standard deviations
/// of the systematic errors, whose estimates start at zero.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CalibrationPrior {
    /// Of the right wheel's scale error, dimensionless.
    pub scale_right: f32,
    /// Of the left wheel's scale error, dimensionless.
    pub scale_left: f32,
    /// Of the track width's error.
    pub track_width: Metres,
    /// Of the ranger's scale error, dimensionless. Zero: not estimated (the paper's case).
    pub range_scale: f32,
}

/// Which ranges are believed, and which walls are looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Trust {
    /// The gate: a range is refused if its innovation exceeds this many standard deviations of
    /// the innovation (ν² > gate² S). In standard deviations, not their square.
    pub gate: f32,
    /// A wall counts as one to look at only if it stays so when the pose is wrong by this many of
    /// its standard deviations.
    pub confidence: f32,
    /// Down-weight instead of reject: a range beyond the gate, but within this many standard
    /// deviations of the innovation, is taken with its noise raised until it lies at the gate.
    /// Zero: none is, all beyond the gate are refused.
    pub outer_gate: f32,
    /// A range shorter than expected by more than this many standard deviations *of its own noise*
    /// may come from something that the map does not know: it is taken with its noise raised until
    /// it is that many. Zero: a short range is believed like a long one.
    pub short: f32,
    /// How much doubt of the pose a range beyond the gate adds while the verdict is
    /// [`Lost`](crate::health::Verdict::Lost): this standard deviation to x and to y, up to
    /// [`REOPENS`] times that, and as many radians to the heading, up to a quarter of the cone. Zero:
    /// none.
    pub reopen: Metres,
    /// How far the robot may roll without a range taken and still be called tracking.
    pub stale: Metres,
    /// The deviation of the position, in its worst direction, above which the robot is not called
    /// tracking.
    pub doubtful: Metres,
}

impl Default for Trust {
    /// What suits a robot in a room with things that its map does not know.
    fn default() -> Self {
        Self {
            gate: 4.0,
            confidence: 3.0,
            outer_gate: 0.0,
            short: 2.0,
            reopen: Metres(0.02),
            stale: Metres(5.0),
            doubtful: Metres(0.5),
        }
    }
}

/// How many times [`Trust::reopen`] the position's deviation of a lost robot grows to.
pub const REOPENS: f32 = 10.0;

/// How the wall is chosen among those that count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Policy {
    /// The nearest: the paper's choice, because a sonar's noise grows with range.
    Nearest,
    /// The one whose range is expected to lower the variance of the position most, for the time
    /// that it takes.
    Informative,
}

/// What else than the position [`Policy::Informative`] wants to know: how many metres of position
/// an error of it is worth. Zero: nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Weights {
    /// Metres for each radian of heading: a lever arm.
    pub heading: Metres,
    /// Metres for each 100 % of a wheel's scale error: the way on which it will be felt.
    pub wheels: Metres,
}

/// The configuration of a localizer.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Config {
    /// The wheels.
    pub drive: Drive,
    /// The fastest a wheel can roll. A travel beyond it is a fault of an encoder.
    pub max_wheel_speed: MetresPerSecond,
    /// The sonar.
    pub sonar: Sonar,
    /// What is known of the robot's systematic errors.
    pub prior: CalibrationPrior,
    /// Gates and margins.
    pub trust: Trust,
    /// Which wall to look at.
    pub policy: Policy,
    /// What else than the position is worth a look.
    pub weights: Weights,
}

/// A field that [`Config::check`] refused, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ConfigError {
    /// The field, as a path from [`Config`]: `"sonar.cone"`.
    pub field: &'static str,
    /// What it must be.
    pub rule: &'static str,
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} must be {}", self.field, self.rule)
    }
}

impl core::error::Error for ConfigError {}

fn positive(field: &'static str, value: f32) -> Result<(), ConfigError> {
    require(field, value > 0.0 && value.is_finite(), "positive and finite")
}

fn not_negative(field: &'static str, value: f32) -> Result<(), ConfigError> {
    require(field, value >= 0.0 && value.is_finite(), "zero or positive, and finite")
}

fn require(field: &'static str, holds: bool, rule: &'static str) -> Result<(), ConfigError> {
    if holds { Ok(()) } else { Err(ConfigError { field, rule }) }
}

impl Config {
    /// A small differential-drive robot with an ideal ranger, as a start for one's own: every
    /// noise is moderate, the range scale is not estimated, the servo turns all the way and takes
    /// no time, a look is taken every second.
    ///
    /// ```
    /// use sonarfix::config::Config;
    /// use sonarfix::units::Metres;
    /// let mut config = Config::for_track_width(Metres(0.16));
    /// config.sonar.max_range = Metres(3.0);
    /// assert!(config.check().is_ok());
    /// config.sonar.max_range = Metres(f32::NAN);
    /// assert_eq!(config.check().unwrap_err().field, "sonar.max_range");
    /// ```
    #[must_use]
    pub fn for_track_width(track_width: Metres) -> Self {
        let half_turn = Radians(core::f32::consts::PI);
        Self {
            drive: Drive {
                track_width,
                // A good robot on a hard floor: `0.5–20 mm/√m` is what recordings show.
                wheel_noise: PerRootMetre(Metres(0.001)),
                scale_walk: PerRootMetre(1e-5),
                track_width_walk: PerRootMetre(Metres(1e-5)),
            },
            max_wheel_speed: MetresPerSecond(2.0),
            sonar: Sonar {
                mount: Point::new(0.0, 0.0),
                servo: (-half_turn, half_turn),
                cone: Radians::from_degrees(15.0),
                min_range: Metres(0.05),
                max_range: Metres(4.0),
                noise: RangeNoise { floor: Metres(0.005), per_metre: 0.002 },
                timing: Timing::EVERY_SECOND,
            },
            prior: CalibrationPrior {
                scale_right: 0.01,
                scale_left: 0.01,
                track_width: track_width * 0.03,
                range_scale: 0.0,
            },
            trust: Trust::default(),
            policy: Policy::Informative,
            weights: Weights::default(),
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`ConfigError`] with the first field that breaks its rule.
    pub fn check(&self) -> Result<(), ConfigError> {
        self.check_drive()?;
        self.check_sonar()?;
        let prior = &self.prior;
        not_negative("prior.scale_right", prior.scale_right)?;
        not_negative("prior.scale_left", prior.scale_left)?;
        // They are held as mean and difference, which cannot say that one alone is exact.
        let one_is_exact = (prior.scale_right > 0.0) != (prior.scale_left > 0.0);
        require("prior.scale_left", !one_is_exact, "zero if prior.scale_right is, and only then")?;
        not_negative("prior.track_width", prior.track_width.0)?;
        let width = self.drive.track_width.0;
        let below_width = prior.track_width.0 < 0.5 * width;
        require("prior.track_width", below_width, "less than half the track width")?;
        not_negative("prior.range_scale", prior.range_scale)?;
        not_negative("weights.heading", self.weights.heading.0)?;
        not_negative("weights.wheels", self.weights.wheels.0)?;
        self.check_trust()
    }

    fn check_trust(&self) -> Result<(), ConfigError> {
        let trust = &self.trust;
        positive("trust.gate", trust.gate)?;
        not_negative("trust.confidence", trust.confidence)?;
        not_negative("trust.outer_gate", trust.outer_gate)?;
        let is_outer = trust.outer_gate <= 0.0 || trust.outer_gate >= trust.gate;
        require("trust.outer_gate", is_outer, "zero, or not below trust.gate")?;
        not_negative("trust.short", trust.short)?;
        not_negative("trust.reopen", trust.reopen.0)?;
        positive("trust.stale", trust.stale.0)?;
        positive("trust.doubtful", trust.doubtful.0)
    }

    fn check_drive(&self) -> Result<(), ConfigError> {
        positive("drive.track_width", self.drive.track_width.0)?;
        // Without any, P would be tied ever more sharply, and then by rounding alone.
        positive("drive.wheel_noise", self.drive.wheel_noise.0.0)?;
        not_negative("drive.scale_walk", self.drive.scale_walk.0)?;
        not_negative("drive.track_width_walk", self.drive.track_width_walk.0.0)?;
        positive("max_wheel_speed", self.max_wheel_speed.0)
    }

    fn check_sonar(&self) -> Result<(), ConfigError> {
        let sonar = &self.sonar;
        require("sonar.mount", sonar.mount.is_finite(), "finite")?;
        let (right, left) = sonar.servo;
        let half_turn = core::f32::consts::PI;
        let in_order = right.0 >= -half_turn && right.0 < left.0 && left.0 <= half_turn;
        require("sonar.servo", in_order, "a rightmost below a leftmost bearing, within ±180°")?;
        let narrow = sonar.cone.0 > 0.0 && sonar.cone.0 < 0.5 * half_turn;
        require("sonar.cone", narrow, "between 0 and 90° (half of the cone)")?;
        not_negative("sonar.min_range", sonar.min_range.0)?;
        positive("sonar.max_range", sonar.max_range.0)?;
        let wide = sonar.max_range > sonar.min_range;
        require("sonar.max_range", wide, "greater than sonar.min_range")?;
        positive("sonar.noise.floor", sonar.noise.floor.0)?;
        not_negative("sonar.noise.per_metre", sonar.noise.per_metre)?;
        let no_time = sonar.timing.rhythm == Rhythm::Every(Duration::from_ticks(0));
        require("sonar.timing.rhythm", !no_time, "a period that is not zero")
    }
}
