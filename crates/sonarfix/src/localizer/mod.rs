//! The localizer: filter, map, planner, gate and health together. It receives wheel travels and ranges,
//! and returns the pose and the bearing of the next ping. It owns no hardware and reads no clock.
//!
//! This module composes the parts and computes nothing itself.
//!
//! # Non-finite policy
//! NaN or infinity in an argument is a typed error or a [`Fix::Refused`], and the estimate is unchanged
//! to the bit.

mod absolute;
mod measurement;
mod mode;
mod mount;
mod passage;
mod ping;
mod travel;
pub(crate) mod unseen;

use self::mount::StatedMount;
use self::passage::Path;
use self::unseen::Unseen;
use crate::aim::{Aim, Choice, NoAim, Situation, Standing};
use crate::association::history::History;
use crate::association::visibility::max_heading_deviation_of;
use crate::config::{Config, ConfigError, Policy, RangerId};
use crate::filter::ekf::{Ekf, EkfError, StandardDeviations, StateEstimate, pose_block};
use crate::filter::gyro_fusion::GyroFusion;
use crate::geometry::pose::Pose;
use crate::geometry::units::{Duration, Instant, Metres, Radians};
use crate::health::{Health, Limits, Mismatch};
use crate::map::Map;
use crate::sensor::absolute::{LastStep, Sources};

pub use self::mode::Mode;
pub use self::ping::FIXED_SKIP;
pub use self::unseen::{UNKNOWN_HEADING, UNKNOWN_POSITION};
pub use crate::association::outcome::{AbsoluteFix, AbsoluteRefusal, Agreement, Fix, Refusal};
pub use crate::filter::gyro_fusion::{GyroStatus, TurnUse};
pub use crate::filter::odometry::OdometryError;

const NO_TIME: Duration = Duration::from_ticks(0);

/// The pose at the start, and its uncertainty.
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

impl Start {
    /// Checks that [`Localizer::set_pose`] will take it.
    ///
    /// # Errors
    /// [`EkfError`], by what is wrong with the pose or its deviations.
    pub fn check(&self) -> Result<(), EkfError> {
        pose_block(self.pose, self.position_deviation, self.heading_deviation).map(drop)
    }
}

/// Reason for which a localizer cannot be constructed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StartError {
    /// The configuration breaks a rule.
    Config(ConfigError),
    /// The filter refused the start pose or its deviations.
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

/// The localizer.
///
/// ```
/// use sonarfix::config::Config;
/// use sonarfix::localizer::{Fix, Localizer, Start};
/// use sonarfix::map::{Map, Wall};
/// use sonarfix::filter::motion::WheelTravel;
/// use sonarfix::geometry::pose::{Point, Pose};
/// use sonarfix::geometry::units::{Instant, Metres, Radians};
///
/// // A room of 4 m × 3 m; the robot stands at (1, 1) and faces along x.
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
/// // 100 ms later the encoders report 2 cm; then the sonar pings along the requested bearing.
/// let now = Instant::from_ticks(100_000);
/// localizer.odometry(now, WheelTravel::new(0.02, 0.02))?;
/// let aim = localizer.aim()?;
/// let range = aim.range + Metres(0.01);
/// assert!(matches!(localizer.fix(&aim, Some(range)), Fix::Accepted(_)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Localizer<'m> {
    config: Config,
    mount: StatedMount,
    map: Map<'m>,
    ekf: Ekf,
    health: Health,
    /// Of the configuration, computed once.
    limits: Limits,
    /// The time of the last accepted travel.
    time: Instant,
    /// Up to when time has entered the health.
    recorded: Instant,
    /// The period without odometry that has not ended.
    unseen: Option<Unseen>,
    history: History,
    /// The time of the latest ping, or of the latest time without a wall that has counted ([`FIXED_SKIP`]).
    pinged: Instant,
    /// Association probability of the latest ping.
    association: f32,
    /// The gyro, if the configuration has one.
    gyro: Option<GyroFusion>,
    /// The latest step of the odometry.
    step: LastStep,
    /// Where the latest steps have led.
    path: Path,
    /// The sources of absolute measurements.
    sources: Sources,
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
        let prior = config.prior;
        let deviation = StandardDeviations {
            x: start.position_deviation,
            y: start.position_deviation,
            heading: start.heading_deviation,
            scale_right: prior.scale_right,
            scale_left: prior.scale_left,
            track_width_error: prior.track_width,
            range_scale: prior.range_scale,
        };
        let state = StateEstimate::at_pose(start.pose);
        Self::resume(config, map, state, deviation, now)
    }

    /// A localizer that continues from the estimate of an earlier one, calibration included.
    ///
    /// `deviation` holds the standard deviations of `state` as they are now; the errors are taken as
    /// independent, but for those of the two wheels, which differ by no more than
    /// [`CalibrationPrior::scale_difference`](crate::config::CalibrationPrior::scale_difference). The rest of the prior of the
    /// configuration is not used.
    ///
    /// # Errors
    /// [`StartError`], by what is wrong with an argument.
    pub fn resume(
        config: Config,
        map: Map<'m>,
        state: StateEstimate,
        deviation: StandardDeviations,
        now: Instant,
    ) -> Result<Self, StartError> {
        config.check().map_err(StartError::Config)?;
        let ekf = filter(&config, state, deviation).map_err(StartError::Start)?;
        let gyro = GyroFusion::of(&config.gyro);
        let limits = Limits::new(&config.gating, max_heading_deviation_of(&config));
        Ok(Self {
            config,
            mount: StatedMount::of(&config),
            limits,
            map,
            ekf,
            health: Health::default(),
            time: now,
            recorded: now,
            unseen: None,
            history: History::default(),
            pinged: now,
            association: 0.0,
            gyro,
            step: LastStep::none(now),
            path: Path::default(),
            sources: Sources::new(now),
        })
    }

    /// Whether an encoder sample has failed since the last accepted travel.
    #[must_use]
    pub fn is_odometry_missing(&self) -> bool {
        self.unseen.is_some()
    }

    /// Replaces the pose by one that was measured independently. The calibration and its covariance are
    /// unchanged; health and the outcomes of earlier pings are reset.
    ///
    /// # Errors
    /// [`EkfError`], by what is wrong with the pose or its deviations; nothing has changed.
    pub fn set_pose(&mut self, start: &Start) -> Result<(), EkfError> {
        let Start { pose, position_deviation, heading_deviation } = *start;
        self.ekf.set_pose(pose, position_deviation, heading_deviation)?;
        if let Some(gyro) = &mut self.gyro {
            gyro.forget_pose();
        }
        self.pose_replaced();
        Ok(())
    }

    /// Replaces pose and calibration with their standard deviations, as [`Self::resume`] does; the time
    /// is unchanged, health and the outcomes of earlier pings are reset.
    ///
    /// # Errors
    /// [`EkfError`], by what is wrong with the state or its deviations; nothing has changed.
    pub fn restart(
        &mut self,
        state: StateEstimate,
        deviation: StandardDeviations,
    ) -> Result<(), EkfError> {
        self.ekf = filter(&self.config, state, deviation)?;
        if let Some(gyro) = &mut self.gyro {
            gyro.forget_states();
        }
        self.pose_replaced();
        Ok(())
    }

    fn pose_replaced(&mut self) {
        self.health = Health::default();
        self.history = History::default();
        self.step = LastStep::none(self.time);
        self.path = Path::default();
        self.sources = Sources::new(self.time);
        self.pose_changed();
    }

    /// Begins the period without odometry again after a change of P by something else than odometry.
    #[inline(never)]
    fn pose_changed(&mut self) {
        if self.unseen.is_some() {
            self.unseen = Some(Unseen::with_pose(&self.ekf, self.recorded));
        }
    }

    /// The mount of the first ranger is where the filter has estimated it.
    #[inline]
    fn mount_changed(&mut self) {
        if let Some(place) = self.ekf.place_of_sonar() {
            self.config.rangers.first.mount = place;
        }
    }

    /// Declares the pose unknown: the verdict is `Lost`.
    pub fn declare_lost(&mut self) {
        self.health = Health::lost(self.ekf.pose_uncertainty());
    }

    /// The bearing of the next ping by the policy of the configuration, and the reason.
    ///
    /// The outcomes of earlier pings, from [`Self::fix`], enter the choice.
    ///
    /// # Errors
    /// [`NoAim`], by the reason for which there is no wall to measure.
    pub fn aim(&self) -> Result<Aim, NoAim> {
        self.aim_by(self.config.policy)
    }

    /// As [`Self::aim`], by another policy.
    ///
    /// # Errors
    /// [`NoAim`], by the reason for which there is no wall to measure.
    pub fn aim_by(&self, policy: Policy) -> Result<Aim, NoAim> {
        self.situation(policy).choose()
    }

    /// As [`Self::aim`] for one ranger whose servo stands as given: for a robot with several, whose loop turns all servos
    /// and pings with the ranger that has the highest [score](Aim::score).
    ///
    /// # Errors
    /// [`NoAim`], by the reason for which there is no wall to measure.
    pub fn aim_of(&self, ranger: RangerId, standing: &Standing) -> Result<Aim, NoAim> {
        self.aim_of_by(self.config.policy, ranger, standing)
    }

    /// As [`Self::aim_of`], by another policy.
    ///
    /// # Errors
    /// [`NoAim`], by the reason for which there is no wall to measure.
    pub fn aim_of_by(
        &self,
        policy: Policy,
        ranger: RangerId,
        standing: &Standing,
    ) -> Result<Aim, NoAim> {
        self.situation(policy).decide(Choice::standing(ranger, *standing))
    }

    /// Makes a slice of the choice of a ping, for a loop that must not wait for a whole one; returns what [`Self::aim_of`]
    /// returns after the last slice. Travel and other measurements may be taken between two slices.
    pub fn choose(&self, choice: &mut Choice) -> Option<Result<Aim, NoAim>> {
        self.choose_by(self.config.policy, choice)
    }

    /// As [`Self::choose`], by another policy.
    pub fn choose_by(&self, policy: Policy, choice: &mut Choice) -> Option<Result<Aim, NoAim>> {
        self.situation(policy).proceed(choice)
    }

    /// The wall to which a beam of the first ranger at `bearing` (relative to the heading) is square, for a range whose
    /// bearing this localizer did not choose.
    ///
    /// # Errors
    /// [`NoAim`], by the reason for which no wall can be measured.
    pub fn aim_at(&self, bearing: Radians) -> Result<Aim, NoAim> {
        self.aim_along(RangerId::FIRST, bearing)
    }

    /// As [`Self::aim_at`], for any ranger.
    ///
    /// # Errors
    /// [`NoAim`], by the reason for which no wall can be measured.
    pub fn aim_along(&self, ranger: RangerId, bearing: Radians) -> Result<Aim, NoAim> {
        self.situation(self.config.policy).at(ranger, bearing)
    }

    fn situation(&self, policy: Policy) -> Situation<'_> {
        let Self { config, map, ekf, history, time, .. } = self;
        Situation { config, map, ekf, history, now: *time, policy }
    }

    /// The time of the last accepted travel.
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

    /// The verdict on the estimate, and the numbers behind it.
    #[must_use]
    pub fn health(&self) -> Health {
        self.health
    }

    /// What of the configuration is probably wrong, as far as the ranges tell by now; `None`: nothing. `docs/model.md`, eq. (57).
    #[must_use]
    pub fn mismatch(&self) -> Option<Mismatch> {
        let Self { config, ekf, health, .. } = self;
        let of_mount = || Mismatch::of_mount(health, self.mount.off(ekf)?, config.prior.mount);
        Mismatch::of(health, self.noise_factor(), &ekf.state(), &config.prior).or_else(of_mount)
    }

    /// The noise of the wheels that the filter uses, as a multiple of that of the configuration: from 1 to 4, while the innovations are
    /// larger than the latter explains (`docs/model.md`, eq. 58).
    #[must_use]
    pub fn noise_factor(&self) -> f32 {
        self.ekf.noise_factor(&self.config.drive)
    }

    /// β, the probability that the echo of the latest ping was that of its wall (`docs/model.md`, eq. 16);
    /// zero without an echo, or if the range was refused.
    #[must_use]
    pub fn association(&self) -> f32 {
        self.association
    }

    /// The gyro: its bias, and what became of its turns; `None` without a gyro in the configuration.
    #[must_use]
    pub fn gyro(&self) -> Option<GyroStatus> {
        GyroFusion::status_of(&self.gyro)
    }

    /// The configuration. The mount of the first ranger is the estimated one, if
    /// [`CalibrationPrior::mount`](crate::config::CalibrationPrior::mount) is not zero.
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

/// A filter at `state`, with what the configuration knows of the wheels.
fn filter(
    config: &Config,
    state: StateEstimate,
    deviation: StandardDeviations,
) -> Result<Ekf, EkfError> {
    let mut ekf = Ekf::new(config.drive, state, deviation)?;
    ekf.estimate_mount(config.rangers.first.mount, config.prior.mount);
    let difference = config.prior.difference_of(deviation.scale_right, deviation.scale_left);
    Ok(match difference {
        Some(difference) => ekf.with_scale_difference(difference),
        None => ekf,
    })
}

#[cfg(test)]
mod tests;
