//! The interface of a ranger's driver.

use sonarfix::geometry::units::Instant;

use super::echo::Outcome;
use super::settings::{RangerKind, RangerSettings};

/// The driver of a ranger. It never waits: it is triggered, and then polled until it returns an outcome.
///
/// Requirements on implementations: every accepted trigger leads to exactly one outcome or one error in bounded time,
/// while it is polled; either ends the ping. A ping that is no longer polled does not block the next trigger forever.
pub trait Ranger {
    /// The error of the pins or the bus underneath.
    type Error: core::fmt::Debug;

    /// The earliest instant at which [`Self::trigger`] is accepted: the echoes of the last ping must have decayed.
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

    /// The next instant at which [`Self::poll`] does anything, unless an interrupt reports an edge of the echo earlier; `None` if
    /// this is unknown, as by the default implementation, or in the past: the driver is to be polled at the rate of the loop.
    fn poll_at(&self) -> Option<Instant> {
        None
    }

    /// The clock was set back to `now`: the last ping counts as one of now. The default implementation does
    /// nothing, which suits a driver that keeps no time.
    fn set_clock(&mut self, _now: Instant) {}

    /// Configures the driver for the ranger of the robot's configuration. The default implementation accepts
    /// [`RangerKind::Custom`] and ignores the other settings.
    ///
    /// # Errors
    /// [`UnsupportedKind`] if this is a driver for another ranger; nothing has changed.
    fn configure(&mut self, settings: &RangerSettings) -> Result<(), UnsupportedKind> {
        if settings.kind == RangerKind::Custom { Ok(()) } else { Err(UnsupportedKind) }
    }
}

/// Why a ping was not started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TriggerError<E> {
    /// The last ping is in flight, its echoes have not decayed, or its pulse has not ended. This is not a fault; the
    /// trigger is repeated later.
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

/// The driver is for another kind of ranger.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UnsupportedKind;

impl core::fmt::Display for UnsupportedKind {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the driver is for another kind of ranger")
    }
}

impl core::error::Error for UnsupportedKind {}
