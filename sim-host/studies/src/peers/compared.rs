//! The errors of both filters.

use serde::Serialize;

/// How well a filter knew the pose. Sums over runs; seconds, and metres squared times seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Errors {
    /// Time with a reference.
    pub seconds: f64,
    /// Part of it within half a metre.
    pub within: f64,
    /// Part of it beyond half a metre, although the filter says that its pose is right.
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

/// Both filters in one or several runs.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Compared {
    /// The localizer of this project.
    pub localizer: Errors,
    /// The particle filter.
    pub particles: Errors,
    /// Pings.
    pub pings: u64,
    /// Sum over the pings of the particles.
    pub weighed: u64,
}

impl Compared {
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            localizer: self.localizer.plus(other.localizer),
            particles: self.particles.plus(other.particles),
            pings: self.pings + other.pings,
            weighed: self.weighed + other.weighed,
        }
    }
}
