//! Faults of the gyro.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::FaultKind;
use sonarfix_pil::GyroSignal;

use super::timed::Timed;

/// A fault of the gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Wrong {
    Stuck,
    Saturated,
    Garbled(f64),
    Unreadable(f64),
}

/// The end of the smallest range of an MPU-6050, 250°/s, in millionths of a radian per second.
const RANGE: i32 = 4_363_323;

pub(super) fn of(kind: FaultKind) -> Option<Wrong> {
    match kind {
        FaultKind::StuckGyro => Some(Wrong::Stuck),
        FaultKind::SaturatedGyro => Some(Wrong::Saturated),
        FaultKind::GarbledGyro(share) => Some(Wrong::Garbled(share)),
        FaultKind::GyroReadErrors(share) => Some(Wrong::Unreadable(share)),
        _ => None,
    }
}

/// The faults of the gyro in a run.
#[derive(Debug)]
pub struct GyroFaults {
    faults: Vec<Timed<Wrong>>,
    rng: ChaCha8Rng,
}

impl GyroFaults {
    pub(super) fn new(faults: Vec<Timed<Wrong>>, rng: ChaCha8Rng) -> Self {
        Self { faults, rng }
    }

    /// What the loop sees instead of `right`, a new sample, after `last`.
    pub fn signal(&mut self, now: u64, right: GyroSignal, last: GyroSignal) -> GyroSignal {
        let mut seen = right;
        for fault in self.faults.iter().filter(|fault| fault.is_on(now)) {
            match fault.what {
                Wrong::Stuck => seen.micros = last.micros,
                Wrong::Saturated => seen.micros = i32::MAX,
                Wrong::Garbled(share) => {
                    if self.rng.random::<f64>() < share {
                        seen.micros = self.rng.random_range(-RANGE..RANGE);
                    }
                }
                Wrong::Unreadable(share) => {
                    seen.has_failed |= self.rng.random::<f64>() < share;
                }
            }
        }
        seen
    }
}
