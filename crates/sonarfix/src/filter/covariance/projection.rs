//! Projection of P onto a measurement: P Hᵀ and H P Hᵀ (`docs/model.md`, eq. 14).

use super::blocks::Covariance;
use super::column::StateColumn;
use crate::geometry::units::{Metres, SquareMetres};
use crate::sensor::range::{ExpectedRange, Innovation};

/// P Hᵀ: covariance of the expected range with the states that it depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossCovariance {
    /// With x, m².
    pub x: f32,
    /// With y, m².
    pub y: f32,
    /// With the heading, m rad.
    pub h: f32,
    /// With the range scale error, m.
    pub k: f32,
}

/// One number for each coordinate of the mount, ahead and to the left.
pub type MountCovariance = (f32, f32);

/// What the mount adds to a measurement: its derivatives L by the mount, and its covariances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MountShare {
    /// Covariances of the seven states with L e, where e are the errors of the mount.
    pub(super) states: StateColumn,
    /// L.
    pub(super) by: (f32, f32),
    /// Covariance of L e with the measurement, m².
    pub(super) along: f32,
}

impl MountShare {
    /// L times the covariances of another quantity with the errors of the mount.
    pub(super) fn times(&self, covariance: MountCovariance) -> f32 {
        self.by.0 * covariance.0 + self.by.1 * covariance.1
    }
}

/// An expected range seen from the filter: computed once, used by innovation, gate and correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedMeasurement<'e> {
    /// h(X̂) and H.
    pub expected: &'e ExpectedRange,
    /// P Hᵀ.
    pub cross_covariance: CrossCovariance,
    /// H P Hᵀ, m²: variance of the expected range.
    pub variance: f32,
    /// What the mount adds to both, if it is estimated.
    pub(super) mount: Option<MountShare>,
}

impl PredictedMeasurement<'_> {
    /// What the mount has added. Without the feature the compiler knows that it is nothing.
    #[inline]
    pub(super) fn mount(&self) -> Option<&MountShare> {
        if cfg!(feature = "mount") { self.mount.as_ref() } else { None }
    }

    /// Covariance of the measurement with a quantity that has these covariances with the states and with the errors of the mount.
    pub(super) fn covariance_with(&self, states: &StateColumn, mount: MountCovariance) -> f32 {
        let of_states = states.times(&self.expected.jacobian());
        self.mount().map_or(of_states, |share| of_states + share.times(mount))
    }

    // ===== Eq. (14): ν and S =====
    /// The innovation of a measured `range` with noise variance `noise`.
    #[inline]
    #[must_use]
    pub fn innovation(&self, range: Metres, noise: SquareMetres) -> Innovation {
        let value = range - self.expected.range;
        Innovation { value, variance: SquareMetres(noise.0 + self.variance) }
    }
}

impl Covariance {
    // ===== Eq. (14): P Hᵀ and H P Hᵀ =====
    /// Projects P onto a measurement.
    #[inline]
    #[must_use]
    pub fn project<'e>(&self, expected: &'e ExpectedRange) -> PredictedMeasurement<'e> {
        let h = expected.jacobian();
        let (p, k) = (&self.pose, &self.range_scale);
        let cross_covariance = CrossCovariance {
            x: p.xx * h.x + p.xy * h.y + p.xh * h.h + k.xk * h.k,
            y: p.xy * h.x + p.yy * h.y + p.yh * h.h + k.yk * h.k,
            h: p.xh * h.x + p.yh * h.y + p.hh * h.h + k.hk * h.k,
            k: k.xk * h.x + k.yk * h.y + k.hk * h.h + k.kk * h.k,
        };
        let m = &cross_covariance;
        let variance = h.x * m.x + h.y * m.y + h.h * m.h + h.k * m.k;
        PredictedMeasurement { expected, cross_covariance, variance, mount: None }
    }

    /// P Hᵀ for the mean and the difference of the scale errors.
    #[must_use]
    pub fn cross_covariance_of_wheels(&self, of: &PredictedMeasurement) -> (f32, f32) {
        let h = of.expected.jacobian();
        let (p, k) = (&self.pose, &self.range_scale);
        let c = p.xc * h.x + p.yc * h.y + p.hc * h.h + k.ck * h.k;
        let d = p.xd * h.x + p.yd * h.y + p.hd * h.h + k.dk * h.k;
        match of.mount() {
            Some(mount) => (c + mount.states.c, d + mount.states.d),
            None => (c, d),
        }
    }
}
