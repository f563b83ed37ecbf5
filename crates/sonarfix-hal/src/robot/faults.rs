//! Counts of what went wrong.

/// What went wrong with one encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EncoderFaults {
    /// Readings that failed. The travel is not lost: the next reading that works brings it.
    pub errors: u32,
    /// Illegal transitions, each a tick or two lost or made up.
    pub illegal: u32,
}

/// What went wrong: in one [`poll`](super::Robot::poll), or since the start. Nothing here stops
/// the loop. Counts stay at their ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Faults {
    /// The right encoder.
    pub right: EncoderFaults,
    /// The left encoder.
    pub left: EncoderFaults,
    /// The servo refused to turn, or its driver failed. Its last bearing is used.
    pub servo: u32,
    /// The ranger's driver failed, or the ranger never came to an end, or its line is stuck, it
    /// does not respond, or its clock is not the loop's. Silence of a working one is no fault.
    pub ranger: u32,
    /// Steps of the wheels that the localizer could not believe, and that were written off.
    pub travel: u32,
    /// Encoder ticks that were done late, because the loop was polled late
    /// ([`Settings::tolerance`](super::Settings::tolerance)).
    pub deadlines: u32,
    /// Polls with a time before that of an earlier one; nothing was done in them.
    pub clock: u32,
}

impl EncoderFaults {
    fn plus(self, other: Self) -> Self {
        Self {
            errors: self.errors.saturating_add(other.errors),
            illegal: self.illegal.saturating_add(other.illegal),
        }
    }
}

impl Faults {
    /// Both counts together.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            right: self.right.plus(other.right),
            left: self.left.plus(other.left),
            servo: self.servo.saturating_add(other.servo),
            ranger: self.ranger.saturating_add(other.ranger),
            travel: self.travel.saturating_add(other.travel),
            deadlines: self.deadlines.saturating_add(other.deadlines),
            clock: self.clock.saturating_add(other.clock),
        }
    }

    /// Whether nothing went wrong.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}
