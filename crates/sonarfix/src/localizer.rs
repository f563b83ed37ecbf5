//! The localizer: filter, map, aim and health joined. It is told wheel travels and ranges, and
//! tells where the robot is and where to look next. It owns no hardware and reads no clock.
//!
//! # Non-finite policy
//! NaN or infinity in an argument is a typed error or a [`Fix::Refused`], and not one bit of the
//! localizer's estimate has changed.

use crate::aim::{self, Aim, Answer, LEAST_CONFIDENCE, Memory, NoAim, Unfit, Viewpoint};
use crate::config::{Config, ConfigError, REOPENS, Trust};
use crate::ekf::{Ekf, EkfError, Innovation, State};
use crate::health::{Doubt, Health, Limits, Turn, Verdict};
use crate::map::{Map, WallId};
use crate::motion::WheelTravel;
use crate::pose::Pose;
use crate::units::{Instant, Metres, Radians, SquareMetres};

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
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    /// Taken, but believed less than its noise allows: outside the gate and inside the
    /// [`outer_gate`](crate::config::Trust::outer_gate), or shorter than what the wall itself
    /// explains ([`short`](crate::config::Trust::short)). The innovation's variance is that with the
    /// raised noise.
    Weakened(Innovation),
    /// Outside the gate: the range has not been taken. The filter is unchanged, but that while
    /// [`Lost`](crate::health::Verdict::Lost) its doubt may have grown
    /// ([`Health::reopened`](field@crate::health::Health::reopened)).
    Gated(Innovation),
    /// Not a range to compare with anything: the filter is unchanged; while lost, a missing echo
    /// counts like a gated range.
    Refused(Refusal),
}

impl Fix {
    /// The innovation of a range that has corrected the estimate; `None` for one that has not.
    #[must_use]
    pub fn taken(&self) -> Option<Innovation> {
        match *self {
            Self::Accepted(innovation) | Self::Weakened(innovation) => Some(innovation),
            Self::Gated(_) | Self::Refused(_) => None,
        }
    }
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
    memory: Memory,
    /// The wall that contradicted the pose last, since the last range taken.
    contradicted: Option<WallId>,
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
            memory: Memory::default(),
            contradicted: None,
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
        let seconds = aim::seconds(elapsed);
        if fastest.abs().0 > self.config.max_wheel_speed.0 * seconds {
            return Err(OdometryError::TooFast);
        }
        let before = self.pose().heading;
        self.ekf.predict(travel).map_err(OdometryError::Filter)?;
        self.memory.turned(self.pose().heading.from(before), seconds);
        self.time = now;
        let limits = self.limits();
        self.health.rolled(travel.distance(), elapsed, &limits);
        Ok(())
    }

    /// Where the sonar should look next, by the policy of the configuration, and why. Where it
    /// looked last, and which walls have lately not answered as they should, it knows from
    /// [`Self::fix`].
    ///
    /// # Errors
    /// [`NoAim`], by why there is nothing to look at.
    pub fn aim(&self) -> Result<Aim, NoAim> {
        aim::choose(&self.config, &self.map, &self.ekf, &self.memory, self.time)
    }

    /// The wall that a sonar at `bearing` (relative to the heading) meets squarely, for a range
    /// whose bearing was not this localizer's to choose.
    ///
    /// # Errors
    /// [`NoAim`], by why there is none.
    pub fn aim_at(&self, bearing: Radians) -> Result<Aim, NoAim> {
        aim::at(&self.config, &self.map, &self.ekf, &self.memory, self.time, bearing)
    }

    /// Takes the range that came back from an aim, or `None` where no echo came. The pose must be
    /// that of the instant when the echo left the wall: call [`Self::odometry`] up to it first.
    ///
    /// [`Fix::Accepted`] and [`Fix::Weakened`] correct the estimate; every outcome enters the health.
    pub fn fix(&mut self, aim: &Aim, range: Option<Metres>) -> Fix {
        let fix = self.try_fix(aim, range).unwrap_or_else(Fix::Refused);
        self.remember(aim, &fix);
        let again = self.contradicted == Some(aim.wall);
        self.judge(Turn::of(&fix, again));
        self.contradicted = self.contradicted_by(aim, &fix);
        if !again {
            self.reopen(&fix);
        }
        fix
    }

    /// Lets the doubt of a lost robot grow with every range beyond the gate that is not of the same
    /// wall again, so that later ones find it wider (`docs/model.md`, eq. 19): the position's up to
    /// [`REOPENS`] steps, the heading's while the sonar still has something to look at. Of the same wall
    /// again it would open to the furniture before it.
    fn reopen(&mut self, fix: &Fix) {
        if self.health.verdict != Verdict::Lost || !matches!(fix, Fix::Gated(_)) {
            return;
        }
        let (doubt, limits) = (self.doubt(), self.limits());
        let step = self.config.trust.reopen;
        let position = if doubt.position < step * REOPENS { step } else { Metres(0.0) };
        let heading = Radians(if doubt.heading < limits.heading { step.0 } else { 0.0 });
        let grows = position > Metres(0.0) || heading > Radians(0.0);
        if grows && self.ekf.loosen(position, heading).is_ok() {
            self.health.reopened();
        }
    }

    fn judge(&mut self, turn: Turn) {
        let (doubt, limits) = (self.doubt(), self.limits());
        self.health.turn(turn, doubt, &limits);
    }

    fn limits(&self) -> Limits {
        let trust = &self.config.trust;
        let heading = self.config.sonar.cone * (0.5 / LEAST_CONFIDENCE);
        Limits { stale: trust.stale, position: trust.doubtful, heading }
    }

    /// How uncertain the pose is, by the filter itself.
    fn doubt(&self) -> Doubt {
        Doubt {
            position: Metres(self.ekf.pose_covariance().worst_deviation()),
            heading: Radians(self.ekf.deviation().heading),
        }
    }

    /// Takes note of how a look at a wall ended.
    fn remember(&mut self, aim: &Aim, fix: &Fix) {
        let Some(wall) = self.map.wall(aim.wall) else {
            return;
        };
        let answer = match fix {
            Fix::Accepted(_) => Answer::Right,
            Fix::Gated(_) => Answer::Wrong,
            Fix::Weakened(_) | Fix::Refused(Refusal::NoEcho) => Answer::Doubtful,
            Fix::Refused(_) => Answer::Unknown,
        };
        let foot = wall.along(self.pose().to_map(self.config.sonar.mount));
        self.memory.looked((aim.wall, foot), (aim.bearing, aim.range), answer, self.time);
    }

    /// The wall that contradicts the pose, after this fix.
    fn contradicted_by(&self, aim: &Aim, fix: &Fix) -> Option<WallId> {
        match fix {
            Fix::Accepted(_) | Fix::Weakened(_) => None,
            Fix::Gated(_) | Fix::Refused(Refusal::NoEcho) => Some(aim.wall),
            Fix::Refused(_) => self.contradicted,
        }
    }

    /// Takes note that the sonar had its turn and [`Self::aim`] found no wall to look at, so that
    /// a localizer that has gone blind does not keep saying that it is tracking.
    pub fn skip(&mut self) {
        self.judge(Turn::Silent);
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
        let off = expected.direction.from(view.heading.turned(aim.bearing));
        if !view.is_square(off) {
            return Err(Refusal::NotSquare);
        }
        let noise = sonar.noise.variance(expected.range);
        let innovation = self.ekf.innovation(range, &expected, noise);
        let Some(weakened) = self.weighed(innovation, noise) else {
            return Ok(Fix::Gated(innovation));
        };
        match self.ekf.update(range, &expected, weakened) {
            Ok(()) if weakened > noise => {
                let raised = innovation.variance.0 + (weakened.0 - noise.0);
                Ok(Fix::Weakened(Innovation { variance: SquareMetres(raised), ..innovation }))
            }
            Ok(()) => Ok(Fix::Accepted(innovation)),
            Err(_) => Err(Refusal::NotFinite),
        }
    }

    /// The noise with which a range is to be believed, at least its own; `None` if it is not
    /// believed at all (`docs/model.md`, eqs. 14 and 18).
    fn weighed(&self, innovation: Innovation, noise: SquareMetres) -> Option<SquareMetres> {
        let Trust { gate, outer_gate, short, .. } = self.config.trust;
        let square = innovation.value.0 * innovation.value.0;
        let is_inside = innovation.nis() <= gate * gate;
        if !is_inside && innovation.nis() > outer_gate * outer_gate {
            return None;
        }
        // What brings a range beyond the gate to it.
        let at_gate = noise.0 + (square / (gate * gate) - innovation.variance.0);
        let is_short = short > 0.0 && innovation.value < Metres(0.0);
        let as_short = if is_short { square / (short * short) } else { 0.0 };
        let least = if is_inside { noise.0 } else { at_gate };
        Some(SquareMetres(if as_short > least { as_short } else { least }))
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
