//! The odometry: travels of the wheels predict the estimate; while none arrive, its covariance grows.
//!
//! # Non-finite policy
//! That of the [localizer](super).

use super::passage::Path;
use super::unseen::Unseen;
use super::{Localizer, NO_TIME};
use crate::filter::ekf::EkfError;
use crate::filter::motion::WheelTravel;
use crate::filter::odometry::{self, OdometryError};
use crate::geometry::units::{Duration, Instant, Radians, seconds};
use crate::geometry::vector::Vector;
use crate::health::Verdict;
use crate::sensor::absolute::{LastStep, PoseVector, Sources};
use crate::sensor::gyro::MeasuredTurn;

impl Localizer<'_> {
    /// Predicts the estimate over the travel of both wheels since the last call, up to the time `now`.
    ///
    /// To be called at every encoder sample, and at the instant when an echo left the wall. If the path has led through a wall of the map,
    /// the verdict is `Lost` (`docs/model.md`, eq. 59).
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
        self.step = if is_seen {
            LastStep::new(self.time, PoseVector { x, y, h })
        } else {
            LastStep::none(now)
        };
        // The path of a period without odometry is unknown, and that of a lost robot does not matter.
        if !is_seen || self.health.verdict == Verdict::Lost {
            self.path = Path::default();
        } else if self.path.extend(Vector::new(x, y), &self.ekf, &self.map) {
            self.health.record_passage();
        }
        self.history.record_turn(Radians(h), seconds(elapsed));
        self.history.record_distance(travel.distance());
        (self.time, self.recorded) = (now, now);
        self.health.record_travel(travel.distance(), unrecorded, &self.limits);
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
                gyro.predict(&mut self.ekf, travel, elapsed, turn, parameters)?;
                self.mount_changed();
                Ok(())
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
        let uncertainty = self.ekf.pose_uncertainty();
        self.health.record_unseen(unseen_for, unrecorded, uncertainty, &self.limits);
        self.recorded = self.recorded.max(now);
    }

    /// Continues after the clock was set back: `now` is the time of the last accepted travel by the new clock, or the present time if
    /// that is unknown. The next travel is that since the last accepted one; times of earlier pings are forgotten, and
    /// measurements from before are refused.
    pub fn set_clock(&mut self, now: Instant) {
        (self.time, self.recorded, self.pinged) = (now, now, now);
        self.step = LastStep::none(now);
        self.sources = Sources::new(now);
        if self.unseen.is_some() {
            self.unseen = Some(Unseen::new(now, &self.ekf));
        }
    }
}
