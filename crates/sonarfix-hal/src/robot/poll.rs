//! The context of a poll.

use sonarfix::geometry::units::Instant;

use super::{Faults, Search};

/// What the steps of a poll share.
pub(super) struct Poll<'p, 'm, H> {
    pub now: Instant,
    pub hardware: &'p mut H,
    /// The search, if the loop has one.
    pub search: Option<&'p mut Search<'m>>,
    /// Whether it has read the gyro.
    pub has_read_gyro: bool,
    /// The faults so far.
    pub faults: Faults,
}

impl<'p, 'm, H> Poll<'p, 'm, H> {
    pub fn new(now: Instant, hardware: &'p mut H, search: Option<&'p mut Search<'m>>) -> Self {
        Self { now, hardware, search, has_read_gyro: false, faults: Faults::default() }
    }
}
