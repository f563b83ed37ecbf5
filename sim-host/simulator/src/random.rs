//! Normal random numbers with the same bits on every platform.
//!
//! `rand_distr` takes the logarithm for a number in the tail from the platform's mathematical library, whose
//! last bit differs between platforms. Here it is taken from `libm` instead.

use std::convert::Infallible;

use rand::{Rng, RngExt, TryRng};
use rand_distr::StandardNormal;

/// Where the tail of the ziggurat of `rand_distr` begins (`ZIG_NORM_R`).
const TAIL: f64 = 3.654_152_885_361_009;

/// A draw of the standard normal distribution.
pub fn normal(rng: &mut impl Rng) -> f64 {
    let mut kept = LastWords { rng, last: [0; 2] };
    let drawn: f64 = kept.sample(StandardNormal);
    if drawn.abs() < TAIL {
        return drawn;
    }
    // Marsaglia's method for the tail: R − ln(u)/R, and a second draw that decides whether it is accepted.
    let [u, _] = kept.last;
    (TAIL - libm::log(open_unit(u)) / TAIL).copysign(drawn)
}

/// A number in (0, 1), as `rand::distr::Open01` makes it.
fn open_unit(bits: u64) -> f64 {
    f64::from_bits(1.0_f64.to_bits() | bits >> 12) - (1.0 - f64::EPSILON / 2.0)
}

/// A generator that keeps its last two numbers.
struct LastWords<'a, R> {
    rng: &'a mut R,
    last: [u64; 2],
}

impl<R: Rng> TryRng for LastWords<'_, R> {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        self.rng.try_next_u32()
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        let next = self.rng.try_next_u64()?;
        self.last = [self.last[1], next];
        Ok(next)
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        self.rng.try_fill_bytes(bytes)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// The draws are those of `rand_distr`, in the tail to within the rounding of a logarithm.
    #[test]
    fn a_draw_is_that_of_the_distribution() {
        let mut ours = ChaCha8Rng::seed_from_u64(5);
        let mut theirs = ours.clone();
        let mut in_tail = 0;
        for _ in 0..100_000 {
            let (draw, expected) = (normal(&mut ours), theirs.sample::<f64, _>(StandardNormal));
            if expected.abs() < TAIL {
                assert_eq!(draw.to_bits(), expected.to_bits());
            } else {
                in_tail += 1;
                assert!((draw - expected).abs() <= 2.0 * f64::EPSILON * TAIL, "{draw} {expected}");
            }
        }
        // Of 100,000 draws 26 are expected.
        assert!(in_tail > 5, "{in_tail}");
    }
}
