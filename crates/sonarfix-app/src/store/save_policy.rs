//! When a robot writes down what it knows.
//!
//! - **When its owner starts or stops it**, so that a record says truly whether the robot was
//!   parked: a pose is only worth keeping if nothing could drive away from it.
//! - **While it pauses** (wheels unmoved for 2 s, so that nothing is lost while the flash is
//!   busy) and tracks, if a deviation of its calibration has fallen by a fifth since the last
//!   record, and that is a minute ago.
//!
//! A minute apart around the clock is 1,440 records a day; `docs/firmware.md` says how many years
//! of it the flash stands.

use sonarfix::ekf::StandardDeviations;
use sonarfix::health::Verdict;
use sonarfix::localizer::Localizer;
use sonarfix::units::{Duration, Instant};

use crate::time::since;

/// How long the wheels must have stood.
const PAUSE: Duration = Duration::from_ticks(2_000_000);
/// The least time between two records.
const APART: Duration = Duration::from_ticks(60_000_000);
/// What a deviation must have fallen to, of what is written.
const BETTER: f32 = 0.8;

/// Watches a localizer for what is worth writing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SavePolicy {
    /// The calibration's deviations as written last.
    written: StandardDeviations,
    at: Instant,
    /// Since when the wheels stand.
    still_since: Instant,
}

impl SavePolicy {
    /// A robot whose record holds these deviations, or its prior if it has none.
    #[must_use]
    pub fn new(now: Instant, written: StandardDeviations) -> Self {
        Self { written, at: now, still_since: now }
    }

    /// Takes note that a wheel rolled.
    pub fn rolled(&mut self, now: Instant) {
        self.still_since = now;
    }

    /// Whether the localizer knows something that should be written now.
    #[must_use]
    pub fn is_due(&self, now: Instant, localizer: &Localizer) -> bool {
        localizer.health().verdict == Verdict::Tracking
            && since(now, self.still_since) >= PAUSE
            && since(now, self.at) >= APART
            && is_better(&localizer.filter().deviation(), &self.written)
    }

    /// Takes note that these deviations have been written, or that it was tried.
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
