//! Correction by a range: equation (6), certain or by probabilistic data association.

use super::{Ekf, EkfError, invalid};
use crate::filter::covariance::{Correction, Covariance, Gain, GyroBias, PredictedMeasurement};
use crate::geometry::numeric::is_within;
use crate::geometry::units::{Metres, SquareMetres};
use crate::sensor::range::ExpectedRange;

/// Largest magnitude of an innovation, m.
const MAX_INNOVATION: f32 = 1e6;

/// Largest noise variance of a range, m².
const MAX_NOISE: f32 = 1e6;

/// Largest sum of squares of the derivatives of a range.
const MAX_JACOBIAN_SQUARED: f32 = 1e6;

impl Ekf {
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
        let prediction = self.predict_measurement(expected, None);
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
        let prediction = self.predict_measurement(expected, None);
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
            self.correct_beside(prediction, &gain, innovation.0, -growth, bias);
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
                self.correct_beside(prediction, &gain, innovation.0, 1.0, bias);
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

impl Ekf {
    /// Corrects what stands beside P after P; `share` of K mᵀ is what P has lost.
    fn correct_beside(
        &mut self,
        prediction: &PredictedMeasurement,
        gain: &Gain,
        innovation: f32,
        share: f32,
        bias: Option<&mut GyroBias>,
    ) {
        let own = self.mounted.get().map(|mount| mount.covariance_with(prediction));
        if let Some(bias) = bias {
            bias.correct(prediction, own.unwrap_or_default(), gain, innovation, share);
        }
        if let (Some(mount), Some(own)) = (self.mounted.get_mut(), own) {
            mount.correct(own, gain, innovation, share);
        }
    }
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
