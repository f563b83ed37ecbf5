//! Faults of the channels of an encoder and of its counter.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{FaultKind, Wheel};

use super::timed::Timed;

/// A fault of an encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Wrong {
    Dead,
    Reversed,
    Missing(f64),
    Unreadable(f64),
}

pub(super) fn of(kind: FaultKind, wheel: Wheel) -> Option<Wrong> {
    match kind {
        FaultKind::DeadEncoder(of) if of == wheel => Some(Wrong::Dead),
        FaultKind::ReversedEncoder(of) if of == wheel => Some(Wrong::Reversed),
        FaultKind::MissingTicks(of, share) if of == wheel => Some(Wrong::Missing(share)),
        FaultKind::ReadErrors(of, share) if of == wheel => Some(Wrong::Unreadable(share)),
        _ => None,
    }
}

/// An edge as it reaches the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Levels of A and B.
    pub levels: (bool, bool),
    /// Whether the interrupt is served.
    pub is_served: bool,
}

/// The faults of one encoder in a run.
#[derive(Debug)]
pub struct EncoderFaults {
    faults: Vec<Timed<Wrong>>,
    rng: ChaCha8Rng,
}

impl EncoderFaults {
    pub(super) fn new(faults: Vec<Timed<Wrong>>, rng: ChaCha8Rng) -> Self {
        Self { faults, rng }
    }

    /// Whether any edge of the run may reach the controller otherwise than without faults.
    #[must_use]
    pub fn may_disturb(&self) -> bool {
        !self.faults.is_empty()
    }

    /// The edge at `now`, µs, that reaches the controller; `levels` are the levels without faults.
    pub fn edge(&mut self, now: u64, levels: (bool, bool)) -> Edge {
        let mut edge = Edge { levels, is_served: true };
        for fault in self.faults.iter().filter(|fault| fault.is_on(now)) {
            let (a, b) = edge.levels;
            match fault.what {
                Wrong::Dead => edge.levels = (false, b),
                Wrong::Reversed => edge.levels = (b, a),
                Wrong::Missing(share) => edge.is_served &= self.rng.random::<f64>() >= share,
                Wrong::Unreadable(_) => {}
            }
        }
        edge
    }

    /// Whether a reading of the counter at `now`, µs, fails.
    pub fn read_fails(&mut self, now: u64) -> bool {
        let mut fails = false;
        for fault in self.faults.iter().filter(|fault| fault.is_on(now)) {
            if let Wrong::Unreadable(share) = fault.what {
                fails |= self.rng.random::<f64>() < share;
            }
        }
        fails
    }
}
