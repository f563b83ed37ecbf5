//! Counts of faults.

/// Faults of one encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EncoderFaults {
    /// Failed readings. No travel is lost: the next successful reading contains it.
    pub errors: u32,
    /// Illegal transitions. Each loses or adds one or two edges.
    pub illegal: u32,
}

/// Counts of faults, in one [`poll`](super::Robot::poll) or since the start. None of them stops the loop. The
/// counts saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Faults {
    /// The right encoder.
    pub right: EncoderFaults,
    /// The left encoder.
    pub left: EncoderFaults,
    /// The servo's driver refused or failed. The last bearing is used.
    pub servo: u32,
    /// The ranger's driver failed or timed out, its echo line is stuck, it does not respond, or its clock differs
    /// from the loop's. A ping without an echo is not a fault.
    pub ranger: u32,
    /// Implausible steps of the wheels, which were discarded.
    pub travel: u32,
    /// Late samples of the encoders, because the loop was polled late
    /// ([`Settings::tolerance`](super::Settings::tolerance)).
    pub deadlines: u32,
    /// Polls with a time before that of an earlier poll, which have no other effect.
    pub clock: u32,
    /// Samples of the gyro that could not be read, are saturated, stuck or erratic, or follow missing ones. The wheels alone are
    /// used until there are good ones.
    pub gyro: u32,
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
    /// The sum of both counts.
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
            gyro: self.gyro.saturating_add(other.gyro),
        }
    }

    /// Whether there is no fault.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}
