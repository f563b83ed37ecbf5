//! The parameters of the echo model: what a ping returns besides the range of its wall (`docs/model.md`, "Echo model").
//! The model itself is [`association::echo`](crate::association::echo).
//!
//! # Non-finite policy
//! The parameters are checked by [`Config::check`](crate::config::Config::check).

use crate::geometry::elementary::{ln, sqrt};
use crate::geometry::numeric::{at_least, at_most};
use crate::geometry::units::{Metres, Radians};

/// Parameters of clutter: of the sensor, of the unmapped objects around it, and of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct EchoParameters {
    /// Probability that a wall within range, square to the beam, returns no echo.
    pub missed: f32,
    /// Probability of a spurious range that is shorter than the wall's.
    pub short: f32,
    /// Probability of a spurious range that is longer: a reflection by two walls, or cross-talk.
    pub long: f32,
    /// Range at which every second beam meets an object that is not in the map. Zero: there are no
    /// such objects.
    pub free_path: Metres,
    /// Standard deviation of the place of a wall in the map, of walls without an
    /// [accuracy](crate::map::Wall::accuracy) of their own. It is common to all ranges to one wall from
    /// one place, so that repeated pings do not average it away.
    pub map_accuracy: Metres,
    /// Mean by which an echo from the normal is reported too far, by missed cycles and the threshold of the detector.
    pub late: Metres,
    /// By how much more per radian between the axis and the normal.
    pub late_per_radian: Metres,
    /// Angle between the axis of a sonar and the normal of a wall at which it answers half as often as on the normal. Zero: not
    /// known, and the [cone](crate::sensor::ranger::RangerParameters::cone) is taken for it.
    pub half_angle: Radians,
    /// Standard deviation of that angle from ping to ping: the width of a soft rim.
    pub rim: Radians,
    /// Range up to which hardly any echo is missed or spurious: `missed`, `short` and `long` are those of longer ranges. Zero:
    /// they are the same at every range.
    pub sure_within: Metres,
}

impl EchoParameters {
    /// No clutter and an exact map: every echo is the wall's.
    pub const NONE: Self = Self {
        missed: 0.0,
        short: 0.0,
        long: 0.0,
        free_path: Metres(0.0),
        map_accuracy: Metres(0.0),
        late: Metres(0.0),
        late_per_radian: Metres(0.0),
        half_angle: Radians(0.0),
        rim: Radians(0.0),
        sure_within: Metres(0.0),
    };

    /// An HC-SR04 in a furnished room: assumed, no recordings. It misses a cycle, half a wavelength of 4.3 mm, of one echo in
    /// 20, and reports 5 mm more at 20° off the normal (`docs/hardware.md`).
    pub const HC_SR04: Self = Self {
        missed: 0.03,
        short: 0.02,
        long: 0.02,
        free_path: Metres(10.0),
        map_accuracy: Metres(0.0),
        late: Metres(0.000_23),
        late_per_radian: Metres(0.014_3),
        half_angle: Radians(0.0),
        rim: Radians(0.0),
        sure_within: Metres(0.0),
    };

    /// VL53L1X in a furnished room, whose walls are plaster, wood and some glass: assumed, no recordings. A narrow beam meets
    /// fewer objects than a cone.
    pub const VL53L1X: Self =
        Self { missed: 0.04, short: 0.01, long: 0.01, free_path: Metres(15.0), ..Self::NONE };

    /// Probability that a wall at this range, square to the beam and not occluded, returns its range.
    #[must_use]
    #[inline]
    pub fn heard(&self, range: Metres) -> f32 {
        let share = self.share_at(range);
        1.0 - share * self.missed - share * self.short - share * self.long
    }

    /// Factor on [`missed`](Self::missed), [`short`](Self::short) and [`long`](Self::long) at this range.
    #[must_use]
    #[inline]
    pub fn share_at(&self, range: Metres) -> f32 {
        if range < self.sure_within { SHARE_WHERE_SURE } else { 1.0 }
    }

    // ===== Eq. (49) =====
    /// Mean by which an echo is reported too far at the angle `off` between the axis and the normal, of which `variance` is the
    /// variance, rad².
    ///
    /// The mean magnitude of a normal variable with the mean μ and the variance σ² is √(2/π) σ at μ = 0, and |μ| where that is
    /// far from zero. √(μ² + 2σ²/π) is both, and between them up to 10 % more.
    #[must_use]
    #[inline]
    pub fn lateness(&self, off: Radians, variance: f32) -> Metres {
        let angle = sqrt(off.0 * off.0 + core::f32::consts::FRAC_2_PI * variance);
        self.late + self.late_per_radian * angle
    }

    /// Prior probability that an unmapped object stands before a wall at this range.
    #[must_use]
    #[inline]
    pub fn prior_occlusion(&self, range: Metres) -> f32 {
        self.occlusion_within(range, self.free_path.0)
    }

    /// The same for another free path of the beams, metres, which is not zero. Zero in the parameters: there are no such objects.
    #[must_use]
    #[inline]
    pub(crate) fn occlusion_within(&self, range: Metres, free_path: f32) -> f32 {
        if self.free_path > Metres(0.0) { range.0 / (range.0 + free_path) } else { 0.0 }
    }

    /// Variance of the place of a wall with this accuracy of its own.
    #[must_use]
    #[inline]
    pub fn map_variance(&self, accuracy: Option<Metres>) -> f32 {
        let accuracy = accuracy.unwrap_or(self.map_accuracy).0;
        accuracy * accuracy
    }
}

/// Factor on the variance of the place of a wall in the correction by a range, if the last range to the same wall was used `travelled` metres ago.
///
/// The error is a first-order Gauss–Markov process of the distance. A sequence of n ranges with
/// correlation ρ = exp(−s/L) holds as much information as n independent ones whose variance is
/// larger by (1 + ρ)/(1 − ρ) = coth(s/2L); √(1 + (2L/s)²) is within 10 % of it.
#[inline]
pub(crate) fn repetition(travelled: Metres) -> f32 {
    let least = 2.0 * MAP_CORRELATION.0 / MAX_REPETITION;
    let distance = if travelled.0 > least { travelled.0 } else { least };
    let ratio = 2.0 * MAP_CORRELATION.0 / distance;
    sqrt(1.0 + ratio * ratio)
}

/// Logarithms of probabilities and of densities over that of an echo anywhere, for a score of many
/// pings. Occlusion is that of half of the longest range, missed and spurious echoes are means over the ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogShares {
    /// A reflector answers.
    pub answers: f32,
    /// It does not answer.
    pub misses: f32,
    /// Clutter before a reflector.
    pub before: f32,
    /// Clutter behind it.
    pub behind: f32,
    /// No echo where a reflector answers.
    pub silence: f32,
}

impl EchoParameters {
    /// The shares of one reflector; `anywhere` is the density of an echo anywhere, per metre.
    #[must_use]
    pub fn log_shares(&self, longest: Metres, anywhere: f32) -> LogShares {
        let range = 0.5 * longest.0;
        let occluded = self.prior_occlusion(Metres(range));
        let per_metre = 1.0 / (range * anywhere);
        let sure = at_most(self.sure_within.0 / longest.0, 1.0);
        let share = 1.0 - sure * (1.0 - SHARE_WHERE_SURE);
        let [missed, short, long] = [self.missed, self.short, self.long].map(|it| share * it);
        let before = short + occluded * (1.0 - NO_ECHO_OCCLUDED - BEYOND_OCCLUDED);
        let behind = long + occluded * BEYOND_OCCLUDED;
        let silence = missed + occluded * NO_ECHO_OCCLUDED;
        let log = |share: f32| ln(at_least(share, LEAST_SHARE));
        LogShares {
            answers: log(1.0 - missed - short - long),
            misses: log(missed + short + long),
            before: log(before * per_metre),
            behind: log(behind * per_metre),
            silence: log(silence / NO_ECHO_WRONG_POSE),
        }
    }
}

/// Share of the missed and spurious echoes that remains at a range at which hardly any is: that of an NXT
/// (`docs/sonar-model.md`).
const SHARE_WHERE_SURE: f32 = 0.04;

/// Least share of which a logarithm is taken: one ping does not decide.
const LEAST_SHARE: f32 = 0.01;

impl Default for EchoParameters {
    fn default() -> Self {
        Self::HC_SR04
    }
}

/// Distance over which the error of a wall in the map is correlated. A wall fitted to a SLAM map
/// deviates from a straight line over the width of doors and pillars.
const MAP_CORRELATION: Metres = Metres(1.0);
/// Limit of the factor on the variance of the map error.
const MAX_REPETITION: f32 = 50.0;

/// Share of pings without an echo if an unmapped object occludes the wall: it may absorb or deflect.
pub(crate) const NO_ECHO_OCCLUDED: f32 = 0.2;
/// Share of echoes from beyond the wall if it is occluded: reflections by other walls.
pub(crate) const BEYOND_OCCLUDED: f32 = 0.065;
/// Share of pings without an echo at a wrong pose.
pub(crate) const NO_ECHO_WRONG_POSE: f32 = 0.3;

#[cfg(test)]
mod tests {
    use super::*;

    /// Eq. (49) against the mean of late + slope |angle| over the normal distribution of the angle, integrated in `f64`.
    #[test]
    fn the_lateness_is_the_mean_over_the_angle() {
        let echo = EchoParameters::HC_SR04;
        let (late, slope) = (f64::from(echo.late.0), f64::from(echo.late_per_radian.0));
        for (off, sigma) in [
            (0.0_f32, 0.02_f32),
            (0.02, 0.02),
            (-0.02, 0.02),
            (0.01, 0.03),
            (0.3, 0.02),
            (-0.3, 0.0),
        ] {
            let density = |z: f64| (-0.5 * z * z).exp();
            let (mut sum, mut weight) = (0.0, 0.0);
            for step in -800..=800 {
                let z = f64::from(step) / 100.0;
                sum += density(z) * (f64::from(off) + f64::from(sigma) * z).abs();
                weight += density(z);
            }
            let mean = late + slope * sum / weight;
            let is = f64::from(echo.lateness(Radians(off), sigma * sigma).0);
            assert!(is > 0.999 * mean && is < 1.1 * mean, "{off} {sigma}: {is} {mean}");
        }
        assert_eq!(EchoParameters::NONE.lateness(Radians(0.3), 0.01), Metres(0.0));
    }
}
