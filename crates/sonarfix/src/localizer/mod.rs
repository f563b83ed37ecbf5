//! The localizer: filter, map, planner, gate and health together. It receives wheel travels and ranges,
//! and returns the pose and the bearing of the next ping. It owns no hardware and reads no clock.
//!
//! This module composes the parts and computes nothing itself.
//!
//! # Non-finite policy
//! NaN or infinity in an argument is a typed error or a [`Fix::Refused`], and the estimate is unchanged
//! to the bit.

mod mode;
pub(crate) mod unseen;

use self::unseen::Unseen;
use crate::aim::{Aim, NoAim, Situation, Standing};
use crate::association::alternatives::{Scene, Target};
use crate::association::echo::{ExpectedEcho, Explanation, Others};
use crate::association::gating::{self, Use};
use crate::association::history::{History, Origin};
use crate::association::reliability::{Returned, Shares};
use crate::association::visibility::{Sight, Viewpoint, check_range, max_heading_deviation_of};
use crate::config::{Config, ConfigError, Policy, RangerId, Ranging};
use crate::filter::covariance::{GyroBias, PredictedMeasurement};
use crate::filter::ekf::{Ekf, EkfError, StandardDeviations, StateEstimate};
use crate::filter::gyro_fusion::GyroFusion;
use crate::filter::motion::WheelTravel;
use crate::filter::odometry;
use crate::geometry::pose::Pose;
use crate::geometry::units::{Duration, Instant, Metres, Radians, SquareMetres, seconds};
use crate::health::{Health, Limits, Verdict};
use crate::map::Map;
use crate::sensor::absolute::{
    AbsoluteMeasurement, Explained, LastStep, MeasurementError, OutsideStep, PoseVector, Sources,
};
use crate::sensor::gyro::MeasuredTurn;
use crate::sensor::range::Innovation;

pub use self::mode::Mode;
pub use self::unseen::{UNKNOWN_HEADING, UNKNOWN_POSITION};
pub use crate::association::outcome::{AbsoluteFix, AbsoluteRefusal, Agreement, Fix, Refusal};
pub use crate::filter::gyro_fusion::{GyroStatus, TurnUse};
pub use crate::filter::odometry::OdometryError;

const NO_TIME: Duration = Duration::from_ticks(0);

/// Time after a ping, or after the last time without a wall that has counted, from which on a time without a wall counts as a
/// ping without an accepted range, with a sonar at a fixed bearing.
pub const FIXED_SKIP: Duration = Duration::from_ticks(1_000_000);

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
    map: Map<'m>,
    ekf: Ekf,
    health: Health,
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
    /// The sources of absolute measurements.
    sources: Sources,
}

/// The outcome of a ping, and its evidence against the pose.
struct ExplainedPing {
    fix: Fix,
    evidence: f32,
    /// Whether it contradicts the pose, independently of the ping before.
    contradicts: bool,
    /// Whether the echo is that of the object that has already returned one ([`Source::repeats`]).
    is_repeated: bool,
}

impl ExplainedPing {
    /// A ping that is not explained.
    const REFUSED: Self = Self {
        fix: Fix::Refused(Refusal::NoEcho),
        evidence: 0.0,
        contradicts: false,
        is_repeated: false,
    };
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
        Ok(Self {
            config,
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
            sources: Sources::new(now),
        })
    }

    /// Predicts the estimate over the travel of both wheels since the last call, up to the time `now`.
    ///
    /// To be called at every encoder sample, and at the instant when an echo left the wall.
    ///
    /// # Errors
    /// [`OdometryError`], by what is wrong with the travel or its time; estimate and time are unchanged.
    pub fn odometry(&mut self, now: Instant, travel: WheelTravel) -> Result<(), OdometryError> {
        self.odometry_with_turn(now, travel, None)
    }

    /// As [`Self::odometry`], with the turn that the gyro has measured over the same time; `None` if it has failed. Without
    /// a gyro in the configuration the turn is ignored. What became of it: [`Self::gyro`].
    ///
    /// # Errors
    /// As of [`Self::odometry`].
    pub fn odometry_with_turn(
        &mut self,
        now: Instant,
        travel: WheelTravel,
        turn: Option<MeasuredTurn>,
    ) -> Result<(), OdometryError> {
        let result = self.predict(now, travel, turn);
        if let (Err(_), Some(unseen)) = (result, &mut self.unseen) {
            unseen.refuse(now);
        }
        result
    }

    fn predict(
        &mut self,
        now: Instant,
        travel: WheelTravel,
        turn: Option<MeasuredTurn>,
    ) -> Result<(), OdometryError> {
        let elapsed = odometry::check(travel, self.time, now, self.config.max_wheel_speed)?;
        let unrecorded = now.checked_duration_since(self.recorded).unwrap_or(NO_TIME);
        let (before, is_seen) = (self.ekf.estimate(), self.unseen.is_none());
        self.predict_seen(now, travel, elapsed, turn).map_err(OdometryError::Filter)?;
        let (x, y, h) = self.ekf.estimate().pose_since(&before);
        // The path of a period without odometry is unknown.
        self.step = if is_seen {
            LastStep::new(self.time, PoseVector { x, y, h })
        } else {
            LastStep::none(now)
        };
        self.history.record_turn(Radians(h), seconds(elapsed));
        self.history.record_distance(travel.distance());
        (self.time, self.recorded) = (now, now);
        let limits = self.limits();
        self.health.record_travel(travel.distance(), unrecorded, &limits);
        Ok(())
    }

    /// Predicts over a travel that ends a period without odometry, if there is one.
    fn predict_seen(
        &mut self,
        now: Instant,
        travel: WheelTravel,
        elapsed: Duration,
        turn: Option<MeasuredTurn>,
    ) -> Result<(), EkfError> {
        let Some(unseen) = self.unseen else {
            return self.predict_filter(travel, elapsed, turn);
        };
        let grown = self.ekf.pose_variances();
        unseen.end(&mut self.ekf, now, travel.distance(), &self.config);
        let result = self.predict_filter(travel, elapsed, turn);
        if result.is_ok() {
            self.unseen = None;
            self.health.record_uncertainty(self.ekf.pose_uncertainty());
        } else {
            self.ekf.set_pose_variances(grown);
        }
        result
    }

    #[inline]
    fn predict_filter(
        &mut self,
        travel: WheelTravel,
        elapsed: Duration,
        turn: Option<MeasuredTurn>,
    ) -> Result<(), EkfError> {
        match (&mut self.gyro, &self.config.gyro) {
            (Some(gyro), Some(parameters)) => {
                gyro.predict(&mut self.ekf, travel, elapsed, turn, parameters)
            }
            _ => self.ekf.predict(travel),
        }
    }

    /// Records that the wheels could not be observed up to `now`. To be called whenever an encoder sample is due and
    /// fails. The state is unchanged, because the next sample may report the whole travel; the deviations of the pose
    /// grow with the distance that the wheels may have rolled at their maximum speed (`docs/model.md`, eq. 24).
    ///
    /// The verdict is `Degraded` after [0.5 s](crate::health::DEGRADED_WITHOUT_ODOMETRY), `Lost` after
    /// [3 s](crate::health::LOST_WITHOUT_ODOMETRY).
    pub fn odometry_missing(&mut self, now: Instant) {
        let since = |then: Instant| now.checked_duration_since(then).unwrap_or(NO_TIME);
        let (unseen_for, unrecorded) = (since(self.time), since(self.recorded));
        let unseen = *self.unseen.get_or_insert_with(|| Unseen::new(self.time, &self.ekf));
        unseen.grow(&mut self.ekf, now, &self.config);
        let (uncertainty, limits) = (self.ekf.pose_uncertainty(), self.limits());
        self.health.record_unseen(unseen_for, unrecorded, uncertainty, &limits);
        self.recorded = self.recorded.max(now);
    }

    /// Continues at `now` after the clock was set back. The next travel is that since the last accepted one; times of
    /// earlier pings are forgotten, and measurements from before are refused.
    pub fn set_clock(&mut self, now: Instant) {
        (self.time, self.recorded, self.pinged) = (now, now, now);
        self.step = LastStep::none(now);
        self.sources = Sources::new(now);
        if self.unseen.is_some() {
            self.unseen = Some(Unseen::new(now, &self.ekf));
        }
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
        self.sources = Sources::new(self.time);
        self.pose_changed();
    }

    /// Begins the period without odometry again after a change of P by something else than odometry.
    fn pose_changed(&mut self) {
        if self.unseen.is_some() {
            self.unseen = Some(Unseen::with_pose(&self.ekf, self.recorded));
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
        Situation { policy, ..self.situation() }.choose()
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
        Situation { policy, ..self.situation() }.choose_of(ranger, standing)
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
        self.situation().at(ranger, bearing)
    }

    fn situation(&self) -> Situation<'_> {
        let Self { config, map, ekf, history, time, .. } = self;
        Situation { config, map, ekf, history, now: *time, policy: config.policy }
    }

    /// Corrects the estimate by the range measured along an aim, or records that there was no echo.
    ///
    /// The estimate must be that of the instant when the echo left the wall: call [`Self::odometry`] up
    /// to it first. [`Fix::Accepted`] and [`Fix::Downweighted`] correct the estimate; every outcome
    /// enters the health.
    pub fn fix(&mut self, aim: &Aim, range: Option<Metres>) -> Fix {
        self.history.record_ping(aim.ranger, aim.wall, aim.bearing, aim.range);
        self.pinged = self.time;
        self.association = 0.0;
        let mut ping = ExplainedPing::REFUSED;
        if let Err(refusal) = self.try_fix(aim, range, &mut ping) {
            ping.fix = Fix::Refused(refusal);
        }
        let ExplainedPing { fix, evidence, contradicts, is_repeated } = ping;
        let has_failed =
            self.config.has_several_sonars() && self.history.has_failed(aim.ranger, &self.config);
        if has_failed && fix.innovation_used().is_none() {
            // It says nothing about the pose.
            return fix;
        }
        let limits = self.limits();
        let uncertainty = self.ekf.pose_uncertainty();
        self.health.record_fix(&fix, evidence, is_repeated, uncertainty, &limits);
        if contradicts {
            self.inflate_if_lost();
        }
        fix
    }

    /// Records that a ranger could not ping, because it or its servo has failed.
    pub fn ranger_failed(&mut self, ranger: RangerId) {
        let silence = Shares::working(1.0, 0.0);
        self.history.record_returned(ranger, Returned::Silence, &silence, self.time);
    }

    /// Records that [`Self::aim`] found no wall to measure when a ping was due, so that the verdict of
    /// a localizer without measurements does not stay `Tracking`. A robot with sonars at fixed bearings only often waits
    /// until it has turned: that counts once in [`FIXED_SKIP`].
    pub fn skip(&mut self) {
        if self.config.sonars().all(|(_, sonar)| sonar.fixed_bearing().is_some()) {
            self.skip_unplanned();
        } else {
            self.count_skip();
        }
    }

    /// Records that [`Self::aim_along`] found no wall for a ping whose bearing this localizer did not choose. Of a ring of sonars most
    /// pings go where no wall answers, which is no evidence: it counts once in [`FIXED_SKIP`].
    pub fn skip_unplanned(&mut self) {
        let since = self.time.checked_duration_since(self.pinged).unwrap_or(NO_TIME);
        if since >= FIXED_SKIP {
            self.pinged = self.time;
            self.count_skip();
        }
    }

    fn count_skip(&mut self) {
        let limits = self.limits();
        self.health.record_no_aim(self.ekf.pose_uncertainty(), &limits);
    }

    /// Corrects the estimate by a heading, position or pose that was measured at the time `at`, through the same gate and
    /// with the same effect on the health as a range (`docs/model.md`, eqs. 40 to 44). The pose at that time is interpolated:
    /// it must be within the latest step of the odometry, whose ends belong to it.
    ///
    /// A heading confirms no position: it counts against the pose, not for it. An outlier is refused as long as its source
    /// repeats it; a pose that is to be taken in any case is set by [`Self::set_pose`].
    pub fn absolute(&mut self, at: Instant, measurement: &AbsoluteMeasurement) -> AbsoluteFix {
        self.try_absolute(at, measurement).unwrap_or_else(AbsoluteFix::Refused)
    }

    fn try_absolute(
        &mut self,
        at: Instant,
        measurement: &AbsoluteMeasurement,
    ) -> Result<AbsoluteFix, AbsoluteRefusal> {
        let measured = measurement.check()?;
        let back = self.step.back_to(at, self.time)?;
        let prediction = self.ekf.predict_absolute(&measured, &back);
        let indefinite = AbsoluteRefusal::Filter(EkfError::Indefinite);
        let fit = prediction.fit().ok_or(indefinite)?;
        let now = self.time;
        let outliers = self.sources.of(measured.has_position).outliers(now);
        let Explained { association, evidence } = fit.explain(outliers);
        let agreement = Agreement { nis: fit.nis, dimensions: measured.dimensions() };
        let used = gating::use_of(association);
        let fix = if used == Use::Reject {
            AbsoluteFix::Gated(agreement)
        } else {
            let weight = gating::weight(association);
            let bias = GyroFusion::bias_of(&mut self.gyro);
            let corrected = self.ekf.update_absolute(&prediction, weight, bias);
            corrected.map_err(AbsoluteRefusal::Filter)?;
            self.pose_changed();
            match used {
                Use::Accept => AbsoluteFix::Accepted(agreement),
                _ => AbsoluteFix::Downweighted(agreement),
            }
        };
        self.sources.of(measured.has_position).record(1.0 - association, outliers, now);
        let (limits, uncertainty) = (self.limits(), self.ekf.pose_uncertainty());
        let is_repeated = gating::is_known(outliers);
        let has_position = measured.has_position;
        let health = &mut self.health;
        health.record_absolute(&fix, has_position, evidence, is_repeated, uncertainty, &limits);
        if gating::contradicts(association, outliers) {
            self.inflate_if_lost();
        }
        Ok(fix)
    }

    /// Writes the outcome in place: a result that contains it is copied byte by byte.
    fn try_fix(
        &mut self,
        aim: &Aim,
        range: Option<Metres>,
        ping: &mut ExplainedPing,
    ) -> Result<(), Refusal> {
        let echo = &self.config.echo;
        let Some(sonar) = self.config.sonar_of(aim.ranger) else {
            return Err(match range {
                None => Refusal::NoEcho,
                Some(range) if !range.is_finite() => Refusal::NotFinite,
                Some(_) => Refusal::UnknownRanger,
            });
        };
        let measured = check_range(sonar, range);
        if measured == Err(Refusal::NotFinite) {
            return Err(Refusal::NotFinite);
        }
        // A range that is refused by itself has that reason, whatever the geometry.
        let refused = |geometry: Refusal| measured.err().unwrap_or(geometry);
        let Some(wall) = self.map.wall(aim.wall) else {
            return Err(refused(Refusal::UnknownWall));
        };
        let view = Viewpoint::new(&self.config, sonar, &self.ekf).of_echo();
        let sight = view.sight(&wall, aim.bearing).map_err(refused)?;
        let Sight { expected, place, .. } = sight;
        let geometry = sight.on_wall * sight.square;
        let entry =
            self.history.entry(echo, aim.ranger, aim.wall, place, expected.range, self.time);
        let occluded = entry.occlusion;
        let map_variance = echo.map_variance(sight.accuracy, entry.travelled);
        let noise = SquareMetres(sight.noise + map_variance * sight.of_map);
        let prediction = self.ekf.predict_measurement(&expected);
        let innovation = prediction.innovation(measured.unwrap_or(expected.range), noise);
        let expected_echo = ExpectedEcho {
            range: expected.range,
            variance: innovation.variance,
            geometry,
            occluded,
            source: entry.source,
            limits: (sonar.min_range, sonar.max_range),
        };
        let alone = expected_echo.explain(echo, measured.ok(), Others::NONE);
        let is_clear = gating::use_of(alone.association) == Use::Accept;
        let unclear = measured.ok().filter(|_| !is_clear && view.is_heading_known());
        let explanation = if let Some(range) = unclear {
            let (variance, answers) = (innovation.variance, expected_echo.answers(echo));
            let target = Target { expected: &expected, variance, answers };
            let scene = Scene {
                config: &self.config,
                sonar,
                map: self.map,
                ekf: &self.ekf,
                history: &self.history,
            };
            let others = match sonar.ranging {
                Ranging::Sound => scene.others(&target, aim.bearing, range),
                Ranging::Light(beam) => scene.others_lit(&view, beam, &target, range),
            };
            expected_echo.explain(echo, Some(range), others)
        } else {
            alone
        };
        let Explanation { association, occluded: now_occluded, mapped, evidence } = explanation;
        let fix = if let Err(refusal) = measured {
            Fix::Refused(refusal)
        } else {
            let bias = GyroFusion::bias_of(&mut self.gyro);
            use_range(&mut self.ekf, &prediction, innovation, noise, association, bias)?
        };
        if fix.innovation_used().is_some() {
            self.pose_changed();
        }
        self.association = association;
        let is_repeated =
            measured.is_ok_and(|range| entry.source.is_some_and(|source| source.repeats(range)));
        if self.config.has_several_sonars() {
            let returned = match measured {
                Ok(_) if association > 0.5 || is_repeated => Returned::Explained,
                Ok(_) => Returned::Unexplained,
                Err(_) => Returned::Silence,
            };
            let working = expected_echo.shares(&self.config.echo);
            self.history.record_returned(aim.ranger, returned, &working, self.time);
        }
        let origin = match measured {
            Ok(_) if association > 0.5 => Origin::Wall,
            Ok(range) => Origin::Other(range),
            Err(_) => Origin::Silence,
        };
        self.history.record_echo(&entry, now_occluded, origin, self.time);
        let contradicts = gating::contradicts(mapped, occluded);
        *ping = ExplainedPing { fix, evidence, contradicts, is_repeated };
        Ok(())
    }

    /// Inflates the covariance of the pose while the verdict is `Lost`, so that later echoes can be
    /// associated with their walls.
    fn inflate_if_lost(&mut self) {
        if self.health.verdict != Verdict::Lost {
            return;
        }
        let uncertainty = self.ekf.pose_uncertainty();
        if let Some((position, heading)) = gating::inflation(&self.config.gating, uncertainty)
            && self.ekf.inflate_pose(position, heading).is_ok()
        {
            self.health.record_inflation();
            self.pose_changed();
        }
    }

    fn limits(&self) -> Limits {
        Limits::new(&self.config.gating, max_heading_deviation_of(&self.config))
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

impl From<MeasurementError> for AbsoluteRefusal {
    fn from(error: MeasurementError) -> Self {
        match error {
            MeasurementError::NotFinite => Self::NotFinite,
            MeasurementError::NotPositiveDefinite => Self::NotPositiveDefinite,
            MeasurementError::WithoutFeature => Self::NotLinked,
        }
    }
}

impl From<OutsideStep> for AbsoluteRefusal {
    fn from(outside: OutsideStep) -> Self {
        match outside {
            OutsideStep::Before => Self::BeforeLastStep,
            OutsideStep::After => Self::AfterLastStep,
        }
    }
}

/// A filter at `state`, with what the configuration knows of the wheels.
fn filter(
    config: &Config,
    state: StateEstimate,
    deviation: StandardDeviations,
) -> Result<Ekf, EkfError> {
    let ekf = Ekf::new(config.drive, state, deviation)?;
    let difference = config.prior.difference_of(deviation.scale_right, deviation.scale_left);
    Ok(match difference {
        Some(difference) => ekf.with_scale_difference(difference),
        None => ekf,
    })
}

/// Corrects the estimate by a range with this association probability.
#[inline]
fn use_range(
    ekf: &mut Ekf,
    prediction: &PredictedMeasurement,
    innovation: Innovation,
    noise: SquareMetres,
    association: f32,
    bias: Option<&mut GyroBias>,
) -> Result<Fix, Refusal> {
    let used = gating::use_of(association);
    if used == Use::Reject {
        return Ok(Fix::Gated(innovation));
    }
    let weight = gating::weight(association);
    ekf.update_predicted(prediction, innovation.value, noise, weight, bias)
        .map_err(Refusal::Filter)?;
    Ok(match used {
        Use::Accept => Fix::Accepted(innovation),
        _ => Fix::Downweighted(innovation),
    })
}
