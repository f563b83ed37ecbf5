//! Correction by an absolute measurement (`docs/model.md`, "Heading, position and pose").

use super::{Ekf, EkfError, Mounted, invalid};
use crate::filter::covariance::{Gain, GyroBias};
use crate::geometry::pose::Heading;
use crate::geometry::units::{Metres, Radians, SquareMetres};
use crate::sensor::absolute::{Components, Fit, PoseMatrix, PoseVector, Return};
use crate::sensor::range::ExpectedRange;
use crate::state::estimate::FilterEstimate;

/// An absolute measurement seen from the filter: computed once, used by gate and correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PredictedPose {
    measured: Components,
    /// Derivatives of x and y at the time of the measurement by the present heading, m/rad.
    lever: (f32, f32),
    /// ν.
    innovation: PoseVector,
    /// S; the identity for what was not measured.
    s: PoseMatrix,
}

impl PredictedPose {
    /// How the measurement agrees with the estimate; `None` if S is not positive definite.
    pub fn fit(&self) -> Option<Fit> {
        let s = self.s.decorrelated()?;
        let Components { has_position, has_heading, .. } = self.measured;
        let nis = s.squared(&self.innovation);
        Some(Fit { nis, determinant: s.determinant(), has_position, has_heading })
    }

    /// A linear combination of the pose at the time of the measurement, as a function of the present states.
    fn row(&self, combination: &PoseVector) -> ExpectedRange {
        let (x, y) = self.lever;
        let by_heading = combination.h + combination.x * x + combination.y * y;
        ExpectedRange::linear(combination.x, combination.y, by_heading)
    }
}

impl Ekf {
    // ===== Eqs. (40) and (41): ν and S =====
    /// An absolute measurement, seen from the filter; `back` leads to the pose at its time.
    pub(crate) fn predict_absolute(&self, measured: &Components, back: &Return) -> PredictedPose {
        let (z, then) = (&measured.value, &back.moved);
        let at = self.estimate;
        let turned = Heading::new(Radians(at.heading - then.h));
        let mut innovation = PoseVector {
            x: z.x - (at.x - then.x),
            y: z.y - (at.y - then.y),
            h: Heading::new(Radians(z.h)).from(turned).0,
        };
        let lever = (then.y, -then.x);
        let [x, y, h] = [
            ExpectedRange::linear(1.0, 0.0, lever.0),
            ExpectedRange::linear(0.0, 1.0, lever.1),
            ExpectedRange::linear(0.0, 0.0, 1.0),
        ];
        let (px, py) = (self.predict_measurement(&x, None), self.predict_measurement(&y, None));
        let ph = self.predict_measurement(&h, None);
        let (mx, my) = (&px.cross_covariance, &py.cross_covariance);
        let mut s = measured.noise;
        if measured.has_position {
            s.xx += px.variance;
            s.xy += mx.y + lever.1 * mx.h;
            s.yy += py.variance;
        } else {
            (innovation.x, innovation.y) = (0.0, 0.0);
        }
        if measured.has_heading {
            s.hh += ph.variance;
        } else {
            innovation.h = 0.0;
        }
        if measured.has_position && measured.has_heading {
            s.xh += mx.h;
            s.yh += my.h;
        }
        PredictedPose { measured: *measured, lever, innovation, s }
    }

    /// Corrects the state by an absolute measurement that was predicted from this filter, unchanged since, and is no outlier
    /// with a probability of `association`.
    ///
    /// # Errors
    /// [`EkfError`], by what is wrong with the noise or the result. Filter and bias are unchanged.
    pub(crate) fn update_absolute(
        &mut self,
        prediction: &PredictedPose,
        association: f32,
        mut bias: Option<&mut GyroBias>,
    ) -> Result<(), EkfError> {
        let before = (*self, bias.as_deref().copied());
        let result = self.try_update_absolute(prediction, association, bias.as_deref_mut());
        if result.is_err() {
            *self = before.0;
            if let (Some(bias), Some(before)) = (bias, before.1) {
                *bias = before;
            }
        }
        result
    }

    // ===== Eqs. (42) to (44): one independent combination after the other =====
    fn try_update_absolute(
        &mut self,
        prediction: &PredictedPose,
        association: f32,
        mut bias: Option<&mut GyroBias>,
    ) -> Result<(), EkfError> {
        let (before, mounted) = (self.estimate, self.mounted);
        let column = bias.as_deref().copied();
        let unlikely = (1.0 - association) / association;
        let Components { noise, has_position, has_heading, .. } = prediction.measured;
        let noise = noise.plus(unlikely, &prediction.s);
        let independent = noise.decorrelated().ok_or(EkfError::Indefinite)?;
        let is_measured = [has_position, has_position, has_heading];
        let rows = independent.rows.iter().zip(independent.variances).zip(is_measured);
        for ((row, variance), _) in rows.filter(|(_, is_measured)| *is_measured) {
            let expected = prediction.row(row);
            let h = expected.jacobian();
            let corrected = self.estimate.pose_since(&before);
            let corrected = h.x * corrected.0 + h.y * corrected.1 + h.h * corrected.2;
            let innovation = Metres(row.dot(&prediction.innovation) - corrected);
            let predicted = self.predict_measurement(&expected, None);
            let variance = SquareMetres(variance);
            self.update_predicted(&predicted, innovation, variance, 1.0, bias.as_deref_mut())?;
        }
        if unlikely > 0.0 {
            self.spread_along(&before, &mounted, unlikely, bias.zip(column))?;
        }
        Ok(())
    }

    // ===== Eq. (44): P ← P + (1 − β)/β δ δᵀ =====
    /// Adds the uncertainty of the association along the correction since `before`.
    fn spread_along(
        &mut self,
        before: &FilterEstimate,
        mounted: &Mounted,
        amount: f32,
        bias: Option<(&mut GyroBias, GyroBias)>,
    ) -> Result<(), EkfError> {
        let correction = Gain::between(before, &self.estimate);
        let p = &mut self.p_without_walk;
        p.add_along_gain(&correction, amount);
        if !p.is_valid() {
            return Err(invalid(p));
        }
        let mount = self.mounted.get_mut().zip(mounted.get());
        let moved = mount.as_ref().map(|(mount, before)| mount.moved_since(before));
        if let Some((bias, column)) = bias {
            bias.add_along(&column, &correction, moved.unwrap_or_default(), amount);
        }
        if let (Some((mount, _)), Some(moved)) = (mount, moved) {
            mount.add_along(&correction, moved, amount);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
