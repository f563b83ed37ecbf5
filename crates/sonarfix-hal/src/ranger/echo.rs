//! The result of a ping: an echo, or the reason for none.

use sonarfix::geometry::units::{Duration, Instant, Metres};

use super::air::Air;
use crate::time::{after, since};

/// The result of a ping.
pub type Outcome = Result<Echo, NoEcho>;

/// An echo.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Echo {
    /// The instant at which the sound was sent, or the first light.
    pub sent: Instant,
    /// The instant at which the echo arrived, or the last light.
    pub heard: Instant,
    /// The distance from the ranger to the wall: of sound half the time of flight at the configured speed of sound.
    pub range: Metres,
}

impl Echo {
    /// The echo of a sound with this time of flight.
    #[must_use]
    pub fn new(sent: Instant, flight: Duration, air: Air) -> Self {
        Self { sent, heard: after(sent, flight), range: air.range(flight) }
    }

    /// The instant of the reflection: the middle of the flight. The range belongs to it (`docs/hardware.md`).
    ///
    /// ```
    /// use sonarfix::geometry::units::{Duration, Instant};
    /// use sonarfix_hal::ranger::{Air, Celsius, Echo};
    /// let sent = Instant::from_ticks(1_000);
    /// let echo = Echo::new(sent, Duration::from_ticks(6_000), Air::at(Celsius(20.0))?);
    /// assert_eq!(echo.reflected(), Instant::from_ticks(4_000));
    /// # Ok::<(), sonarfix_hal::ranger::TemperatureError>(())
    /// ```
    #[must_use]
    pub fn reflected(&self) -> Instant {
        let flight = since(self.heard, self.sent).ticks();
        after(self.sent, Duration::from_ticks(flight / 2))
    }
}

/// Why a ping has no echo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum NoEcho {
    /// There was no echo.
    Nothing,
    /// The echo is from beyond the ranger's reliable range.
    OutOfRange,
    /// The echo line was high at the trigger and remained high: the module hangs, or the line is shorted to its supply.
    /// Pings continue, and each is an attempt to reset the module.
    StuckHigh,
    /// The ranger did not respond: no pulse, or no acknowledgement on the bus.
    NoResponse,
    /// The driver failed while the ping was in flight (the robot loop counts it).
    Failed,
    /// The times of the echo are before the trigger or after the poll: the driver's clock differs from the loop's
    /// (detected by the robot loop).
    Mistimed,
}

impl NoEcho {
    /// Whether it is a fault of the ranger, and not only a missing echo.
    #[must_use]
    pub fn is_fault(self) -> bool {
        match self {
            Self::Nothing | Self::OutOfRange => false,
            Self::StuckHigh | Self::NoResponse | Self::Failed | Self::Mistimed => true,
        }
    }
}

impl core::fmt::Display for NoEcho {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Nothing => "nothing came back",
            Self::OutOfRange => "the echo came from out of range",
            Self::StuckHigh => "the echo line is stuck high",
            Self::NoResponse => "the ranger does not respond",
            Self::Failed => "the driver failed",
            Self::Mistimed => "the echo's times do not fit the ping",
        })
    }
}

impl core::error::Error for NoEcho {}
