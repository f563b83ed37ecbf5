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
mod prediction;
mod turn;

use nalgebra::{SMatrix, SVector};

use crate::filter::covariance::{
    Correction, Covariance, GyroBias, PoseBlock, PredictedMeasurement,
};
use crate::filter::motion::Drive;
use crate::filter::process_noise::{AccumulatedRandomWalk, NoiseDensities};
use crate::geometry::elementary::sqrt;
use crate::geometry::numeric::{at_most_max_variance, is_within};
use crate::geometry::pose::{Heading, Pose};
use crate::geometry::units::{Metres, Radians, SquareMetres};
use crate::sensor::range::ExpectedRange;
use crate::state::estimate::FilterEstimate;

pub use crate::sensor::range::Innovation;
pub use crate::state::{STATES, StandardDeviations, StateEstimate};
pub(crate) use turn::{GyroTurn, SlipLimits, TurnAgreement};

/// Largest magnitude of an innovation, m.
const MAX_INNOVATION: f32 = 1e6;

/// Largest noise variance of a range, m².
const MAX_NOISE: f32 = 1e6;

/// Largest sum of squares of the derivatives of a range.
const MAX_JACOBIAN_SQUARED: f32 = 1e6;

/// Reason for which the filter refuses a call. The filter is unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum EkfError {
    /// An argument is NaN or infinite.
    NotFinite,
    /// A variance or a standard deviation is negative.
    NegativeVariance,
    /// A variance would become negative: P would no longer be a covariance.
    Indefinite,
    /// The noise variance of a range is zero: P would become singular.
    ZeroNoise,
    /// The turn of one step is larger than 64 rad.
    TurnTooLarge,
    /// The innovation is larger than 1,000 km.
    InnovationTooLarge,
    /// The noise variance of a range is larger than 1 km².
    NoiseTooLarge,
    /// The derivatives of the expected range are NaN or larger than 1,000.
    JacobianTooLarge,
    /// A variance would exceed (1,000 km)².
    VarianceTooLarge,
}

impl core::fmt::Display for EkfError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a value is NaN or infinite",
            Self::NegativeVariance => "a variance or a standard deviation is negative",
            Self::Indefinite => "a variance would become negative",
            Self::ZeroNoise => "the noise variance of a range is zero",
            Self::TurnTooLarge => "the turn of one step is larger than 64 rad",
            Self::InnovationTooLarge => "the innovation is larger than 1,000 km",
            Self::NoiseTooLarge => "the noise variance of a range is larger than 1 km²",
            Self::JacobianTooLarge => "the derivatives of a range are NaN or larger than 1,000",
            Self::VarianceTooLarge => "a variance would exceed (1,000 km)²",
        })
    }
}

impl core::error::Error for EkfError {}

/// Covariance of the position, m², and variance of the heading, rad².
pub(crate) struct PoseCovariance {
    pub xx: f32,
    pub xy: f32,
    pub yy: f32,
    pub hh: f32,
}

/// Variances of x and y, m², and of the heading, rad².
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PoseVariances {
    xx: f32,
    yy: f32,
    hh: f32,
}

impl PoseVariances {
    /// With independent errors of these standard deviations, m and rad; at most the largest variance of a filter.
    pub fn plus(self, position: f32, heading: f32) -> Self {
        let sum = |variance: f32, sigma: f32| at_most_max_variance(variance + sigma * sigma);
        Self { xx: sum(self.xx, position), yy: sum(self.yy, position), hh: sum(self.hh, heading) }
    }
}

/// Uncertainty of the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PoseUncertainty {
    /// Standard deviation of the position in the direction in which it is largest.
    pub position: Metres,
    /// Standard deviation of the heading.
    pub heading: Radians,
}

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
        })
    }

    /// A new filter with the scale errors of its wheels correlated: `S_R − S_L` has this standard deviation, and those of both
    /// are the same.
    #[must_use]
    pub(crate) fn with_scale_difference(mut self, deviation: f32) -> Self {
        self.p_without_walk.calibration.correlate_wheels(deviation);
        self
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
        if !pose.is_finite() || !position.is_finite() || !heading.is_finite() {
            return Err(EkfError::NotFinite);
        }
        if position < Metres(0.0) || heading < Radians(0.0) {
            return Err(EkfError::NegativeVariance);
        }
        let block = PoseBlock::independent(position, heading);
        if !block.is_valid() {
            return Err(EkfError::VarianceTooLarge);
        }
        let p = &mut self.p_without_walk;
        p.pose = block;
        p.range_scale.forget_pose();
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
        self.predict_measurement(expected).innovation(range, noise)
    }

    /// H, P Hᵀ and H P Hᵀ of an expected range; none of them depends on the random walk.
    #[inline]
    pub(crate) fn predict_measurement<'e>(
        &self,
        expected: &'e ExpectedRange,
    ) -> PredictedMeasurement<'e> {
        self.p_without_walk.project(expected)
    }

    /// Covariance of an expected range with the mean and the difference of the scale errors.
    pub(crate) fn cross_covariance_of_wheels(&self, expected: &ExpectedRange) -> (f32, f32) {
        self.p_without_walk.cross_covariance_of_wheels(expected)
    }

    // ===== Eq. (6): K, X̂ ← X̂ + K ν, P ← P − K H P =====
    /// Corrects the state by one measured `range` with noise variance `noise`.
    ///
    /// There is no gate: the range is applied as given, except that its noise is raised where single
    /// precision could not hold the result (`docs/model.md`, eq. 20).
    ///
    /// # Errors
    /// [`EkfError`], by what is wrong with an argument, or [`EkfError::Indefinite`] or
    /// [`EkfError::VarianceTooLarge`] if a variance would leave its limits. The filter is unchanged.
    ///
    /// # Panics
    /// Never.
    pub fn update(
        &mut self,
        range: Metres,
        expected: &ExpectedRange,
        noise: SquareMetres,
    ) -> Result<(), EkfError> {
        let innovation = range - expected.range;
        check_measurement(expected, innovation, noise)?;
        let prediction = self.predict_measurement(expected);
        self.correct(&prediction, innovation, noise, 1.0, None)
    }

    /// Corrects the state by a `range` that belongs to the expected wall with a probability of
    /// `association`, by probabilistic data association (`docs/model.md`, eq. 16).
    ///
    /// The state takes that share of the correction. The covariance is that of a certain association,
    /// plus the uncertainty of the association along the gain. At 1 this is [`Self::update`], bit for
    /// bit; at 0 nothing changes.
    ///
    /// # Errors
    /// As of [`Self::update`]; [`EkfError::NotFinite`] if `association` is not between 0 and 1.
    ///
    /// # Panics
    /// Never.
    pub fn update_associated(
        &mut self,
        range: Metres,
        expected: &ExpectedRange,
        noise: SquareMetres,
        association: f32,
    ) -> Result<(), EkfError> {
        let prediction = self.predict_measurement(expected);
        self.update_predicted(&prediction, range - expected.range, noise, association, None)
    }

    /// [`Self::update_associated`] with a measurement that was predicted from this filter, unchanged
    /// since, and with the bias of a gyro.
    pub(crate) fn update_predicted(
        &mut self,
        prediction: &PredictedMeasurement,
        innovation: Metres,
        noise: SquareMetres,
        association: f32,
        bias: Option<&mut GyroBias>,
    ) -> Result<(), EkfError> {
        if !is_within(association, 1.0) {
            return Err(EkfError::NotFinite);
        }
        if association <= 0.0 {
            return Ok(());
        }
        check_measurement(prediction.expected, innovation, noise)?;
        self.correct(prediction, innovation, noise, association, bias)
    }

    // ===== Eq. (16): X̂ ← X̂ + β K ν, P ← P − (1 − a) K mᵀ with a = (1 − β)(1 + β ν²/S) =====
    #[inline]
    fn correct(
        &mut self,
        prediction: &PredictedMeasurement,
        innovation: Metres,
        noise: SquareMetres,
        association: f32,
        bias: Option<&mut GyroBias>,
    ) -> Result<(), EkfError> {
        let clutter = 1.0 - association;
        if clutter <= 0.0 {
            return self.correct_certain(prediction, innovation, noise, bias);
        }
        let s = noise.0 + prediction.variance;
        let spread = clutter * (1.0 + association * innovation.0 * innovation.0 / s);
        if spread >= 1.0 {
            return self.spread(prediction, innovation * association, s, spread - 1.0, bias);
        }
        // The same P and X̂ as of a certain association with S' = S/(1 − a) and ν' = β ν S'/S.
        let factor = 1.0 / (1.0 - spread);
        let noise = SquareMetres(noise.0 + s * (spread * factor));
        self.correct_certain(prediction, innovation * (association * factor), noise, bias)
    }

    /// Corrects the state by a range that probably is clutter and fits so badly that P grows by the share
    /// `growth` of S along the gain.
    #[cold]
    fn spread(
        &mut self,
        prediction: &PredictedMeasurement,
        innovation: Metres,
        s: f32,
        growth: f32,
        bias: Option<&mut GyroBias>,
    ) -> Result<(), EkfError> {
        let before = self.p_without_walk;
        // False for NaN.
        let is_positive = s >= f32::MIN_POSITIVE;
        if !is_positive {
            return Err(EkfError::Indefinite);
        }
        let p = &mut self.p_without_walk;
        let gain = p.gain(prediction, s);
        p.add_along_gain(&gain, growth * s);
        if p.is_valid() {
            gain.correct(&mut self.estimate, innovation.0);
            if let Some(bias) = bias {
                bias.correct(prediction, &gain, innovation.0, -growth);
            }
            return Ok(());
        }
        let error = invalid(p);
        *p = before;
        Err(error)
    }

    #[inline]
    fn correct_certain(
        &mut self,
        prediction: &PredictedMeasurement,
        innovation: Metres,
        noise: SquareMetres,
        bias: Option<&mut GyroBias>,
    ) -> Result<(), EkfError> {
        // In three parts, each small enough to be copied without a call.
        let Covariance { pose, calibration, range_scale } = self.p_without_walk;
        let walk = self.walk();
        let p = &mut self.p_without_walk;
        p.add_random_walk(&walk);
        let error = match p.correct(prediction, noise.0) {
            Correction::Applied(gain) if p.is_valid() => {
                self.distance_since_update = 0.0;
                gain.correct(&mut self.estimate, innovation.0);
                if let Some(bias) = bias {
                    bias.correct(prediction, &gain, innovation.0, 1.0);
                }
                return Ok(());
            }
            Correction::Saturated => {
                self.distance_since_update = 0.0;
                return Ok(());
            }
            Correction::Applied(_) => invalid(p),
            Correction::Indefinite => EkfError::Indefinite,
        };
        p.pose = pose;
        p.calibration = calibration;
        p.range_scale = range_scale;
        Err(error)
    }
}

/// Why a covariance is not valid.
#[cold]
fn invalid(p: &Covariance) -> EkfError {
    if p.has_negative_variance() { EkfError::Indefinite } else { EkfError::VarianceTooLarge }
}

/// Whether the filter computes with a measurement.
#[inline]
fn check_measurement(
    expected: &ExpectedRange,
    innovation: Metres,
    noise: SquareMetres,
) -> Result<(), EkfError> {
    let is_noise_valid = noise.0 > 0.0 && noise.0 <= MAX_NOISE;
    let is_innovation_valid = innovation.0.abs() <= MAX_INNOVATION;
    if !(is_noise_valid && is_innovation_valid) {
        return Err(refused_range(innovation, noise));
    }
    // False for NaN.
    let is_jacobian_valid = expected.jacobian().squared().sum() <= MAX_JACOBIAN_SQUARED;
    if is_jacobian_valid { Ok(()) } else { Err(EkfError::JacobianTooLarge) }
}

/// Why a range is refused before P is corrected.
#[cold]
fn refused_range(innovation: Metres, noise: SquareMetres) -> EkfError {
    if !innovation.is_finite() || !noise.is_finite() {
        EkfError::NotFinite
    } else if noise.0 < 0.0 {
        EkfError::NegativeVariance
    } else if noise.0 <= 0.0 {
        EkfError::ZeroNoise
    } else if noise.0 > MAX_NOISE {
        EkfError::NoiseTooLarge
    } else {
        EkfError::InnovationTooLarge
    }
}

#[cfg(test)]
mod tests;
