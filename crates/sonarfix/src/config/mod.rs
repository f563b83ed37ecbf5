//! The parameters of a localizer, checked once.
//!
//! The structures are `#[non_exhaustive]`: start from [`Config::for_track_width`] or a `Default`, and
//! set the public fields.
//!
//! # Non-finite policy
//! [`Config::check`] refuses NaN and infinity in every field;
//! [`Localizer::new`](crate::localizer::Localizer::new) calls it.

use crate::filter::motion::Drive;
use crate::geometry::numeric::at_least;
use crate::geometry::units::{Duration, Metres, MetresPerSecond, PerRootMetre, Radians};
use crate::sensor::gyro::GyroParameters;

pub use crate::sensor::echo::EchoParameters;
pub use crate::sensor::ranger::{
    LightBeam, LightLinked, PingSchedule, PingTiming, RangerId, RangerParameters, Ranging,
    ServoTiming,
};
pub use crate::sensor::rangers::{MAX_RANGERS, Rangers, TooMany};

/// Largest angle of incidence of light: beyond it the range along the beam diverges.
const MAX_INCIDENCE: Radians = Radians(75.0 * core::f32::consts::PI / 180.0);
/// Widest spot of light that is taken for a beam.
const MAX_SPOT: Radians = Radians(20.0 * core::f32::consts::PI / 180.0);

/// Uncertainty of the calibration before the first range: standard deviations of the systematic
/// errors, whose estimates start at zero. The default is an exact robot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct CalibrationPrior {
    /// Of the right wheel's scale error, dimensionless.
    pub scale_right: f32,
    /// Of the left wheel's scale error, dimensionless.
    pub scale_left: f32,
    /// Of the right wheel's scale error less that of the left, dimensionless: wheels of one type are alike, however wrong
    /// their nominal diameter is. At least `1.1 |σ_R − σ_L|` and at most `√(σ_R² + σ_L²)` of the two above, else the nearest of
    /// these is taken; the latter means independent errors, as `None` does (`docs/model.md`, eq. 48).
    pub scale_difference: Option<f32>,
    /// Of the track width's error.
    pub track_width: Metres,
    /// Of the ranger's scale error, dimensionless. Zero: not estimated, as in the paper.
    pub range_scale: f32,
    /// Of each coordinate of the mount of a ranger. That of the first is estimated, those of others are white noise of their ranges.
    /// Zero: exact; other values only with the feature `mount`, else [`Config::check`] refuses them.
    pub mount: Metres,
}

impl CalibrationPrior {
    /// Wheels known to 1 %, a track width known to 3 %, an exact ranger; with the feature `mount` its place is known to 5 mm, as a
    /// ruler measures it.
    #[must_use]
    pub fn for_track_width(track_width: Metres) -> Self {
        Self {
            scale_right: 0.01,
            scale_left: 0.01,
            scale_difference: None,
            track_width: track_width * 0.03,
            range_scale: 0.0,
            mount: if cfg!(feature = "mount") { Metres(0.005) } else { Metres(0.0) },
        }
    }

    // ===== Eq. (48) =====
    /// The deviation of the right wheel's scale error less that of the left, for these deviations of both. `None`: the errors are
    /// independent.
    #[must_use]
    pub fn difference_of(&self, right: f32, left: f32) -> Option<f32> {
        let difference = at_least(self.scale_difference?, 1.1 * (right - left).abs());
        (difference * difference < right * right + left * left).then_some(difference)
    }
}

/// Which ranges are used with which noise, and which walls are measured.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct GatingParameters {
    /// A wall is measured only if no other wall of the map can return an earlier echo, even if the
    /// position and the heading are wrong by this many of their standard deviations. If no wall
    /// passes, the margins are dropped.
    pub confidence: f32,
    /// Covariance inflation by a ping without an echo of its wall while the verdict is
    /// [`Lost`](crate::health::Verdict::Lost): this standard deviation is added to x and to y, up to
    /// [`MAX_INFLATION_STEPS`] times its value, and as many radians to the heading, up to 0.26. Zero: no
    /// inflation.
    pub inflation: Metres,
    /// Distance without a range used above which the verdict is not `Tracking`.
    pub max_distance_without_fix: Metres,
    /// Standard deviation of the position, in its worst direction, above which the verdict is not
    /// `Tracking`. A quarter of a metre by default: the position is then within half a metre with a probability of 95 %.
    pub max_position_deviation: Metres,
}

impl Default for GatingParameters {
    /// For a robot in a room with unmapped objects.
    fn default() -> Self {
        Self {
            confidence: 1.0,
            inflation: Metres(0.1),
            max_distance_without_fix: Metres(5.0),
            max_position_deviation: Metres(0.25),
        }
    }
}

/// Largest position deviation of a lost robot, in units of [`GatingParameters::inflation`].
pub const MAX_INFLATION_STEPS: f32 = 10.0;

/// How the wall is chosen among those that can be measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Policy {
    /// The nearest, as in the paper, because the noise of a sonar grows with the range.
    Nearest,
    /// The one with the largest expected decrease of the position variance per time. Only with the feature `informative`;
    /// [`Config::check`] refuses it otherwise.
    Informative,
}

impl Policy {
    /// Whether the expected gain decides. Without the feature `informative` the compiler knows that it does not.
    #[must_use]
    #[inline]
    pub fn is_informative(self) -> bool {
        cfg!(feature = "informative") && self == Self::Informative
    }
}

impl Default for Policy {
    /// The recommended one of those that are linked.
    fn default() -> Self {
        if cfg!(feature = "informative") { Self::Informative } else { Self::Nearest }
    }
}

/// Weights of other states than the position for [`Policy::Informative`]: metres of position error that
/// an error of the state is worth. Zero: not weighted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Weights {
    /// Metres per radian of heading: a lever arm.
    pub heading: Metres,
    /// Metres per unit of a wheel's scale error: the distance over which it takes effect.
    pub wheels: Metres,
}

impl Weights {
    /// Whether anything but the position has a weight.
    pub(crate) fn are_set(self) -> bool {
        self.heading.0.abs() > 0.0 || self.wheels.0.abs() > 0.0
    }
}

/// The configuration of a localizer.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Config {
    /// The wheels.
    pub drive: Drive,
    /// Fastest speed of a wheel; a faster travel is a fault of an encoder.
    pub max_wheel_speed: MetresPerSecond,
    /// The rangers. They share one ping schedule: there is one ping at a time.
    pub rangers: Rangers<RangerParameters>,
    /// Uncertainty of the robot's systematic errors.
    pub prior: CalibrationPrior,
    /// Gates and margins.
    pub gating: GatingParameters,
    /// What a ping returns besides the range of its wall.
    pub echo: EchoParameters,
    /// Which wall is measured next.
    pub policy: Policy,
    /// Weights of other states than the position.
    pub weights: Weights,
    /// The gyro, if the robot has one.
    pub gyro: Option<GyroParameters>,
}

/// A field that [`Config::check`] refused, and its rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct ConfigError {
    /// The field, as a path from [`Config`]; that of a ranger begins with `sonar`, as in a robot file: `"sonar.cone"`.
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

/// Largest value of a number, in its unit of this module: products of four remain far below the largest `f32`.
const LARGEST: f32 = 10_000.0;

/// Checks fields, each with its value, by one rule.
#[inline(never)]
fn positive(fields: &[&'static str], values: &[f32]) -> Result<(), ConfigError> {
    let is_wrong = |value: f32| !(value > 0.0 && value <= LARGEST);
    first(fields, values, is_wrong, "positive, and at most 10,000")
}

#[inline(never)]
fn not_negative(fields: &[&'static str], values: &[f32]) -> Result<(), ConfigError> {
    let is_wrong = |value: f32| !(0.0..=LARGEST).contains(&value);
    first(fields, values, is_wrong, "zero or positive, and at most 10,000")
}

/// The first field whose value is wrong.
fn first(
    fields: &[&'static str],
    values: &[f32],
    is_wrong: impl Fn(f32) -> bool,
    rule: &'static str,
) -> Result<(), ConfigError> {
    match fields.iter().zip(values).find(|&(_, &value)| is_wrong(value)) {
        Some((field, _)) => Err(ConfigError { field, rule }),
        None => Ok(()),
    }
}

fn require(field: &'static str, holds: bool, rule: &'static str) -> Result<(), ConfigError> {
    if holds { Ok(()) } else { Err(ConfigError { field, rule }) }
}

impl Config {
    /// The configuration of a small differential-drive robot with an ideal ranger, to be adapted: moderate
    /// noise, range scale not estimated, [`RangerParameters::default`].
    ///
    /// ```
    /// use sonarfix::config::Config;
    /// use sonarfix::geometry::units::Metres;
    /// let mut config = Config::for_track_width(Metres(0.16));
    /// config.rangers.first.max_range = Metres(3.0);
    /// assert!(config.check().is_ok());
    /// config.rangers.first.max_range = Metres(f32::NAN);
    /// assert_eq!(config.check().unwrap_err().field, "sonar.max_range");
    /// ```
    #[must_use]
    pub fn for_track_width(track_width: Metres) -> Self {
        Self {
            drive: Drive {
                track_width,
                // A good robot on a hard floor; recordings show 0.5–20 mm/√m.
                wheel_noise: PerRootMetre(Metres(0.001)),
                scale_walk: PerRootMetre(1e-5),
                track_width_walk: PerRootMetre(Metres(1e-5)),
            },
            max_wheel_speed: MetresPerSecond(2.0),
            rangers: Rangers::one(RangerParameters::default()),
            prior: CalibrationPrior::for_track_width(track_width),
            gating: GatingParameters::default(),
            echo: EchoParameters::default(),
            policy: Policy::default(),
            weights: Weights::default(),
            gyro: None,
        }
    }

    /// What the mount of a ranger adds to the variance of its ranges, m²: that of a further ranger is not estimated.
    pub(crate) fn mount_noise(&self, ranger: RangerId) -> f32 {
        let is_estimated = MAX_RANGERS == 1 || ranger == RangerId::FIRST;
        if is_estimated { 0.0 } else { self.prior.mount.0 * self.prior.mount.0 }
    }

    /// Sets the ping schedule, which all rangers share.
    pub fn set_ping_schedule(&mut self, schedule: PingSchedule) {
        self.rangers.iter_mut().for_each(|ranger| ranger.timing.schedule = schedule);
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`ConfigError`] with the first field that breaks its rule.
    pub fn check(&self) -> Result<(), ConfigError> {
        self.check_drive()?;
        self.check_rangers()?;
        let prior = &self.prior;
        let weights = &self.weights;
        not_negative(
            &[
                "prior.scale_right",
                "prior.scale_left",
                "prior.track_width",
                "prior.range_scale",
                "prior.mount",
                "weights.heading",
                "weights.wheels",
            ],
            &[
                prior.scale_right,
                prior.scale_left,
                prior.track_width.0,
                prior.range_scale,
                prior.mount.0,
                weights.heading.0,
                weights.wheels.0,
            ],
        )?;
        // The filter holds mean and difference, which cannot represent that one alone is exact.
        let one_is_exact = (prior.scale_right > 0.0) != (prior.scale_left > 0.0);
        require("prior.scale_left", !one_is_exact, "zero if prior.scale_right is, and only then")?;
        let difference = prior.scale_difference;
        let is_positive =
            difference.is_none_or(|difference| difference > 0.0 && difference <= LARGEST);
        require("prior.scale_difference", is_positive, "positive, and at most 10,000, if given")?;
        let is_linked = cfg!(feature = "mount") || prior.mount.0 <= 0.0;
        require("prior.mount", is_linked, "zero: this program was built without `mount`")?;
        let width = self.drive.track_width.0;
        let below_width = prior.track_width.0 < 0.5 * width;
        require("prior.track_width", below_width, "less than half the track width")?;
        let is_linked = self.policy == Policy::Nearest || self.policy.is_informative();
        require("policy", is_linked, "`nearest`: this program was built without `informative`")?;
        self.check_gating()?;
        self.check_echo()?;
        self.check_gyro()
    }

    fn check_gyro(&self) -> Result<(), ConfigError> {
        let Some(gyro) = &self.gyro else {
            return Ok(());
        };
        positive(
            &["gyro.range", "gyro.noise", "gyro.bias"],
            &[gyro.range.0, gyro.noise.0.0, gyro.bias.0],
        )?;
        not_negative(&["gyro.bias_walk"], &[gyro.bias_walk.0.0])?;
        let known = gyro.scale >= 0.0 && gyro.scale <= 0.5;
        require("gyro.scale", known, "between 0 and 50 %")?;
        let period = gyro.period.ticks();
        require("gyro.period", (1_000..=50_000).contains(&period), "between 1 ms and 50 ms")
    }

    fn check_gating(&self) -> Result<(), ConfigError> {
        let gating = &self.gating;
        not_negative(
            &["gating.confidence", "gating.inflation"],
            &[gating.confidence, gating.inflation.0],
        )?;
        positive(
            &["gating.max_distance_without_fix", "gating.max_position_deviation"],
            &[gating.max_distance_without_fix.0, gating.max_position_deviation.0],
        )
    }

    fn check_echo(&self) -> Result<(), ConfigError> {
        let echo = &self.echo;
        not_negative(
            &[
                "echo.missed",
                "echo.short",
                "echo.long",
                "echo.free_path",
                "echo.map_accuracy",
                "echo.late",
                "echo.late_per_radian",
                "echo.rim",
                "echo.sure_within",
            ],
            &[
                echo.missed,
                echo.short,
                echo.long,
                echo.free_path.0,
                echo.map_accuracy.0,
                echo.late.0,
                echo.late_per_radian.0,
                echo.rim.0,
                echo.sure_within.0,
            ],
        )?;
        let some_are_right = echo.missed + echo.short + echo.long < 1.0;
        require("echo.missed", some_are_right, "below 1 together with echo.short and echo.long")?;
        let half = echo.half_angle.0;
        let narrow = (0.0..0.5 * core::f32::consts::PI).contains(&half);
        require("echo.half_angle", narrow, "between 0 and 90°")
    }

    fn check_drive(&self) -> Result<(), ConfigError> {
        let drive = &self.drive;
        // Without noise of the wheels, correlations in P would grow until rounding makes it indefinite.
        positive(
            &["drive.track_width", "drive.wheel_noise", "max_wheel_speed"],
            &[drive.track_width.0, drive.wheel_noise.0.0, self.max_wheel_speed.0],
        )?;
        not_negative(
            &["drive.scale_walk", "drive.track_width_walk"],
            &[drive.scale_walk.0, drive.track_width_walk.0.0],
        )
    }

    fn check_rangers(&self) -> Result<(), ConfigError> {
        for (_, ranger) in self.rangers.iter() {
            let is_shared = ranger.timing.schedule == self.rangers.first.timing.schedule;
            require("rangers.timing.schedule", is_shared, "that of the first ranger")?;
            check_ranger(ranger)?;
        }
        Ok(())
    }
}

/// Checks the fields of one ranger.
fn check_ranger(sonar: &RangerParameters) -> Result<(), ConfigError> {
    let is_near = |offset: f32| (-LARGEST..=LARGEST).contains(&offset);
    let is_near = is_near(sonar.mount.x.0) && is_near(sonar.mount.y.0);
    require("sonar.mount", is_near, "at most 10,000 m from the middle of the axle")?;
    let (right, left) = sonar.servo;
    let half_turn = core::f32::consts::PI;
    let in_order = right.0 < left.0 || sonar.fixed_bearing().is_some();
    let in_order = in_order && right.0 >= -half_turn && left.0 <= half_turn;
    require("sonar.servo", in_order, "a rightmost below a leftmost bearing, within ±180°")?;
    let narrow = sonar.cone.0 > 0.0 && sonar.cone.0 < 0.5 * half_turn;
    require("sonar.cone", narrow, "between 0 and 90° (half of the cone)")?;
    positive(&["sonar.max_range", "sonar.noise.floor"], &[sonar.max_range.0, sonar.noise.floor.0])?;
    not_negative(
        &["sonar.min_range", "sonar.noise.per_metre"],
        &[sonar.min_range.0, sonar.noise.per_metre],
    )?;
    let wide = sonar.max_range > sonar.min_range;
    require("sonar.max_range", wide, "greater than sonar.min_range")?;
    let no_time = sonar.timing.schedule == PingSchedule::Every(Duration::from_ticks(0));
    require("sonar.timing.schedule", !no_time, "a period that is not zero")?;
    let Ranging::Light(beam) = sonar.ranging else { return Ok(()) };
    let oblique = sonar.cone <= MAX_INCIDENCE;
    require("sonar.cone", oblique, "at most 75° (largest angle of incidence of light)")?;
    let narrow = beam.spot.0 > 0.0 && beam.spot.0 <= MAX_SPOT.0;
    require("sonar.ranging.spot", narrow, "between 0 and 20° (half of the beam)")?;
    not_negative(&["sonar.ranging.pointing"], &[beam.pointing.0])
}
