//! Faults of the hardware, as wrappers around what passes a wire: each takes what an honest device
//! would do and returns what is done. All that are active at a time apply, in the order of the
//! scenario; chance comes from streams of the run's seed that nothing else draws from.
//!
//! - `sonar`: the pulse of an echo;
//! - `encoder`: the edges of a wheel;
//! - `controller`: the servo's orders, the time of a poll, the power.

mod controller;
mod encoder;
mod sonar;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{Fault, FaultKind, Wheel};

pub use controller::ControllerFaults;
pub use encoder::{Edge, EncoderFaults};
pub use sonar::SonarFaults;

/// The first of the seed's streams that belong to faults.
const STREAMS: u64 = 100;

/// Something that is on for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Timed<T> {
    what: T,
    /// µs.
    from: u64,
    /// µs.
    to: u64,
}

impl<T> Timed<T> {
    fn is_on(&self, now: u64) -> bool {
        (self.from..self.to).contains(&now)
    }
}

/// All faults of a run, by the device they belong to.
#[derive(Debug)]
pub struct Faults {
    /// Of the sonar.
    pub sonar: SonarFaults,
    /// Of the right and of the left encoder.
    pub encoders: [EncoderFaults; 2],
    /// Of servo, clock and power.
    pub controller: ControllerFaults,
}

impl Faults {
    /// A scenario's faults, in a run with a seed.
    #[must_use]
    pub fn new(faults: &[Fault], seed: u64) -> Self {
        let stream = |n| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(STREAMS + n);
            rng
        };
        let of = |wheel, n| EncoderFaults::new(pick(faults, |k| encoder::of(k, wheel)), stream(n));
        Self {
            sonar: SonarFaults::new(pick(faults, sonar::of), stream(0)),
            encoders: [of(Wheel::Right, 1), of(Wheel::Left, 2)],
            controller: ControllerFaults::new(pick(faults, controller::of), stream(3)),
        }
    }
}

/// Those of the faults that a device has, in its own terms.
fn pick<T>(faults: &[Fault], of: impl Fn(FaultKind) -> Option<T>) -> Vec<Timed<T>> {
    let micros = crate::simulate::micros;
    let timed =
        |f: &Fault| Some(Timed { what: of(f.kind)?, from: micros(f.from), to: micros(f.to) });
    faults.iter().filter_map(timed).collect()
}

#[cfg(test)]
mod tests;
