//! What can be set on the loop.

use sonarfix::units::Duration;

pub use sonarfix::config::Rhythm;

/// To which instant an echo belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Stamp {
    /// To that at which the sound met the wall (`DESIGN.md`, decision 4).
    Reflection,
    /// To that at which the loop gets to know of it: naive, and wrong by half the flight and the
    /// loop's delay. It is here to show what that costs.
    Arrival,
}

/// Settings of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// Period of the encoder tick.
    pub tick: Duration,
    /// How late a tick may be done without counting as a missed deadline; the time for which the
    /// sonar holds it back is not counted.
    pub tolerance: Duration,
    /// How often the sonar looks; the localizer plans with
    /// [`Timing::rhythm`](sonarfix::config::Timing::rhythm), so both should say the same. Where
    /// there is nothing to look at, [`Rhythm::AsFastAsPossible`] asks again at the next encoder
    /// tick.
    pub rhythm: Rhythm,
    /// To which instant an echo belongs.
    pub stamp: Stamp,
    /// How long a ranger may take, to accept a trigger or from the first time that it is asked
    /// for the outcome, before the loop gives the ping up. Longer than any of our drivers takes; it guards the loop against a ranger that
    /// never comes to an end.
    pub patience: Duration,
}

impl Default for Settings {
    /// The paper's: a tick every 100 ms and a fix every second.
    fn default() -> Self {
        Self {
            tick: Duration::from_ticks(100_000),
            tolerance: Duration::from_ticks(10_000),
            rhythm: Rhythm::Every(Duration::from_ticks(1_000_000)),
            stamp: Stamp::Reflection,
            patience: Duration::from_ticks(150_000),
        }
    }
}

/// A setting that is zero and must not be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SettingsError {
    /// [`Settings::tick`].
    Tick,
    /// The period of [`Rhythm::Every`].
    Rhythm,
    /// [`Settings::patience`].
    Patience,
}

impl core::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Tick => "the encoder tick's period must not be zero",
            Self::Rhythm => "the period of the fixes must not be zero",
            Self::Patience => "the patience with a ranger must not be zero",
        })
    }
}

impl core::error::Error for SettingsError {}

impl Settings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`SettingsError`] with the first that breaks its rule.
    pub fn check(&self) -> Result<(), SettingsError> {
        if self.tick.is_zero() {
            return Err(SettingsError::Tick);
        }
        if self.rhythm == Rhythm::Every(Duration::from_ticks(0)) {
            return Err(SettingsError::Rhythm);
        }
        if self.patience.is_zero() {
            return Err(SettingsError::Patience);
        }
        Ok(())
    }
}
