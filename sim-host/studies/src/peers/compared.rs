//! The errors of both filters.

use serde::Serialize;

/// Position errors of a filter. Sums over runs; seconds, and metres squared times seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Errors {
    /// Time with a reference.
    pub seconds: f64,
    /// Part of it within half a metre.
    pub within: f64,
    /// Part of it beyond half a metre, although the filter reports a right pose.
    pub wrong_and_sure: f64,
    /// Sum of the squared position errors.
    pub squares: f64,
}

impl Errors {
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            seconds: self.seconds + other.seconds,
            within: self.within + other.within,
            wrong_and_sure: self.wrong_and_sure + other.wrong_and_sure,
            squares: self.squares + other.squares,
        }
    }

    /// RMS position error, metres.
    #[must_use]
    pub fn rms(&self) -> f64 {
        (self.squares / self.seconds).sqrt()
    }
}

/// The errors of both filters in one or several runs.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Compared {
    /// Those of the localizer.
    pub localizer: Errors,
    /// Those of the particle filter.
    pub particles: Errors,
    /// Pings.
    pub pings: u64,
    /// Updates of a particle by a ping: the sum of the particles over the pings.
    pub particle_updates: u64,
}

impl Compared {
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            localizer: self.localizer.plus(other.localizer),
            particles: self.particles.plus(other.particles),
            pings: self.pings + other.pings,
            particle_updates: self.particle_updates + other.particle_updates,
        }
    }
}
