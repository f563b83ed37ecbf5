//! The localizer: filter, map, aim and health joined. It is told wheel travels and ranges, and
//! tells where the robot is and where to look next. It owns no hardware and reads no clock.
//!
//! # Non-finite policy
//! NaN or infinity in an argument is a typed error or a [`Fix::Refused`], and not one bit of the
//! localizer's estimate has changed.

use crate::aim::{self, Aim, NoAim, Unfit, Viewpoint};
use crate::config::{Config, ConfigError};
use crate::ekf::{Ekf, EkfError, Innovation, State};
use crate::health::Health;
use crate::map::{Map, WallId};
use crate::motion::WheelTravel;
use crate::pose::Pose;
use crate::units::{Instant, Metres, Radians};

/// Where the robot starts, and how sure that is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Start {
    /// The pose.
    pub pose: Pose,
    /// Standard deviation of x and of y.
    pub position_deviation: Metres,
    /// Standard deviation of the heading.
    pub heading_deviation: Radians,
}

/// Why a localizer could not be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StartError {
    /// The configuration breaks a rule.
    Config(ConfigError),
    /// The start pose or its deviations are not finite or are negative.
    Start(EkfError),
}

impl core::fmt::Display for StartError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Config(error) => write!(f, "configuration: {error}"),
            Self::Start(error) => write!(f, "start pose: {error}"),
        }
    }
}

impl core::error::Error for StartError {}

/// Why a wheel travel was refused. It is not part of the estimate then: a caller that believes in
/// it adds it to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OdometryError {
    /// The time is before that of an earlier call.
    TimeRanBackwards,
    /// A wheel rolled although no time has passed.
    NoTimePassed,
    /// A wheel rolled faster than
    /// [`max_wheel_speed`](crate::config::Config::max_wheel_speed).
    TooFast,
    /// The filter refused the travel.
    Filter(EkfError),
}

impl core::fmt::Display for OdometryError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TimeRanBackwards => f.write_str("the time is before that of an earlier call"),
            Self::NoTimePassed => f.write_str("a wheel rolled although no time has passed"),
            Self::TooFast => f.write_str("a wheel rolled faster than it can"),
            Self::Filter(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for OdometryError {}

/// What became of a range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub enum Fix {
    /// Inside the gate: state and covariance have moved.
    Accepted(Innovation),
    /// Outside the gate: the filter is unchanged.
    Gated(Innovation),
    /// Not a range to compare with anything: the filter is unchanged.
    Refused(Refusal),
}

/// Why a range was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Refusal {
    /// The range is NaN or infinite.
    NotFinite,
    /// No echo came.
    NoEcho,
    /// The range, or the one expected, is not one that the sonar can report.
    OutOfRange,
    /// The foot of the perpendicular no longer lies safely on the wall.
    FootOffWall,
    /// The beam no longer meets the wall squarely, or the heading is too uncertain to say.
    NotSquare,
    /// The map has no such wall.
    UnknownWall,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "the range is not finite",
            Self::NoEcho => "no echo",
            Self::OutOfRange => "out of the sonar's range",
            Self::FootOffWall => "the perpendicular's foot is not safely on the wall",
            Self::NotSquare => "the beam does not meet the wall squarely",
            Self::UnknownWall => "the map has no such wall",
        })
    }
}

impl From<Unfit> for Refusal {
    fn from(unfit: Unfit) -> Self {
        match unfit {
            Unfit::FootOffWall => Self::FootOffWall,
            Unfit::OutOfRange => Self::OutOfRange,
        }
    }
}

/// The localizer.
///
/// ```
/// use sonarfix::config::Config;
/// use sonarfix::localizer::{Fix, Localizer, Start};
/// use sonarfix::map::{Map, Wall};
/// use sonarfix::motion::WheelTravel;
/// use sonarfix::pose::{Point, Pose};
/// use sonarfix::units::{Instant, Metres, Radians};
///
/// // A room of 4 m × 3 m; the robot stands at (1, 1) and looks along x.
/// let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
/// let mut walls = Vec::new();
/// for ends in corners.windows(2) {
///     let (a, b) = (ends[0], ends[1]);
///     walls.push(Wall::new(Point::new(a.0, a.1), Point::new(b.0, b.1))?);
/// }
/// let start = Start {
///     pose: Pose::new(1.0, 1.0, Radians(0.0)),
///     position_deviation: Metres(0.05),
///     heading_deviation: Radians(0.02),
/// };
/// let config = Config::for_track_width(Metres(0.16));
/// let mut localizer = Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(0))?;
///
/// // 100 ms later the encoders say 2 cm; then the sonar looks where the localizer asks.
/// let now = Instant::from_ticks(100_000);
/// localizer.odometry(now, WheelTravel::new(0.02, 0.02))?;
/// let aim = localizer.aim()?;
/// let heard = aim.range + Metres(0.01);
/// assert!(matches!(localizer.fix(&aim, Some(heard)), Fix::Accepted(_)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Localizer<'m> {
    config: Config,
    map: Map<'m>,
    ekf: Ekf,
    health: Health,
    time: Instant,
    /// The wall that something seems to stand before, by the last turn: passed over once.
    spare: Option<WallId>,
    /// The wall that did not answer at the last turn.
    silent: Option<WallId>,
}

impl<'m> Localizer<'m> {
    /// A localizer at `start`, at the time `now`.
    ///
    /// # Errors
    /// [`StartError`], by what is wrong with an argument.
    pub fn new(
        config: Config,
        map: Map<'m>,
        start: Start,
        now: Instant,
    ) -> Result<Self, StartError> {
        let state = State {
            x: start.pose.x.0,
            y: start.pose.y.0,
            heading: start.pose.heading.radians().0,
            ..State::default()
        };
        let prior = config.prior;
        let deviation = State {
            x: start.position_deviation.0,
            y: start.position_deviation.0,
            heading: start.heading_deviation.0,
            scale_right: prior.scale_right,
            scale_left: prior.scale_left,
            track_width_error: prior.track_width.0,
            range_scale: prior.range_scale,
        };
        Self::resume(config, map, state, deviation, now)
    }

    /// A localizer that goes on from what an earlier one had learned, its calibration included.
    /// `deviation` holds the standard deviations of `state`, as far as they still hold after
    /// whatever happened since; the errors are taken as independent of each other. The prior of
    /// the configuration is not used.
    ///
    /// # Errors
    /// [`StartError`], by what is wrong with an argument.
    pub fn resume(
        config: Config,
        map: Map<'m>,
        state: State,
        deviation: State,
        now: Instant,
    ) -> Result<Self, StartError> {
        config.check().map_err(StartError::Config)?;
        let ekf = Ekf::new(config.drive, state, deviation).map_err(StartError::Start)?;
        Ok(Self {
            config,
            map,
            ekf,
            health: Health::default(),
            time: now,
            spare: None,
            silent: None,
        })
    }

    /// Takes the travel of both wheels since the last call, up to the time `now`: at every
    /// encoder tick, and once more at the instant an echo left the wall.
    ///
    /// # Errors
    /// [`OdometryError`], by what is wrong with the travel or its time; nothing has changed, the
    /// time included.
    pub fn odometry(&mut self, now: Instant, travel: WheelTravel) -> Result<(), OdometryError> {
        let elapsed =
            now.checked_duration_since(self.time).ok_or(OdometryError::TimeRanBackwards)?;
        if !travel.is_finite() {
            return Err(OdometryError::Filter(EkfError::NotFinite));
        }
        let fastest =
            if travel.right.abs() > travel.left.abs() { travel.right } else { travel.left };
        if elapsed.is_zero() && fastest.abs() > Metres(0.0) {
            return Err(OdometryError::NoTimePassed);
        }
        #[expect(clippy::cast_precision_loss, reason = "a limit, not an equation")]
        let seconds = elapsed.to_micros() as f32 * 1e-6;
        if fastest.abs().0 > self.config.max_wheel_speed.0 * seconds {
            return Err(OdometryError::TooFast);
        }
        self.ekf.predict(travel).map_err(OdometryError::Filter)?;
        self.time = now;
        Ok(())
    }

    /// Where the sonar should look next, by the policy of the configuration. A wall that
    /// something seems to stand before is passed over once, if another counts.
    ///
    /// # Errors
    /// [`NoAim`], by why there is nothing to look at.
    pub fn aim(&self) -> Result<Aim, NoAim> {
        aim::choose(&self.config, &self.map, &self.ekf, self.spare)
    }

    /// The wall that a sonar at `bearing` (relative to the heading) meets squarely, for a range
    /// whose bearing was not this localizer's to choose.
    ///
    /// # Errors
    /// [`NoAim`], by why there is none.
    pub fn aim_at(&self, bearing: Radians) -> Result<Aim, NoAim> {
        aim::at(&self.config, &self.map, &self.ekf, bearing)
    }

    /// Takes the range that came back from an aim, or `None` where no echo came. The pose must be
    /// that of the instant when the echo left the wall: call [`Self::odometry`] up to it first.
    ///
    /// Only [`Fix::Accepted`] changes the estimate; every outcome enters the health.
    pub fn fix(&mut self, aim: &Aim, range: Option<Metres>) -> Fix {
        let fix = self.try_fix(aim, range).unwrap_or_else(Fix::Refused);
        self.spare = self.blocked(aim, &fix).then_some(aim.wall);
        self.silent = matches!(fix, Fix::Refused(_)).then_some(aim.wall);
        match fix {
            Fix::Accepted(_) => self.health.accepted(),
            Fix::Gated(innovation) => self.health.gated(innovation.value),
            Fix::Refused(Refusal::NoEcho) => self.health.no_echo(),
            Fix::Refused(_) => self.health.silent(),
        }
        fix
    }

    /// Whether something seems to stand before the wall: a range that it shortened, or an echo that
    /// stayed away twice; once is often chance.
    fn blocked(&self, aim: &Aim, fix: &Fix) -> bool {
        match fix {
            Fix::Accepted(_) => false,
            Fix::Gated(_) => true,
            Fix::Refused(_) => self.silent == Some(aim.wall),
        }
    }

    /// Takes note that the sonar had its turn and [`Self::aim`] found no wall to look at, so that
    /// a localizer that has gone blind does not keep saying that it is tracking.
    pub fn skip(&mut self) {
        self.health.silent();
    }

    fn try_fix(&mut self, aim: &Aim, range: Option<Metres>) -> Result<Fix, Refusal> {
        let sonar = &self.config.sonar;
        let range = range.ok_or(Refusal::NoEcho)?;
        if !range.is_finite() {
            return Err(Refusal::NotFinite);
        }
        if range < sonar.min_range || range > sonar.max_range {
            return Err(Refusal::OutOfRange);
        }
        let wall = self.map.wall(aim.wall).ok_or(Refusal::UnknownWall)?;
        let view = Viewpoint::new(&self.config, &self.ekf);
        let expected = view.expect(&wall)?;
        if !view.is_square(aim.bearing, &expected) {
            return Err(Refusal::NotSquare);
        }
        let noise = sonar.noise.variance(expected.range);
        let innovation = self.ekf.innovation(range, &expected, noise);
        let gate = self.config.trust.gate;
        if innovation.nis() > gate * gate {
            return Ok(Fix::Gated(innovation));
        }
        match self.ekf.update(range, &expected, noise) {
            Ok(()) => Ok(Fix::Accepted(innovation)),
            Err(_) => Err(Refusal::NotFinite),
        }
    }

    /// The time of the last travel taken.
    #[must_use]
    pub fn time(&self) -> Instant {
        self.time
    }

    /// The estimated pose.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.ekf.state().pose()
    }

    /// The filter: state, covariance, deviations.
    #[must_use]
    pub fn filter(&self) -> &Ekf {
        &self.ekf
    }

    /// The verdict on the estimate, and the counts behind it.
    #[must_use]
    pub fn health(&self) -> Health {
        self.health
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The map.
    #[must_use]
    pub fn map(&self) -> Map<'m> {
        self.map
    }
}
