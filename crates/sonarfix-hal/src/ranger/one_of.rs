//! Two rangers on one board, of which the robot's configuration chooses one.

use sonarfix::geometry::units::Instant;

use super::driver::{Ranger, TriggerError, UnsupportedKind};
use super::echo::Outcome;
use super::settings::RangerSettings;

/// Drivers for two kinds of rangers, so that one firmware supports both: [`Ranger::configure`] chooses the first one that
/// supports the ranger of the robot. Before it, the first one.
#[derive(Debug)]
pub struct OneOf<A, B> {
    first: A,
    second: B,
    is_second: bool,
}

/// The error of one of two drivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OneOfError<A, B> {
    /// Of the first one.
    First(A),
    /// Of the second one.
    Second(B),
}

impl<A: core::fmt::Debug, B: core::fmt::Debug> core::fmt::Display for OneOfError<A, B> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::First(error) => write!(f, "the first ranger: {error:?}"),
            Self::Second(error) => write!(f, "the second ranger: {error:?}"),
        }
    }
}

impl<A: core::fmt::Debug, B: core::fmt::Debug> core::error::Error for OneOfError<A, B> {}

impl<A, B> OneOf<A, B> {
    /// These two drivers.
    #[must_use]
    pub fn new(first: A, second: B) -> Self {
        Self { first, second, is_second: false }
    }
}

impl<A: Ranger, B: Ranger> Ranger for OneOf<A, B> {
    type Error = OneOfError<A::Error, B::Error>;

    fn ready_at(&self) -> Instant {
        if self.is_second { self.second.ready_at() } else { self.first.ready_at() }
    }

    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<Self::Error>> {
        if self.is_second {
            self.second.trigger(now).map_err(|error| of(error, OneOfError::Second))
        } else {
            self.first.trigger(now).map_err(|error| of(error, OneOfError::First))
        }
    }

    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, Self::Error> {
        if self.is_second {
            self.second.poll(now).map_err(OneOfError::Second)
        } else {
            self.first.poll(now).map_err(OneOfError::First)
        }
    }

    fn poll_at(&self) -> Option<Instant> {
        if self.is_second { self.second.poll_at() } else { self.first.poll_at() }
    }

    fn set_clock(&mut self, now: Instant) {
        self.first.set_clock(now);
        self.second.set_clock(now);
    }

    fn configure(&mut self, settings: &RangerSettings) -> Result<(), UnsupportedKind> {
        let is_first = self.first.configure(settings).is_ok();
        if !is_first {
            self.second.configure(settings)?;
        }
        self.is_second = !is_first;
        Ok(())
    }
}

fn of<E, F>(error: TriggerError<E>, which: impl Fn(E) -> F) -> TriggerError<F> {
    match error {
        TriggerError::TooSoon => TriggerError::TooSoon,
        TriggerError::Device(error) => TriggerError::Device(which(error)),
    }
}
