//! An echo line whose pin is polled.

use embedded_hal::digital::InputPin;
use sonarfix::geometry::units::{Duration, Instant};

use super::pulse::{EchoLine, Pulse};
use crate::time::since;

/// An echo line whose edges get the time of the poll that found them.
///
/// An edge is stamped late by up to one poll, and 1 ms of flight is 17 cm of range: poll every
/// few tens of microseconds, or use [`Captured`](super::Captured).
#[derive(Debug)]
pub struct Polled<P> {
    pin: P,
    level: bool,
    rise: Option<Instant>,
    shortest: Duration,
}

impl<P: InputPin> Polled<P> {
    /// An echo line on this pin.
    #[must_use]
    pub fn new(pin: P) -> Self {
        Self { pin, level: false, rise: None, shortest: Duration::from_ticks(0) }
    }

    /// The pin and the level it had last, to wait for its edges.
    #[cfg(feature = "async")]
    pub(crate) fn pin(&mut self) -> (&mut P, bool) {
        (&mut self.pin, self.level)
    }

    /// Releases the pin.
    pub fn release(self) -> P {
        self.pin
    }
}

impl<P: InputPin> EchoLine for Polled<P> {
    type Error = P::Error;

    fn is_high(&mut self) -> Result<bool, P::Error> {
        self.pin.is_high()
    }

    fn arm(&mut self, shortest: Duration) -> Result<(), P::Error> {
        self.level = self.pin.is_high()?;
        self.rise = None;
        self.shortest = shortest;
        Ok(())
    }

    fn pulse(&mut self, now: Instant) -> Result<Option<Pulse>, P::Error> {
        let before = core::mem::replace(&mut self.level, self.pin.is_high()?);
        match (before, self.level) {
            (false, true) => self.rise = Some(now),
            (true, false) => {
                let pulse = self.rise.take().map(|rise| Pulse { rise, fall: now });
                let long_enough = |pulse: &Pulse| since(pulse.fall, pulse.rise) >= self.shortest;
                return Ok(pulse.filter(long_enough));
            }
            _ => {}
        }
        Ok(None)
    }

    fn has_risen(&self) -> bool {
        self.rise.is_some()
    }
}
