//! Prediction from wheel travel. The state moves with every increment; P changes when it is asked for (`docs/model.md`,
//! "Covariance on demand").

use super::{Ekf, EkfError, invalid};
use crate::filter::accumulated::{AccumulatedMotion, CalibratedDrive, LONGEST};
use crate::filter::covariance::Covariance;
use crate::filter::motion::WheelTravel;
use crate::filter::process_noise::AccumulatedRandomWalk;
use crate::geometry::numeric::{at_most, is_within};
use crate::geometry::trig::sin_cos_within;
use crate::state::estimate::FilterEstimate;

/// Largest turn of one step, radians: the mid-heading stays in the range of the fast reduction of
/// sine and cosine.
pub(super) const MAX_TURN: f32 = 64.0;

/// Longest interval in track widths: the turn stays below 8 (1 + S) rad.
const LONGEST_IN_WIDTHS: f32 = 8.0;
/// Least track width, metres, and limits of the estimate and of P, with which no variance can leave its limits in an interval.
const LEAST_WIDTH: f32 = 0.01;
const MOST_POSE_VARIANCE: f32 = 4e6;
const MOST_CALIBRATION_VARIANCE: f32 = 1e3;

impl Ekf {
    // ===== Eqs. (4) and (5): X̂ ← f(X̂, U), P ← F P Fᵀ + Q =====
    /// Predicts the state over one odometry increment.
    ///
    /// X̂ moves by eq. (7) of `docs/model.md`. The motion is accumulated, eq. (27), and P changes when it is asked for, by eqs.
    /// (28) to (30). Q grows with the distance travelled, never with time: an increment without travel changes nothing.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`] if a travel is; [`EkfError::TurnTooLarge`] beyond 64 rad;
    /// [`EkfError::VarianceTooLarge`] or [`EkfError::Indefinite`] if a variance would leave its
    /// limits. The filter is unchanged.
    ///
    /// # Panics
    /// Never.
    #[inline]
    pub fn predict(&mut self, travel: WheelTravel) -> Result<(), EkfError> {
        let distance = travel.right.abs().0 + travel.left.abs().0;
        if distance <= 0.0 {
            return Ok(());
        }
        // Both comparisons are false for NaN.
        let is_within_interval = self.distance + distance <= self.longest;
        if !is_within_interval {
            self.begin_interval();
            let is_short = distance <= self.longest;
            if !is_short {
                return self.predict_at_once(travel, distance);
            }
        }
        self.accumulate(travel, distance);
        Ok(())
    }

    #[inline(never)]
    fn accumulate(&mut self, travel: WheelTravel, distance: f32) {
        let noise = self.drive.noise(travel);
        let heading = self.estimate.heading;
        self.motion.add(&self.drive, heading, travel, noise, sin_cos_within);
        self.distance += distance;
    }

    /// Predicts over an increment that is not within the limits of an interval, and checks the result.
    #[cold]
    #[inline(never)]
    fn predict_at_once(&mut self, travel: WheelTravel, distance: f32) -> Result<(), EkfError> {
        if !is_within(self.drive.turn(travel).abs(), MAX_TURN) {
            return Err(refused_travel(travel));
        }
        let before = *self;
        self.accumulate(travel, distance);
        self.propagate();
        if self.p_without_walk.pose.is_valid() {
            self.interval_applied();
            return Ok(());
        }
        let error = invalid(&self.p_without_walk);
        *self = before;
        Err(error)
    }

    /// The estimate.
    #[inline]
    pub(super) fn estimate_now(&self) -> FilterEstimate {
        let mut estimate = self.estimate;
        if self.distance > 0.0 {
            self.motion.advance(&mut estimate);
        }
        estimate
    }

    /// Applies the accumulated motion to P. State and P are the same before and after; until the next prediction P is read
    /// and corrected at no further cost.
    #[inline]
    pub fn apply_motion(&mut self) {
        if self.distance > 0.0 {
            self.apply_interval();
        }
    }

    /// Reads this filter after the accumulated motion has been applied, to a copy if there is any.
    #[inline]
    pub(crate) fn applied<T>(&self, read: impl FnOnce(&Self) -> T) -> T {
        let copy;
        // One call, because what is read may be inlined.
        read(if self.distance <= 0.0 {
            self
        } else {
            copy = self.with_motion_applied();
            &copy
        })
    }

    fn with_motion_applied(&self) -> Self {
        let mut applied = *self;
        applied.apply_interval();
        applied
    }

    /// Applies the accumulated motion before a change of estimate or P.
    #[inline]
    pub(super) fn end_interval(&mut self) {
        self.apply_motion();
        self.longest = 0.0;
    }

    #[inline(never)]
    fn apply_interval(&mut self) {
        self.propagate();
        self.p_without_walk.pose.limit_variances();
        self.interval_applied();
    }

    fn propagate(&mut self) {
        let walk = self.walk_of_interval();
        let Self { motion, drive, estimate, p_without_walk, .. } = self;
        propagate(p_without_walk, motion, drive, estimate, &walk);
    }

    /// Propagates a copy of P over the interval.
    pub(super) fn propagate_copy(&self, p: &mut Covariance) {
        propagate(p, &self.motion, &self.drive, &self.estimate, &self.walk_of_interval());
        p.pose.limit_variances();
    }

    fn interval_applied(&mut self) {
        self.motion.advance(&mut self.estimate);
        self.motion = AccumulatedMotion::default();
        self.distance_since_update += self.distance;
        self.distance = 0.0;
    }

    /// The random walk that acts on the pose over the interval: the mean of those at its ends.
    #[inline]
    fn walk_of_interval(&self) -> AccumulatedRandomWalk {
        let middle = self.distance_since_update + 0.5 * self.distance;
        AccumulatedRandomWalk::new(&self.densities, middle)
    }

    /// Begins an interval with the present calibration.
    #[inline(never)]
    fn begin_interval(&mut self) {
        self.apply_motion();
        self.drive = CalibratedDrive::new(self.track_width, &self.densities, &self.estimate);
        let walk =
            AccumulatedRandomWalk::new(&self.densities, self.distance_since_update + LONGEST);
        let width = self.drive.width();
        // False for NaN.
        let is_usual = width >= LEAST_WIDTH
            && self.drive.is_usual()
            && self.p_without_walk.pose.sum_of_variances() <= MOST_POSE_VARIANCE
            && self.p_without_walk.calibration.sum_of_variances(&walk) <= MOST_CALIBRATION_VARIANCE;
        let longest = at_most(LONGEST_IN_WIDTHS * width, self.longest_by_noise);
        self.longest = if is_usual { longest } else { 0.0 };
    }
}

// ===== Eq. (30): P over the interval =====
#[inline(never)]
fn propagate(
    p: &mut Covariance,
    motion: &AccumulatedMotion,
    drive: &CalibratedDrive,
    at: &FilterEstimate,
    walk: &AccumulatedRandomWalk,
) {
    p.propagate(walk, &motion.transition(drive, at));
}

/// Why a travel is refused before P is propagated.
#[cold]
pub(super) fn refused_travel(travel: WheelTravel) -> EkfError {
    if travel.is_finite() { EkfError::TurnTooLarge } else { EkfError::NotFinite }
}

#[cfg(test)]
mod tests;
