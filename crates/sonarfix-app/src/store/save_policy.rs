//! When pose and calibration are written to flash.
//!
//! - **At `Start` and `Stop`**, so that a record is *parked* only if the robot could not drive: only then is its
//!   pose valid later.
//! - **While the robot pauses** (wheels unmoved for 2 s, so that nothing is lost while the flash is
//!   busy) and tracks, if a deviation of its calibration has fallen by a fifth since the last
//!   record, and that record is at least a minute old.
//!
//! One record a minute is 1,440 records a day; `docs/firmware.md` states the life of the flash at
//! this rate.

use sonarfix::filter::ekf::StandardDeviations;
use sonarfix::geometry::units::{Duration, Instant};
use sonarfix::health::Verdict;
use sonarfix::localizer::Localizer;

use crate::time::since;

/// The time for which the wheels must have been at rest.
const PAUSE: Duration = Duration::from_ticks(2_000_000);
/// The least time between two records.
const APART: Duration = Duration::from_ticks(60_000_000);
/// The ratio to the written deviation below which a deviation is written again.
const BETTER: f32 = 0.8;

/// Decides when the state of a localizer is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SavePolicy {
    /// The calibration's deviations as written last.
    written: StandardDeviations,
    at: Instant,
    /// The time since which the wheels have been at rest.
    still_since: Instant,
}

impl SavePolicy {
    /// A robot whose record holds these deviations, or its prior if it has none.
    #[must_use]
    pub fn new(now: Instant, written: StandardDeviations) -> Self {
        Self { written, at: now, still_since: now }
    }

    /// Continues after the clock was set to `now`.
    pub fn set_clock(&mut self, now: Instant) {
        (self.at, self.still_since) = (now, now);
    }

    /// Records that a wheel rolled.
    pub fn rolled(&mut self, now: Instant) {
        self.still_since = now;
    }

    /// Whether the state of the localizer should be written now.
    #[must_use]
    pub fn is_due(&self, now: Instant, localizer: &Localizer) -> bool {
        localizer.health().verdict == Verdict::Tracking
            && since(now, self.still_since) >= PAUSE
            && since(now, self.at) >= APART
            && is_better(&localizer.filter().standard_deviations(), &self.written)
    }

    /// Records that these deviations have been written, or that the write has failed.
    pub fn wrote(&mut self, now: Instant, written: StandardDeviations) {
        self.at = now;
        self.written = written;
    }
}

fn is_better(deviation: &StandardDeviations, written: &StandardDeviations) -> bool {
    let fell = |is: f32, was: f32| is < BETTER * was;
    fell(deviation.scale_right, written.scale_right)
        || fell(deviation.scale_left, written.scale_left)
        || fell(deviation.track_width_error.0, written.track_width_error.0)
        || fell(deviation.range_scale, written.range_scale)
}
