//! Position counters of any width, and the position behind their wrap-around.

use core::convert::Infallible;

/// A counter that goes up when the wheel rolls forwards and down when it rolls backwards, and
/// wraps around at its ends.
///
/// ```
/// use sonarfix_hal::encoder::{Count16, Counter};
/// # let timer = 0_u16;
/// // An STM32 timer in encoder mode: `Count16(|| timer.cnt().read().cnt().bits())`.
/// let mut right = Count16(|| timer);
/// assert_eq!(right.count(), Ok(0));
/// ```
pub trait Counter {
    /// The error of a reading.
    type Error: core::fmt::Debug;

    /// Width of the counter in bits, 1 to 32. Between two readings it must move by less than half its range
    /// (32,767 ticks for 16 bits); [`Hardware::configure`](crate::robot::Hardware::configure) checks it.
    const BITS: u32;

    /// The count now, in the lowest [`Self::BITS`] bits; the others are ignored.
    ///
    /// # Errors
    /// The error of the hardware.
    fn count(&mut self) -> Result<u32, Self::Error>;

    /// The number of illegal transitions (both channels changed at once): edges were missed, or the wiring is noisy.
    /// Wraps around. Zero where the hardware does not detect them.
    fn illegal(&mut self) -> u32 {
        0
    }
}

impl<C: Counter + ?Sized> Counter for &mut C {
    type Error = C::Error;
    const BITS: u32 = C::BITS;

    fn count(&mut self) -> Result<u32, Self::Error> {
        (**self).count()
    }

    fn illegal(&mut self) -> u32 {
        (**self).illegal()
    }
}

/// A 16-bit hardware counter, read by a closure.
#[derive(Debug, Clone, Copy)]
pub struct Count16<F>(pub F);

impl<F: FnMut() -> u16> Counter for Count16<F> {
    type Error = Infallible;
    const BITS: u32 = 16;

    fn count(&mut self) -> Result<u32, Infallible> {
        Ok(u32::from((self.0)()))
    }
}

/// A 32-bit hardware counter, read by a closure.
#[derive(Debug, Clone, Copy)]
pub struct Count32<F>(pub F);

impl<F: FnMut() -> u32> Counter for Count32<F> {
    type Error = Infallible;
    const BITS: u32 = 32;

    fn count(&mut self) -> Result<u32, Infallible> {
        Ok((self.0)())
    }
}

/// The position of a counter, without its wrap-around.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Unwrapped {
    last: Option<u32>,
    position: i64,
}

impl Unwrapped {
    /// Ticks since the first reading.
    ///
    /// # Errors
    /// The counter's. The position is unchanged, and the next reading contains the whole travel.
    pub fn read<C: Counter>(&mut self, counter: &mut C) -> Result<i64, C::Error> {
        let count = counter.count()?;
        let moved = self.last.map_or(0, |last| difference(count, last, C::BITS));
        self.last = Some(count);
        self.position = self.position.wrapping_add(i64::from(moved));
        Ok(self.position)
    }
}

/// `to − from` of a counter with `bits` bits, modulo its range: the difference of the smallest magnitude.
fn difference(to: u32, from: u32, bits: u32) -> i32 {
    let spare = 32_u32.saturating_sub(bits).min(31);
    // Shifted up, the counter's highest bit is the sign, and the shift back extends it.
    let shifted = (to.wrapping_sub(from) << spare).cast_signed();
    shifted >> spare
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A counter `N` bits wide with arbitrary bits above them.
    struct Narrow<const N: u32>(i64);

    impl<const N: u32> Counter for Narrow<N> {
        type Error = Infallible;
        const BITS: u32 = N;

        fn count(&mut self) -> Result<u32, Infallible> {
            let count = u32::try_from(self.0 & 0xFFFF_FFFF).unwrap();
            let rubbish = if N < 32 { 0xA5A5_A5A5 << N } else { 0 };
            Ok((count & (u32::MAX >> (32 - N))) ^ rubbish)
        }
    }

    /// Moves by steps, each in 256ths of the counter's half range; returns the number of wraps.
    fn follow<const N: u32>(start: u32, steps: &[i64]) -> Result<u32, TestCaseError> {
        let (range, mut wraps) = (1_i64 << N, 0);
        let first = i64::from(start);
        let mut counter = Narrow::<N>(first);
        let mut unwrapped = Unwrapped::default();
        prop_assert_eq!(unwrapped.read(&mut counter), Ok(0));
        for step in steps {
            let before = counter.0.div_euclid(range);
            counter.0 += step * (range / 2 - 1) / 256;
            wraps += u32::from(counter.0.div_euclid(range) != before);
            prop_assert_eq!(unwrapped.read(&mut counter), Ok(counter.0 - first));
        }
        Ok(wraps)
    }

    proptest! {
        /// The position is exact at any width and through any number of wraps.
        #[test]
        fn positions_survive_wrap_around(
            start: u32,
            mut steps in prop::collection::vec(-256_i64..=256, 1..60),
        ) {
            // Five long steps in the same direction overflow every counter, whatever came before.
            steps.extend([256; 5]);
            prop_assert!(follow::<4>(start, &steps)? > 0);
            prop_assert!(follow::<8>(start, &steps)? > 0);
            prop_assert!(follow::<16>(start, &steps)? > 0);
            prop_assert!(follow::<24>(start, &steps)? > 0);
            prop_assert!(follow::<32>(start, &steps)? > 0);
        }
    }

    #[test]
    fn both_ends_of_a_16_bit_counter() {
        assert_eq!(difference(0, 0xFFFF, 16), 1);
        assert_eq!(difference(0xFFFF, 0, 16), -1);
        assert_eq!(difference(0x7FFF, 0, 16), 32_767);
        assert_eq!(difference(0x8000, 0, 16), -32_768);
    }

    #[test]
    fn closures_are_counters() {
        let mut ticks = 65_530_u16;
        let mut counter = Count16(|| {
            ticks = ticks.wrapping_add(4);
            ticks
        });
        let mut unwrapped = Unwrapped::default();
        let read: std::vec::Vec<_> = (0..3).map(|_| unwrapped.read(&mut counter)).collect();
        assert_eq!(read, [Ok(0), Ok(4), Ok(8)]);
        assert_eq!(Count32(|| u32::MAX).count(), Ok(u32::MAX));
    }
}
