//! Ultrasonic rangers behind one trait: trigger, poll, and an echo or the reason for none.
//!
//! Responsibilities, one file each:
//! - this one: [`Ranger`], [`Echo`], [`NoEcho`];
//! - [`Air`]: the speed of sound, from a set temperature;
//! - [`PulseRanger`]: rangers that answer with a pulse as long as the flight (HC-SR04 and its
//!   kin, SRF04/05, LV-MaxSonar by pulse width), over an [`EchoLine`]: [`Polled`] or
//!   [`Captured`] by an interrupt, or by hardware that stamps ([`StampedEdges`]);
//! - [`Srf`]: SRF02 and SRF08 on I²C.
//!
//! Not supported: rangers whose pulse only represents the range after it was measured
//! (HRLV-MaxSonar, 1 µs/mm), for their pulse does not say when the sound flew.
//!
//! # Non-finite policy
//! The only float that enters is the temperature, and [`Air::at`] refuses one that is not
//! finite; every range is then finite.

mod air;
mod capture;
mod polled;
mod pulse;
mod srf;
mod stamps;

use sonarfix::units::{Duration, Instant, Metres};

use crate::time::{after, since};

pub use air::{Air, Celsius, TemperatureError};
pub use capture::{Captured, EchoCapture};
pub use polled::Polled;
pub use pulse::{EchoLine, Pulse, PulseError, PulseRanger, PulseTiming};
pub use srf::Srf;
pub use stamps::{StampedEdges, Stamps};

/// An ultrasonic ranger that never waits: it is triggered, and then polled until it has an
/// outcome.
///
/// Implementers: every trigger that was accepted comes to exactly one outcome, or one error, in
/// bounded time if polling goes on; after either the ping is over. A ping that nobody polled any
/// more does not keep the next from being triggered, after a while.
pub trait Ranger {
    /// The error of the pins or the bus underneath.
    type Error: core::fmt::Debug;

    /// The earliest time at which [`Self::trigger`] is not too soon, as far as known: echoes of
    /// the last ping must have died away.
    fn ready_at(&self) -> Instant;

    /// Starts one ping.
    ///
    /// # Errors
    /// [`TriggerError`]; no ping was started.
    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<Self::Error>>;

    /// The outcome of the ping; `None` while it is in flight, or if there is none.
    ///
    /// # Errors
    /// The device's; the ping is over.
    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, Self::Error>;
}

/// What became of a ping.
pub type Outcome = Result<Echo, NoEcho>;

/// An echo.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Echo {
    /// When the sound left.
    pub sent: Instant,
    /// When it was heard.
    pub heard: Instant,
    /// Half the flight at the speed of sound that the driver was set to: the distance from the
    /// sonar to the wall.
    pub range: Metres,
}

impl Echo {
    /// The echo of a sound that flew for `flight`.
    #[must_use]
    pub fn new(sent: Instant, flight: Duration, air: Air) -> Self {
        Self { sent, heard: after(sent, flight), range: air.range(flight) }
    }

    /// When the sound met the wall: half-way through its flight. The range is the one at that
    /// instant (`DESIGN.md`, decision 4).
    ///
    /// ```
    /// use sonarfix::units::{Duration, Instant};
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
    /// The ranger listened, and nothing came back.
    Nothing,
    /// Something came back from farther than the ranger can be trusted.
    OutOfRange,
    /// The echo line was high at the trigger and stayed so: the board hangs, or the wire touches
    /// its supply. Pings go on, and each is an attempt to free it.
    StuckHigh,
    /// The ranger gave no sign of life: no pulse, or no word on the bus.
    NoResponse,
    /// The driver failed while the ping was in flight (the robot loop counts it).
    Failed,
    /// The driver said that the sound met the wall before the trigger or after it was asked: its
    /// clock is not the loop's (the robot loop found out).
    Mistimed,
}

impl NoEcho {
    /// Whether it is a fault of the ranger, and not just a wall that did not answer.
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

/// Why a ping was not started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TriggerError<E> {
    /// The last ping is in flight, its echoes have not died away, or its pulse has not ended.
    /// Not a fault: try again later.
    TooSoon,
    /// The device's error.
    Device(E),
}

impl<E: core::fmt::Debug> core::fmt::Display for TriggerError<E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooSoon => f.write_str("too soon after the last ping"),
            Self::Device(error) => write!(f, "the ranger: {error:?}"),
        }
    }
}

impl<E: core::fmt::Debug> core::error::Error for TriggerError<E> {}
