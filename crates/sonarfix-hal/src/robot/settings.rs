//! The settings of the loop.

use sonarfix::geometry::units::Duration;

/// The instant to which an echo belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Stamp {
    /// That of the reflection at the wall (`docs/hardware.md`).
    Reflection,
    /// That of the poll which reads it: late by half the time of flight and the delay of the loop. For the
    /// measurement of what that costs.
    Arrival,
}

/// Evaluations of the search a millisecond: the computing time that simulation, replay and the STM32 firmware grant it. A
/// Cortex-M4F at 168 MHz needs two thirds of a millisecond for them (`docs/benchmarks.md` has the instructions).
pub const EVALUATIONS_PER_MILLISECOND: u16 = 40;

/// Settings of the loop. The ping schedule is that of the localizer's configuration
/// ([`PingTiming::schedule`](sonarfix::config::PingTiming::schedule)); where no wall can be
/// measured, [`PingSchedule::AsFastAsPossible`](sonarfix::config::PingSchedule) tries again at the next
/// tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// Time from one sample of the encoders to the next.
    pub encoder_period: Duration,
    /// The greatest delay of a tick that does not count as a missed deadline, without the delay by a ping.
    pub tolerance: Duration,
    /// The instant to which an echo belongs.
    pub stamp: Stamp,
    /// The longest time that a ranger may take to accept a trigger, or from the first poll to the outcome, before
    /// the loop aborts the ping. It is longer than any driver of this crate takes, and protects the loop from a
    /// driver that never ends.
    pub patience: Duration,
    /// Evaluations of the search in a poll that has nothing else to do ([`Robot::poll_into`](super::Robot)).
    pub evaluations: u16,
}

impl Default for Settings {
    /// A sample every 100 ms.
    fn default() -> Self {
        Self {
            encoder_period: Duration::from_ticks(100_000),
            tolerance: Duration::from_ticks(10_000),
            stamp: Stamp::Reflection,
            patience: Duration::from_ticks(150_000),
            evaluations: 1,
        }
    }
}

/// A setting that is zero and must not be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SettingsError {
    /// [`Settings::encoder_period`].
    EncoderPeriod,
    /// [`Settings::patience`].
    Patience,
}

impl core::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::EncoderPeriod => "the encoder period must not be zero",
            Self::Patience => "the ranger's timeout must not be zero",
        })
    }
}

impl core::error::Error for SettingsError {}

impl Settings {
    /// Checks all settings.
    ///
    /// # Errors
    /// [`SettingsError`] with the first that breaks its rule.
    pub fn check(&self) -> Result<(), SettingsError> {
        if self.encoder_period.is_zero() {
            return Err(SettingsError::EncoderPeriod);
        }
        if self.patience.is_zero() {
            return Err(SettingsError::Patience);
        }
        Ok(())
    }
}
