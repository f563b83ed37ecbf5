//! Faults of the hardware, as functions of the undisturbed signal on a wire. All active faults
//! apply, in the order of the scenario. Each device has a random stream of its own, so that a fault
//! changes no other random draw of the run.
//!
//! - `sonar`: the echo pulse;
//! - `encoder`: the edges of a wheel;
//! - `gyro`: the rate of the gyro;
//! - `controller`: the servo commands, the time of a poll, the power supply.

mod controller;
mod encoder;
mod gyro;
mod sonar;
mod timed;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{Fault, FaultKind, Wheel};

pub use controller::ControllerFaults;
pub use encoder::{Edge, EncoderFaults};
pub use gyro::GyroFaults;
pub use sonar::SonarFaults;
use timed::Timed;

/// The first random stream that belongs to faults.
const STREAMS: u64 = 100;

/// All faults of a run, by device.
#[derive(Debug)]
pub struct Faults {
    /// Faults of the sonar.
    pub sonar: SonarFaults,
    /// Faults of the right and of the left encoder.
    pub encoders: [EncoderFaults; 2],
    /// Faults of servo, timing and power.
    pub controller: ControllerFaults,
    /// Faults of the gyro.
    pub gyro: GyroFaults,
}

impl Faults {
    /// The faults of a scenario, in a run with a seed.
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
            gyro: GyroFaults::new(pick(faults, gyro::of), stream(4)),
        }
    }
}

/// The faults of one device, selected and converted by `of`.
fn pick<T>(faults: &[Fault], of: impl Fn(FaultKind) -> Option<T>) -> Vec<Timed<T>> {
    let micros = crate::time::micros;
    let timed =
        |f: &Fault| Some(Timed { what: of(f.kind)?, from: micros(f.from), to: micros(f.to) });
    faults.iter().filter_map(timed).collect()
}

#[cfg(test)]
mod tests;
