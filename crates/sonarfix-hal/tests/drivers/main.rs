//! The drivers against mocked pins and buses: all transactions are listed and must occur.
#![cfg(test)]
#![expect(clippy::cast_precision_loss, reason = "microseconds below a second are exact in f32")]

#[cfg(feature = "async")]
mod asynch;
mod gyro;
mod pulse;
mod quadrature;
mod servo;
mod srf;
mod two_wire;
mod vl53l0x;
mod vl53l1x;

use sonarfix::geometry::units::{Duration, Instant};

fn at(micros: u64) -> Instant {
    Instant::from_ticks(micros)
}

fn span(micros: u64) -> Duration {
    Duration::from_ticks(micros)
}
