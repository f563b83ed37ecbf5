//! The motion model: how two wheel travels move the pose, and how that movement depends on what
//! is uncertain (`docs/model.md`, eqs. 3 and 7–9).
//!
//! The paper's eq. (3) moves along the heading at the start of the step. This moves along the
//! heading half-way through the turn, which is the same on a straight line and in a turn on the
//! spot, and on a curve takes the error of a step from Δs Δψ/2, sideways, to Δs Δψ²/24, ahead.
//!
//! # Non-finite policy
//! Nothing here refuses a value; [`Ekf::predict`](crate::ekf::Ekf::predict) checks the turn and the
//! covariance that come of it.

use crate::covariance::{Calibration, PoseRows, is_sound};
use crate::state::{Mean, wheels};
use crate::units::{Metres, PerRootMetre};

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

/// The drive as the filter computes with it: what [`Drive`] says, its noises as variances that grow
/// with the ways of both wheels together, |ΔR| + |ΔL|.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    track_width: f32,
    /// Of the advance: `σ_w²`/4, m²/m.
    advance: f32,
    /// Of the common part and of the difference of the scale errors: `σ_S²`/4 and `σ_S²`, 1/m. Of two
    /// independent walks the mean has half the variance, the difference twice.
    scale_common: f32,
    scale_difference: f32,
    /// Of the track-width error: `σ_D²`/2, m²/m.
    track_width_error: f32,
}

impl Rates {
    /// The rates of a drive.
    #[must_use]
    pub fn new(drive: &Drive) -> Self {
        let square = |sigma: f32| sigma * sigma;
        let scale = square(drive.scale_walk.0);
        Self {
            track_width: drive.track_width.0,
            advance: 0.25 * square(drive.wheel_noise.0.0),
            scale_common: 0.25 * scale,
            scale_difference: scale,
            track_width_error: 0.5 * square(drive.track_width_walk.0.0),
        }
    }

    /// Whether what a metre adds is a variance to compute with.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let noises =
            [self.advance, self.scale_common, self.scale_difference, self.track_width_error];
        noises.into_iter().all(is_sound)
    }
}

/// One step of the motion model, linearised at the state before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Sine and cosine of the mid-heading ψ + Δψ/2.
    pub(crate) sin: f32,
    pub(crate) cos: f32,
    /// Way of the midpoint between the wheels, Δs, metres.
    pub(crate) advance: f32,
    /// Turn, Δψ, radians.
    pub(crate) turn: f32,
    /// Derivatives of Δs by the common part and the difference of the scale errors; Δs does not
    /// depend on the track width.
    pub(crate) advance_c: f32,
    pub(crate) advance_d: f32,
    /// Derivatives of Δψ by the common part, the difference, and the track-width error.
    pub(crate) turn_c: f32,
    pub(crate) turn_d: f32,
    pub(crate) turn_w: f32,
}

/// What one step adds: Q, but for F.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of the pair (Δs, Δψ): variances and covariance.
    pub(crate) advance: f32,
    pub(crate) turn: f32,
    pub(crate) advance_turn: f32,
    /// Of x, y and heading: what makes up for rounding.
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) heading: f32,
    /// What the calibration has walked up to this step.
    pub(crate) walked: Walk,
}

/// The variances that the calibration has gained by walking since the last range: of the common
/// part and the difference of the scale errors, and of the track width.
///
/// They are added to P's when a range comes, not with every step: what a scale error walks in one
/// step is less than the rounding of its own variance, and would be lost or doubled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walk {
    scale_common: f32,
    scale_difference: f32,
    track_width_error: f32,
}

impl Walk {
    /// The walk over a way of both wheels together, metres.
    #[inline]
    #[must_use]
    pub fn new(rates: &Rates, way: f32) -> Self {
        Self {
            scale_common: way * rates.scale_common,
            scale_difference: way * rates.scale_difference,
            track_width_error: way * rates.track_width_error,
        }
    }

    /// The variances cc, dd and ww with it.
    #[inline]
    pub(crate) fn added_to(&self, q: &Calibration) -> (f32, f32, f32) {
        (q.cc + self.scale_common, q.dd + self.scale_difference, q.ww + self.track_width_error)
    }
}

impl Step {
    /// The step that these travels make from `at`. `sin_cos` is told the mid-heading.
    #[inline]
    pub fn new(
        rates: &Rates,
        at: &Mean,
        travel: WheelTravel,
        sin_cos: impl FnOnce(f32) -> (f32, f32),
    ) -> Self {
        let (right, left) = (travel.right.0, travel.left.0);
        let (factor_r, factor_l) = wheels(1.0 + at.scale_common, at.scale_difference);
        let (rolled_r, rolled_l) = (right * factor_r, left * factor_l);
        let per_width = 1.0 / (rates.track_width + at.track_width_error);
        let turn = (rolled_r - rolled_l) * per_width;
        let (sin, cos) = sin_cos(at.heading + 0.5 * turn);
        let (mean, difference) = (0.5 * (right + left), right - left);
        Self {
            sin,
            cos,
            advance: 0.5 * (rolled_r + rolled_l),
            turn,
            advance_c: mean,
            advance_d: 0.25 * difference,
            turn_c: difference * per_width,
            turn_d: mean * per_width,
            turn_w: -turn * per_width,
        }
    }
}

impl Noise {
    /// The noise of that step (`docs/model.md`, eq. 9), `way` after the last range.
    #[inline]
    #[must_use]
    pub fn new(rates: &Rates, at: &Mean, travel: WheelTravel, way: f32, p: &PoseRows) -> Self {
        let (right, left) = (travel.right.0, travel.left.0);
        let (factor_r, factor_l) = wheels(1.0 + at.scale_common, at.scale_difference);
        let per_width = 1.0 / (rates.track_width + at.track_width_error);
        // |Δ| (1 + S)² of each wheel.
        let of_r = (right * factor_r * factor_r).abs();
        let of_l = (left * factor_l * factor_l).abs();
        let advance = rates.advance * (of_r + of_l);
        let per_half_width = per_width + per_width;
        let turn = advance * per_half_width * per_half_width;
        let [x, y, heading] = p.rounding(advance, turn);
        Self {
            advance,
            turn,
            x,
            y,
            heading,
            advance_turn: rates.advance * (of_r - of_l) * per_half_width,
            walked: Walk::new(rates, way),
        }
    }
}
