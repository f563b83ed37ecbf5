//! The extended Kalman filter: seven states in `f32`, predicted from wheel travel, corrected by one
//! range at a time (`docs/model.md`, eqs. 4 to 6).
//!
//! The filter holds numbers and equations only. Choosing the wall of a range, gating and time are
//! the task of the [`localizer`](crate::localizer).
//!
//! # Form
//! The covariance is stored as its upper triangle. A prediction moves the state and propagates P, eq. (5), with F P Fᵀ
//! multiplied out without the zeros and ones of F, eq. (10). Correction is Joseph's form in two passes of rank one, eq. (19): the
//! first is P − K H P, the second removes its rounding error and that of K. Variances stay positive
//! in single precision even for a range with a variance 10⁶ times smaller than the prior, where the
//! plain form reaches zero. The correlation of two states can exceed what single precision holds; the
//! noise of the range is then raised, eq. (20).
//!
//! # Non-finite policy
//! NaN or infinity in an argument or in an intermediate result is an [`EkfError`], and the filter is
//! unchanged to the bit. Arguments are limited to values far beyond those of a robot: a turn of
//! 64 rad per step, innovations of 1,000 km, variances of (1,000 km)², derivatives of 1,000. Within
//! these limits nothing overflows, and the variances of its row and column bound every entry of P:
//! after a step it is sufficient to check the variances. The previous values are restored if one is
//! invalid.

mod absolute;
mod error;
mod mounted;
mod pose;
mod prediction;
mod turn;
mod update;

use nalgebra::{SMatrix, SVector};

use crate::filter::covariance::{Covariance, PoseBlock, PredictedMeasurement};
use crate::filter::motion::Drive;
use crate::filter::process_noise::{AccumulatedRandomWalk, NoiseDensities};
use crate::geometry::elementary::sqrt;
use crate::geometry::pose::{Heading, Point, Pose};
use crate::geometry::units::{Metres, Radians, SquareMetres};
use crate::geometry::vector::Vector;
use crate::sensor::range::ExpectedRange;
use crate::state::estimate::FilterEstimate;

pub use crate::sensor::range::Innovation;
pub use crate::state::{STATES, StandardDeviations, StateEstimate};
pub use error::EkfError;
use mounted::Mounted;
pub(crate) use pose::{PoseCovariance, PoseUncertainty, PoseVariances};
pub(crate) use turn::{GyroTurn, SlipLimits, TurnAgreement};

/// The filter.
///
/// ```
/// use sonarfix::filter::ekf::{Ekf, StandardDeviations, StateEstimate};
/// use sonarfix::filter::motion::{Drive, WheelTravel};
/// use sonarfix::geometry::units::{Metres, PerRootMetre, Radians};
///
/// let drive = Drive {
///     track_width: Metres(0.35),
///     wheel_noise: PerRootMetre(Metres(0.0005)),
///     scale_walk: PerRootMetre(5e-6),
///     track_width_walk: PerRootMetre(Metres(5e-6)),
/// };
/// let deviations = StandardDeviations {
///     x: Metres(0.001),
///     y: Metres(0.001),
///     heading: Radians(0.001),
///     scale_right: 0.01,
///     scale_left: 0.01,
///     track_width_error: Metres(0.01),
///     range_scale: 0.0,
/// };
/// let mut ekf = Ekf::new(drive, StateEstimate::default(), deviations)?;
/// for _ in 0..10 {
///     ekf.predict(WheelTravel::new(0.04, 0.04))?;
/// }
/// assert!((ekf.state().x.0 - 0.4).abs() < 1e-6);
/// // The scale errors are uncertain by 1 %, so 0.4 m of travel is uncertain by 2.8 mm.
/// assert!((ekf.standard_deviations().x.0 - 0.0030).abs() < 0.0001);
/// # Ok::<(), sonarfix::filter::ekf::EkfError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ekf {
    /// X̂.
    estimate: FilterEstimate,
    /// P without the random walk of the calibration since the last update.
    p_without_walk: Covariance,
    /// Distance of both wheels together since the last update, metres.
    distance_since_update: f32,
    track_width: f32,
    densities: NoiseDensities,
    /// The place of the sonar, if it is estimated.
    mounted: Mounted,
}

impl Ekf {
    /// A filter at `state`, with independent errors of these standard deviations.
    ///
    /// A deviation of zero means that the state is known exactly; for the range scale, that it is not
    /// estimated. The two scale errors are either both known exactly or both uncertain, because the
    /// filter holds their mean and difference.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`], [`EkfError::NegativeVariance`] or [`EkfError::VarianceTooLarge`] if
    /// that is true of an argument.
    pub fn new(
        drive: Drive,
        state: StateEstimate,
        deviation: StandardDeviations,
    ) -> Result<Self, EkfError> {
        let deviations = deviation.to_array();
        if !state.to_array().iter().chain(&deviations).all(|number| number.is_finite())
            || !drive.is_finite()
        {
            return Err(EkfError::NotFinite);
        }
        if deviations.iter().any(|&sigma| sigma < 0.0) {
            return Err(EkfError::NegativeVariance);
        }
        let p = Covariance::independent(&deviation);
        let densities = NoiseDensities::new(&drive);
        if !p.is_valid() || !densities.is_valid() {
            return Err(EkfError::VarianceTooLarge);
        }
        Ok(Self {
            estimate: FilterEstimate::new(&state),
            p_without_walk: p,
            distance_since_update: 0.0,
            track_width: drive.track_width.0,
            densities,
            mounted: Mounted::EXACT,
        })
    }

    /// A new filter with the scale errors of its wheels correlated: `S_R − S_L` has this standard deviation, and those of both
    /// are the same.
    #[must_use]
    pub(crate) fn with_scale_difference(mut self, deviation: f32) -> Self {
        self.p_without_walk.calibration.correlate_wheels(deviation);
        self
    }

    /// Estimates the place of the sonar as well: two further states. At a deviation of zero it is exact.
    pub(crate) fn estimate_mount(&mut self, place: Point, deviation: Metres) {
        self.mounted.estimate(place, deviation);
    }

    /// Adapts the noise of the wheels to the mean NIS of the ranges.
    #[inline]
    pub(crate) fn adapt_noise(&mut self, drive: &Drive, mean_nis: f32) {
        self.densities.adapt(drive, mean_nis);
    }

    /// The noise of the wheels as a multiple of the drive's, as deviations.
    pub(crate) fn noise_factor(&self, drive: &Drive) -> f32 {
        self.densities.wheel_factor(drive)
    }

    /// The place of the sonar, if it is estimated.
    #[inline]
    pub(crate) fn place_of_sonar(&self) -> Option<Point> {
        self.mounted.get().map(|mount| mount.place)
    }

    /// The place of the sonar in the robot frame, if it is estimated, and the standard deviations of its coordinates.
    #[must_use]
    pub fn mount(&self) -> Option<(Point, (Metres, Metres))> {
        self.mounted.get().map(|mount| (mount.place, mount.deviations()))
    }

    /// The estimate X̂.
    #[must_use]
    pub fn state(&self) -> StateEstimate {
        self.estimate.state()
    }

    /// X̂ in the coordinates of the filter.
    pub(crate) fn estimate(&self) -> FilterEstimate {
        self.estimate
    }

    /// The estimated heading.
    pub(crate) fn heading(&self) -> Heading {
        Heading::new(Radians(self.estimate.heading))
    }

    /// The estimate X̂ as a 7×1 vector, in the order and units of [`StateEstimate::to_array`].
    #[must_use]
    pub fn state_vector(&self) -> SVector<f32, STATES> {
        SVector::from(self.state().to_array())
    }

    /// The covariance P, 7×7, exactly symmetric, in the order of [`Self::state_vector`].
    #[must_use]
    pub fn covariance(&self) -> SMatrix<f32, STATES, STATES> {
        self.p().to_matrix()
    }

    /// One standard deviation of each state.
    #[must_use]
    pub fn standard_deviations(&self) -> StandardDeviations {
        self.p_without_walk.standard_deviations(&self.walk())
    }

    /// P.
    fn p(&self) -> Covariance {
        let mut p = self.p_without_walk;
        p.add_random_walk(&self.walk());
        p
    }

    /// The random walk of the calibration since the last update.
    #[inline]
    fn walk(&self) -> AccumulatedRandomWalk {
        AccumulatedRandomWalk::new(&self.densities, self.distance_since_update)
    }

    /// Covariance of the position and variance of the heading, which contain no random walk.
    pub(crate) fn pose_covariance(&self) -> PoseCovariance {
        let PoseBlock { xx, xy, yy, hh, .. } = self.p_without_walk.pose;
        PoseCovariance { xx, xy, yy, hh }
    }

    /// The variances of the pose.
    pub(crate) fn pose_variances(&self) -> PoseVariances {
        let PoseCovariance { xx, yy, hh, .. } = self.pose_covariance();
        PoseVariances { xx, yy, hh }
    }

    /// Replaces the variances of the pose by valid ones, each not less than with which P was a covariance.
    pub(crate) fn set_pose_variances(&mut self, variances: PoseVariances) {
        let p = &mut self.p_without_walk.pose;
        (p.xx, p.yy, p.hh) = (variances.xx, variances.yy, variances.hh);
    }

    /// Uncertainty of the pose: root of the larger eigenvalue of the position's covariance, and
    /// deviation of the heading.
    pub(crate) fn pose_uncertainty(&self) -> PoseUncertainty {
        let PoseCovariance { xx, xy, yy, hh } = self.pose_covariance();
        let (half, middle) = (0.5 * (xx - yy), 0.5 * (xx + yy));
        PoseUncertainty {
            position: Metres(sqrt(middle + sqrt(half * half + xy * xy))),
            heading: Radians(sqrt(hh)),
        }
    }

    /// Adds independent errors with these standard deviations to x and y and to the heading.
    ///
    /// The state and all other entries of P are unchanged.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`] or [`EkfError::NegativeVariance`] if that is true of an argument;
    /// [`EkfError::VarianceTooLarge`] if a variance would leave its limits. The filter is unchanged.
    ///
    /// # Panics
    /// Never.
    pub fn inflate_pose(&mut self, position: Metres, heading: Radians) -> Result<(), EkfError> {
        if !position.is_finite() || !heading.is_finite() {
            return Err(EkfError::NotFinite);
        }
        if position < Metres(0.0) || heading < Radians(0.0) {
            return Err(EkfError::NegativeVariance);
        }
        let p = &mut self.p_without_walk.pose;
        let before = *p;
        p.xx += position.0 * position.0;
        p.yy += position.0 * position.0;
        p.hh += heading.0 * heading.0;
        if p.is_valid() {
            return Ok(());
        }
        *p = before;
        Err(EkfError::VarianceTooLarge)
    }

    /// Replaces the pose by one that was measured independently, with independent errors of these
    /// standard deviations. The calibration and its covariance are unchanged; their covariance with the
    /// pose becomes zero.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`], [`EkfError::NegativeVariance`] or [`EkfError::VarianceTooLarge`] if that
    /// is true of an argument. The filter is unchanged.
    ///
    /// # Panics
    /// Never.
    pub fn set_pose(
        &mut self,
        pose: Pose,
        position: Metres,
        heading: Radians,
    ) -> Result<(), EkfError> {
        let block = pose_block(pose, position, heading)?;
        let p = &mut self.p_without_walk;
        p.pose = block;
        p.range_scale.forget_pose();
        if let Some(mount) = self.mounted.get_mut() {
            mount.forget_pose();
        }
        self.estimate.set_pose(pose);
        Ok(())
    }

    /// The innovation of a measured `range` with noise variance `noise`. The filter is unchanged.
    #[inline]
    #[must_use]
    pub fn innovation(
        &self,
        range: Metres,
        expected: &ExpectedRange,
        noise: SquareMetres,
    ) -> Innovation {
        self.predict_measurement(expected, None).innovation(range, noise)
    }

    // ===== Eqs. (14) and (55): P Hᵀ, H P Hᵀ and L =====
    /// H, P Hᵀ and H P Hᵀ of an expected range; none of them depends on the random walk. `ahead`: for a range of the ranger whose
    /// mount is estimated, the unit vector ahead of the robot in map axes.
    #[cfg_attr(not(feature = "mount"), inline)]
    pub(crate) fn predict_measurement<'e>(
        &self,
        expected: &'e ExpectedRange,
        ahead: Option<Vector>,
    ) -> PredictedMeasurement<'e> {
        let mut prediction = self.p_without_walk.project(expected);
        if let Some((mount, ahead)) = self.mounted.get().zip(ahead) {
            let by = Vector::new(expected.by_x, expected.by_y);
            mount.add_to(&mut prediction, (by.dot(ahead), by.dot(ahead.left())));
        }
        prediction
    }

    /// Covariance of an expected range with the mean and the difference of the scale errors.
    pub(crate) fn cross_covariance_of_wheels(&self, of: &PredictedMeasurement) -> (f32, f32) {
        self.p_without_walk.cross_covariance_of_wheels(of)
    }
}

/// Why a covariance is not valid.
#[cold]
fn invalid(p: &Covariance) -> EkfError {
    if p.has_negative_variance() { EkfError::Indefinite } else { EkfError::VarianceTooLarge }
}

/// P of a pose that was measured independently, with independent errors of these standard deviations.
///
/// # Errors
/// Those of [`Ekf::set_pose`].
pub(crate) fn pose_block(
    pose: Pose,
    position: Metres,
    heading: Radians,
) -> Result<PoseBlock, EkfError> {
    if !pose.is_finite() || !position.is_finite() || !heading.is_finite() {
        return Err(EkfError::NotFinite);
    }
    if position < Metres(0.0) || heading < Radians(0.0) {
        return Err(EkfError::NegativeVariance);
    }
    let block = PoseBlock::independent(position, heading);
    if block.is_valid() { Ok(block) } else { Err(EkfError::VarianceTooLarge) }
}

#[cfg(test)]
mod tests;
