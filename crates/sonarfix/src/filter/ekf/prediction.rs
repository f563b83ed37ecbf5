//! Prediction from wheel travel: state and covariance move with every increment.

use super::{Ekf, EkfError, invalid};
use crate::filter::covariance::{Covariance, GyroBias, Transition};
use crate::filter::motion::{LinearizedMotion, WheelTravel};
use crate::filter::process_noise::ProcessNoise;
use crate::geometry::numeric::is_within;
use crate::geometry::trig::sin_cos_within;

/// Largest turn of one step, radians: the mid-heading stays in the range of the fast reduction of
/// sine and cosine.
pub(super) const MAX_TURN: f32 = 64.0;

impl Ekf {
    // ===== Eqs. (4) and (5): X̂ ← f(X̂, U), P ← F P Fᵀ + Q =====
    /// Predicts the state over one odometry increment.
    ///
    /// X̂ moves by eq. (7) of `docs/model.md`, P changes by eqs. (8) to (10). Q grows with the
    /// distance travelled, never with time: an increment without travel changes nothing.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`] if a travel is; [`EkfError::TurnTooLarge`] beyond 64 rad;
    /// [`EkfError::VarianceTooLarge`] or [`EkfError::Indefinite`] if a variance would leave its
    /// limits. The filter is unchanged.
    ///
    /// # Panics
    /// Never.
    pub fn predict(&mut self, travel: WheelTravel) -> Result<(), EkfError> {
        self.predict_by_wheels(travel, None)
    }

    /// [`Self::predict`], with the covariances of the bias of a gyro.
    pub(super) fn predict_by_wheels(
        &mut self,
        travel: WheelTravel,
        bias: Option<&mut GyroBias>,
    ) -> Result<(), EkfError> {
        let distance = travel.right.abs().0 + travel.left.abs().0;
        if distance <= 0.0 {
            return Ok(());
        }
        let motion =
            LinearizedMotion::new(self.track_width, &self.estimate, travel, sin_cos_within);
        if !is_within(motion.turn.abs(), MAX_TURN) {
            return Err(refused_travel(travel));
        }
        let noise = ProcessNoise::new(&self.densities, &motion, travel);
        let transition = Transition::new(&motion, &noise);
        let walk = self.walk();
        let p = &mut self.p_without_walk;
        let pose = p.pose.propagated(&p.calibration, &walk, &transition);
        if !pose.is_valid() {
            return Err(invalid(&Covariance { pose, ..*p }));
        }
        p.pose = pose;
        p.range_scale.propagate(&transition);
        if let Some(mount) = self.mounted.get_mut() {
            mount.propagate(&motion);
        }
        if let Some(bias) = bias {
            bias.propagate(&motion);
        }
        self.distance_since_update += distance;
        motion.advance(&mut self.estimate);
        Ok(())
    }
}

/// Why a travel is refused before P is propagated.
#[cold]
pub(super) fn refused_travel(travel: WheelTravel) -> EkfError {
    if travel.is_finite() { EkfError::TurnTooLarge } else { EkfError::NotFinite }
}
