//! Quadrature decoding in software: every edge of both channels is a tick (x4).
//!
//! ```text
//!       ┌───┐   ┌───┐          forwards: A leads B; (A, B) goes 00 → 10 → 11 → 01 → 00,
//!   A ──┘   └───┘   └──        and the count up at every step;
//!         ┌───┐   ┌───┐        backwards: in reverse order, and the count down;
//!   B ────┘   └───┘   └        both at once: illegal, an edge was missed.
//! ```

use core::convert::Infallible;
use core::sync::atomic::{AtomicU32, Ordering};

use embedded_hal::digital::{ErrorType, InputPin};

use super::Counter;

/// The count of a [`Quadrature`] decoder: the decoder writes it, possibly from an interrupt, and the loop reads it
/// through a shared reference.
///
/// Each count belongs to one decoder; with two, ticks are lost. No compare-and-swap is used, so it works on a
/// Cortex-M0 too.
#[derive(Debug, Default)]
pub struct TickCount {
    ticks: AtomicU32,
    illegal: AtomicU32,
}

impl TickCount {
    /// A count at zero, for a `static` if need be.
    #[must_use]
    pub const fn new() -> Self {
        Self { ticks: AtomicU32::new(0), illegal: AtomicU32::new(0) }
    }

    /// Only the decoder calls this, so nothing can come between load and store.
    fn add(&self, ticks: i32) {
        let count = self.ticks.load(Ordering::Relaxed);
        self.ticks.store(count.wrapping_add_signed(ticks), Ordering::Relaxed);
    }

    fn add_illegal(&self) {
        let count = self.illegal.load(Ordering::Relaxed);
        self.illegal.store(count.wrapping_add(1), Ordering::Relaxed);
    }
}

impl Counter for &TickCount {
    type Error = Infallible;
    const BITS: u32 = 32;

    fn count(&mut self) -> Result<u32, Infallible> {
        Ok(self.ticks.load(Ordering::Relaxed))
    }

    fn illegal(&mut self) -> u32 {
        self.illegal.load(Ordering::Relaxed)
    }
}

/// A decoder over two pins.
///
/// Call [`Self::update`] at every edge of either pin (an interrupt on both edges), or poll it
/// faster than edges come.
///
/// ```
/// use embedded_hal_mock::eh1::digital::{Mock, State::{High, Low}, Transaction as Pin};
/// use sonarfix_hal::encoder::{Counter, Quadrature, TickCount};
///
/// let mut a = Mock::new(&[Pin::get(Low), Pin::get(High)]);
/// let mut b = Mock::new(&[Pin::get(Low), Pin::get(Low)]);
/// let ticks = TickCount::new();
/// let mut decoder = Quadrature::new(&mut a, &mut b, &ticks)?;
/// decoder.update()?; // A went up first: forwards
/// assert_eq!((&ticks).count(), Ok(1));
/// # a.done();
/// # b.done();
/// # Ok::<(), embedded_hal_mock::eh1::MockError>(())
/// ```
#[derive(Debug)]
pub struct Quadrature<'c, A, B> {
    a: A,
    b: B,
    levels: (bool, bool),
    count: &'c TickCount,
}

impl<'c, A, B> Quadrature<'c, A, B>
where
    A: InputPin,
    B: InputPin + ErrorType<Error = A::Error>,
{
    /// A decoder that starts from the present levels of the pins.
    ///
    /// # Errors
    /// A pin's, if it cannot be read.
    pub fn new(mut a: A, mut b: B, count: &'c TickCount) -> Result<Self, A::Error> {
        let levels = (a.is_high()?, b.is_high()?);
        Ok(Self { a, b, levels, count })
    }

    /// Reads both pins and counts what changed. An illegal transition (both changed) counts no
    /// tick, for its direction is unknown, and one [`Counter::illegal`].
    ///
    /// # Errors
    /// A pin's. Nothing is counted, and the next call detects the change.
    pub fn update(&mut self) -> Result<(), A::Error> {
        let levels = (self.a.is_high()?, self.b.is_high()?);
        match transition(self.levels, levels) {
            Some(0) => {}
            Some(tick) => self.count.add(tick),
            None => self.count.add_illegal(),
        }
        self.levels = levels;
        Ok(())
    }

    /// The pins, to wait for their edges.
    #[cfg(feature = "async")]
    pub(crate) fn pins(&mut self) -> (&mut A, &mut B) {
        (&mut self.a, &mut self.b)
    }

    /// Releases the pins.
    pub fn release(self) -> (A, B) {
        (self.a, self.b)
    }
}

/// The tick from one pair of levels to the next; `None` for an illegal transition.
fn transition(from: (bool, bool), to: (bool, bool)) -> Option<i32> {
    let (a_changed, b_changed) = (from.0 != to.0, from.1 != to.1);
    match (a_changed, b_changed) {
        (false, false) => Some(0),
        // After its edge the leading channel differs from the other one.
        (true, false) => Some(if to.0 == to.1 { -1 } else { 1 }),
        (false, true) => Some(if to.0 == to.1 { 1 } else { -1 }),
        (true, true) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;
    use proptest::prelude::*;

    /// A pin that follows a shared encoder disc: `offset` quarters of a period ahead.
    struct Channel<'a>(&'a Cell<i64>, i64);

    impl ErrorType for Channel<'_> {
        type Error = Infallible;
    }

    impl InputPin for Channel<'_> {
        fn is_high(&mut self) -> Result<bool, Infallible> {
            Ok((self.0.get() + self.1).rem_euclid(4) >= 2)
        }

        fn is_low(&mut self) -> Result<bool, Infallible> {
            self.is_high().map(|high| !high)
        }
    }

    proptest! {
        /// Any valid Gray sequence is counted exactly; every skipped state is counted as illegal.
        #[test]
        fn gray_sequences_count_exactly(
            start in -4_i64..4,
            steps in prop::collection::vec(-2_i64..=2, 1..200),
        ) {
            let disc = Cell::new(start);
            let count = TickCount::new();
            let channels = (Channel(&disc, 1), Channel(&disc, 0));
            let Ok(mut decoder) = Quadrature::new(channels.0, channels.1, &count);
            let (mut ticks, mut illegal) = (0_i64, 0_u32);
            for step in steps {
                disc.set(disc.get() + step);
                // Two quarters at once look the same in both directions.
                let legal = step.abs() <= 1;
                ticks += if legal { step } else { 0 };
                illegal += u32::from(!legal);
                let Ok(()) = decoder.update();
                prop_assert_eq!((&count).count(), Ok(u32::try_from(ticks & 0xFFFF_FFFF).unwrap()));
                prop_assert_eq!((&count).illegal(), illegal);
            }
        }
    }

    #[test]
    fn the_count_wraps_at_both_ends() {
        let count = TickCount::new();
        count.add(-1);
        assert_eq!((&count).count(), Ok(u32::MAX));
        count.add(1);
        assert_eq!((&count).count(), Ok(0));
    }
}
