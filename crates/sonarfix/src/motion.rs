//! The motion model: how two wheel travels move the pose, and how that movement depends on what
//! is uncertain (`docs/model.md`, eqs. 3 and 7–9).
//!
//! The paper's eq. (3) moves along the heading at the start of the step. This moves along the
//! heading half-way through the turn, which is the same on a straight line and in a turn on the
//! spot, and on a curve takes the error of a step from Δs Δψ/2, sideways, to Δs Δψ²/24, ahead.
//!
//! # Non-finite policy
//! Nothing here refuses a value; [`Ekf::predict`](crate::ekf::Ekf::predict) checks the travel
//! before and the state after.

use crate::state::{Mean, wheels};
use crate::trig::sin_cos;
use crate::units::{Metres, PerRootMetre, Radians};

/// How far each wheel rolled since the last step, by its encoder and nominal diameter. Negative
/// is backwards.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WheelTravel {
    /// ΔR of the paper.
    pub right: Metres,
    /// ΔL of the paper.
    pub left: Metres,
}

impl WheelTravel {
    /// A travel from metres.
    #[must_use]
    pub const fn new(right: f32, left: f32) -> Self {
        Self { right: Metres(right), left: Metres(left) }
    }

    /// Mean distance the wheels rolled, forwards or backwards: what process noise grows with.
    #[must_use]
    pub fn distance(self) -> Metres {
        Metres(0.5 * (self.right.0.abs() + self.left.0.abs()))
    }

    /// Whether both travels are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.right.is_finite() && self.left.is_finite()
    }
}

/// The drive, as its builder measured it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Drive {
    /// Nominal distance between the wheels' contact points (D).
    pub track_width: Metres,
    /// White noise of each wheel's travel, independent from wheel to wheel.
    pub wheel_noise: PerRootMetre<Metres>,
    /// How far the two scale errors wander.
    pub scale_walk: PerRootMetre<f32>,
    /// How far the track width wanders.
    pub track_width_walk: PerRootMetre<Metres>,
}

/// One step of the motion model, linearised at the state before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    /// Sine and cosine of the mid-heading ψ + Δψ/2.
    pub sin: f32,
    pub cos: f32,
    /// Way of the midpoint between the wheels, Δs, metres.
    pub advance: f32,
    /// Turn, Δψ, radians.
    pub turn: f32,
    /// Derivatives of Δs by the common part and the difference of the scale errors; Δs does not
    /// depend on the track width.
    pub advance_c: f32,
    pub advance_d: f32,
    /// Derivatives of Δψ by the common part, the difference, and the track-width error.
    pub turn_c: f32,
    pub turn_d: f32,
    pub turn_w: f32,
    /// Noise of the pair (Δs, Δψ): variances and covariance.
    pub advance_variance: f32,
    pub turn_variance: f32,
    pub advance_turn: f32,
}

impl Step {
    pub fn new(drive: &Drive, at: &Mean, travel: WheelTravel) -> Self {
        let (right, left) = (travel.right.0, travel.left.0);
        let (factor_r, factor_l) = wheels(1.0 + at.scale_common, at.scale_difference);
        let (rolled_r, rolled_l) = (right * factor_r, left * factor_l);
        let per_width = 1.0 / (drive.track_width.0 + at.track_width_error);
        let turn = (rolled_r - rolled_l) * per_width;
        let (sin, cos) = sin_cos(Radians(at.heading + 0.5 * turn));

        let per_metre = drive.wheel_noise.0.0 * drive.wheel_noise.0.0;
        let noise_r = per_metre * right.abs() * factor_r * factor_r;
        let noise_l = per_metre * left.abs() * factor_l * factor_l;
        Self {
            sin,
            cos,
            advance: 0.5 * (rolled_r + rolled_l),
            turn,
            advance_c: 0.5 * (right + left),
            advance_d: 0.25 * (right - left),
            turn_c: (right - left) * per_width,
            turn_d: 0.5 * (right + left) * per_width,
            turn_w: -turn * per_width,
            advance_variance: 0.25 * (noise_r + noise_l),
            turn_variance: (noise_r + noise_l) * per_width * per_width,
            advance_turn: 0.5 * (noise_r - noise_l) * per_width,
        }
    }
}
