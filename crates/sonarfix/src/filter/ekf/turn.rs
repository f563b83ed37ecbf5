//! Prediction with the turn that a gyro has measured beside the wheels (`docs/model.md`, "Gyro").

use super::prediction::{MAX_TURN, refused_travel};
use super::{Ekf, EkfError, invalid};
use crate::filter::covariance::{GyroBias, Transition, TurnDifference};
use crate::filter::motion::{LinearizedMotion, WheelTravel};
use crate::filter::process_noise::ProcessNoise;
use crate::geometry::numeric::is_within;
use crate::geometry::trig::sin_cos_within;
use crate::geometry::units::Radians;

/// A turn as the gyro has measured it: its rate integrated, bias included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GyroTurn {
    /// Radians.
    pub angle: f32,
    /// Time that the integral covers, seconds.
    pub seconds: f32,
    /// Variance of its white noise, rad².
    pub noise: f32,
}

/// Limits of a difference of turns that is not a slip: so many of its standard deviations, and an angle in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SlipLimits {
    pub deviations: f32,
    pub angle: f32,
}

/// What a prediction with a gyro has found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum TurnAgreement {
    /// Both agree.
    Agree(TurnDifference),
    /// They differ by this angle, rad, which both together do not explain. The turn is the gyro's.
    Differ(f32),
}

impl Ekf {
    // ===== Eqs. (36) and (39): the turn of a step by wheels and gyro =====
    /// As [`Self::predict`], with the turn by the gyro combined with that by the wheels.
    ///
    /// # Errors
    /// As of [`Self::predict`]. Filter and bias are unchanged.
    pub(crate) fn predict_with_turn(
        &mut self,
        travel: WheelTravel,
        measured: &GyroTurn,
        limits: SlipLimits,
        bias: &mut GyroBias,
    ) -> Result<TurnAgreement, EkfError> {
        // Sine and cosine are those of the combined turn, below: `dx` is the advance until then.
        let mut motion =
            LinearizedMotion::new(self.track_width, &self.estimate, travel, |_| (0.0, 1.0));
        let mut noise = ProcessNoise::new(&self.densities, &motion, travel);
        let mut difference = TurnDifference {
            value: 0.0,
            by_c: motion.turn_by_c,
            by_d: motion.turn_by_d,
            by_w: motion.turn_by_w,
            by_b: measured.seconds,
            noise: noise.turn + measured.noise,
        };
        let differs = measured.angle - measured.seconds * bias.rate - motion.turn;
        difference.value = differs + difference.expected(&self.estimate, bias);
        let explained = difference.noise + self.p_without_walk.variance_of(&difference, bias);
        let square = limits.deviations * limits.deviations * explained;
        // False for NaN, which is refused below.
        let is_slip = differs * differs > square && differs.abs() > limits.angle;
        // Share of the gyro.
        let share = if is_slip { 1.0 } else { noise.turn / difference.noise };
        let rest = 1.0 - share;
        if is_slip {
            // One wheel has slipped by W times the difference, which one is unknown.
            let slipped = 0.5 * differs / motion.per_width;
            noise.advance += slipped * slipped;
            noise.turn = measured.noise;
        } else {
            noise.turn *= rest;
        }
        noise.advance_turn *= rest;
        motion.turn += share * differs;
        motion.turn_by_c *= rest;
        motion.turn_by_d *= rest;
        motion.turn_by_w *= rest;
        if !is_within(motion.turn.abs(), MAX_TURN) {
            return Err(refused_travel(travel));
        }
        let advance = motion.dx;
        let (sin, cos) = sin_cos_within(self.estimate.heading + 0.5 * motion.turn);
        (motion.sin, motion.cos) = (sin, cos);
        (motion.dx, motion.dy) = (advance * cos, advance * sin);
        let by_bias = -0.5 * share * measured.seconds;
        self.roll(travel, &motion, &noise, by_bias, bias)?;
        Ok(if is_slip { TurnAgreement::Differ(differs) } else { TurnAgreement::Agree(difference) })
    }

    /// As [`Self::predict`], with the covariances of the bias.
    ///
    /// # Errors
    /// As of [`Self::predict`]. Filter and bias are unchanged.
    pub(crate) fn predict_with_bias(
        &mut self,
        travel: WheelTravel,
        bias: &mut GyroBias,
    ) -> Result<(), EkfError> {
        self.predict_by_wheels(travel, Some(bias))
    }

    // ===== Eq. (37): half of the turn by the bias, the motion, the other half =====
    fn roll(
        &mut self,
        travel: WheelTravel,
        motion: &LinearizedMotion,
        noise: &ProcessNoise,
        by_bias: f32,
        bias: &mut GyroBias,
    ) -> Result<(), EkfError> {
        let walk = self.walk();
        let p = &mut self.p_without_walk;
        let (before, column) = (*p, *bias);
        bias.turn(p, by_bias);
        p.propagate(&walk, &Transition::new(motion, noise));
        bias.propagate(motion);
        bias.turn(p, by_bias);
        if !p.pose.is_valid() {
            let error = invalid(p);
            (*p, *bias) = (before, column);
            return Err(error);
        }
        if let Some(mount) = self.mounted.get_mut() {
            mount.turn(bias, by_bias);
            mount.propagate(motion);
            mount.turn(bias, by_bias);
        }
        self.distance_since_update += travel.right.abs().0 + travel.left.abs().0;
        motion.advance(&mut self.estimate);
        Ok(())
    }

    /// Corrects the state by a difference of turns, if it agrees with the estimate within a number of standard
    /// deviations. Returns whether it does.
    pub(crate) fn correct_by_turns(
        &mut self,
        difference: &TurnDifference,
        deviations: f32,
        bias: &mut GyroBias,
    ) -> bool {
        let mut p = self.p_without_walk;
        p.add_random_walk(&self.walk());
        let innovation = difference.value - difference.expected(&self.estimate, bias);
        let variance = difference.noise + p.variance_of(difference, bias);
        // False for NaN.
        let agrees = innovation * innovation <= deviations * deviations * variance;
        let own = self.mounted.get().map(|mount| mount.covariance_with_turns(difference, bias));
        let of_mount = own.unwrap_or_default();
        if agrees && let Some(gain) = p.correct_by_turns(bias, difference, of_mount, innovation) {
            gain.correct(&mut self.estimate, innovation);
            if let Some(mount) = self.mounted.get_mut() {
                mount.correct(of_mount, &gain, innovation, 1.0);
            }
            self.p_without_walk = p;
            self.distance_since_update = 0.0;
        }
        agrees
    }

    /// Adds an independent error with this standard deviation to the heading, as far as a variance permits.
    pub(crate) fn inflate_heading(&mut self, heading: Radians) {
        self.set_pose_variances(self.pose_variances().plus(0.0, heading.0));
    }
}

#[cfg(test)]
mod tests;
