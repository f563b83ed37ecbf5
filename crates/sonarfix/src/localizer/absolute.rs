//! Absolute measurements: headings, positions and poses that were measured independently.
//!
//! # Non-finite policy
//! That of the [localizer](super).

use super::Localizer;
use crate::association::gating::{self, Use};
use crate::association::outcome::{AbsoluteFix, AbsoluteRefusal, Agreement};
use crate::filter::ekf::EkfError;
use crate::filter::gyro_fusion::GyroFusion;
use crate::geometry::units::Instant;
use crate::sensor::absolute::{AbsoluteMeasurement, MeasurementError, OutsideStep, Probabilities};

impl Localizer<'_> {
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
        let Probabilities { association, evidence } = fit.explain(outliers);
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
            self.mount_changed();
            match used {
                Use::Accept => AbsoluteFix::Accepted(agreement),
                _ => AbsoluteFix::Downweighted(agreement),
            }
        };
        self.sources.of(measured.has_position).record(1.0 - association, outliers, now);
        let uncertainty = self.ekf.pose_uncertainty();
        let is_repeated = gating::is_known(outliers);
        let has_position = measured.has_position;
        let health = &mut self.health;
        health.record_absolute(
            &fix,
            has_position,
            evidence,
            is_repeated,
            uncertainty,
            &self.limits,
        );
        if gating::contradicts(association, outliers) {
            self.inflate_if_lost();
        }
        Ok(fix)
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
