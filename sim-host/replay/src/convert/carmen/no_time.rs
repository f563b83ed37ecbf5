//! Logs whose stamps are no times.

use super::odometry::{ENOUGH, Sample, Source};

/// Nine of ten records that the robot reached by driving, or more, are not stamped later than the record before them. Stamps of whole seconds are
/// times. Decided from [`ENOUGH`] such records on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoTime {
    equal: usize,
    of: usize,
}

impl NoTime {
    /// Whether the samples, in the order of the file, have no time.
    pub fn of<'a>(samples: impl Iterator<Item = &'a Sample> + Clone) -> Option<Self> {
        let records = samples.filter(|sample| sample.source == Source::Odometry);
        let steps = records.clone().zip(records.skip(1)).filter(|(from, to)| from.pose != to.pose);
        let of = steps.clone().count();
        let equal = steps.filter(|(from, to)| to.time <= from.time).count();
        (of >= ENOUGH && 10 * equal >= 9 * of).then_some(Self { equal, of })
    }
}

impl std::fmt::Display for NoTime {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { equal, of } = self;
        write!(f, "the stamps of {equal} of {of} records do not advance: the log has no time")
    }
}
