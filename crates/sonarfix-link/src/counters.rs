//! Counts what a receiver has read and skipped.

use serde::{Deserialize, Serialize};

/// Frames that a receiver has read and skipped, by the reason. Each count saturates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ReceiverCounters {
    /// Frames that were read.
    pub frames: u32,
    /// Line noise, damaged and truncated frames: invalid COBS, too short, or a wrong checksum.
    pub corrupt: u32,
    /// Longer than any frame.
    pub too_long: u32,
    /// Valid frames of another version or kind.
    pub foreign: u32,
    /// Valid frames of this version and kind without a valid message: a defect of the sender.
    pub undecodable: u32,
}

impl ReceiverCounters {
    /// The counters of a new receiver.
    pub(crate) const ZERO: Self =
        Self { frames: 0, corrupt: 0, too_long: 0, foreign: 0, undecodable: 0 };

    /// The number of frames that were skipped, for whatever reason.
    #[must_use]
    pub fn skipped(&self) -> u32 {
        [self.corrupt, self.too_long, self.foreign, self.undecodable]
            .into_iter()
            .fold(0, u32::saturating_add)
    }
}
