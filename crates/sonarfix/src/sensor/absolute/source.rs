//! Whether an absolute measurement is an outlier (`docs/model.md`, eq. 41), with what its source has returned before.

use crate::geometry::elementary::{exp, ln, sqrt};
use crate::geometry::numeric::{at_least, at_most};
use crate::geometry::units::{Instant, seconds};

/// Prior probability that a measurement is an outlier.
const OUTLIERS: f32 = 0.05;
/// Limits of the probability after a measurement, as of an occlusion: the share of its value before, and its largest value.
const PERSISTENCE: f32 = 0.8;
const MOST: f32 = 0.95;
/// Time in seconds that halves its deviation from the prior.
const HALVED_AFTER: f32 = 5.0;
/// Area in which an outlying position lies, m²: a large room.
const AREA: f32 = 100.0;
/// Share of the evidence that stays possible at a right pose, as of a range: three pings of ten agree by chance.
const BY_CHANCE: f32 = 0.3;
/// Largest exponent: beyond it an outlier is certain.
const MAX_EXPONENT: f32 = 80.0;

/// How a measurement agrees with the estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// νᵀ S⁻¹ ν.
    pub nis: f32,
    /// The determinant of S, in the units of what was measured.
    pub determinant: f32,
    pub has_position: bool,
    pub has_heading: bool,
}

/// Probabilities of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probabilities {
    /// β, the probability that it is no outlier.
    pub association: f32,
    /// Evidence against the pose, eq. (23).
    pub evidence: f32,
}

impl Fit {
    /// Density of an outlier over that of a measurement at the estimate, at most 1: it is at least as uncertain as the
    /// estimate.
    fn outlier_density(&self) -> f32 {
        let turn = core::f32::consts::TAU;
        let position = if self.has_position { turn / AREA } else { 1.0 };
        // √(2π) of the density of a normal variable, over the 2π of all headings.
        let heading = if self.has_heading { 1.0 / sqrt(turn) } else { 1.0 };
        at_most(position * heading * sqrt(self.determinant), 1.0)
    }

    // ===== Eqs. (41) and (23): outlier or not =====
    /// The probabilities, if an outlier has this prior probability.
    pub fn explain(&self, outliers: f32) -> Probabilities {
        let ratio = self.outlier_density() * exp(at_most(0.5 * self.nis, MAX_EXPONENT));
        let (right, wrong) = (1.0 - outliers, outliers * ratio);
        let likelihood = (right + wrong) / ratio;
        let evidence = ln(BY_CHANCE + (1.0 - BY_CHANCE) / likelihood);
        Probabilities { association: right / (right + wrong), evidence }
    }
}

/// A source of absolute measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// Probability of an outlier after the latest measurement, less the prior, and the time of it.
    above_prior: f32,
    at: Instant,
}

/// The sources that are distinguished: of headings alone, and of positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sources {
    pub heading: Source,
    pub position: Source,
}

impl Sources {
    /// Sources of which nothing is known.
    pub fn new(now: Instant) -> Self {
        let unknown = Source { above_prior: 0.0, at: now };
        Self { heading: unknown, position: unknown }
    }

    /// The source of a measurement.
    pub fn of(&mut self, has_position: bool) -> &mut Source {
        if has_position { &mut self.position } else { &mut self.heading }
    }
}

impl Source {
    /// Probability that a measurement is an outlier.
    pub fn outliers(&self, now: Instant) -> f32 {
        let age = now.checked_duration_since(self.at).map_or(0.0, seconds);
        OUTLIERS + self.above_prior / (1.0 + age / HALVED_AFTER)
    }

    /// Records a measurement that was an outlier with this probability; `before`: the probability before it.
    pub fn record(&mut self, outlier: f32, before: f32, now: Instant) {
        let outlier = at_most(at_least(outlier, PERSISTENCE * before), MOST);
        *self = Self { above_prior: at_least(outlier - OUTLIERS, 0.0), at: now };
    }
}

#[cfg(test)]
mod tests;
