//! Faults of the echo line.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::FaultKind;

use super::timed::Timed;

/// Shortest time of flight of an echo that is none, µs: 5 cm.
const NEAREST: u64 = 300;

/// A fault of the echo line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Wrong {
    Lost(f64),
    CrossTalk(f64),
    False(f64),
    Stuck,
    Dead,
}

pub(super) fn of(kind: FaultKind) -> Option<Wrong> {
    match kind {
        FaultKind::LostEchoes(share) => Some(Wrong::Lost(share)),
        FaultKind::CrossTalk(share) => Some(Wrong::CrossTalk(share)),
        FaultKind::FalseRanges(share) => Some(Wrong::False(share)),
        FaultKind::StuckEcho => Some(Wrong::Stuck),
        FaultKind::DeadSonar => Some(Wrong::Dead),
        _ => None,
    }
}

/// The faults of a sonar in a run.
#[derive(Debug)]
pub struct SonarFaults {
    faults: Vec<Timed<Wrong>>,
    rng: ChaCha8Rng,
}

impl SonarFaults {
    pub(super) fn new(faults: Vec<Timed<Wrong>>, rng: ChaCha8Rng) -> Self {
        Self { faults, rng }
    }

    /// Whether the sonar does not answer a trigger at `now`, µs.
    #[must_use]
    pub fn is_dead(&self, now: u64) -> bool {
        self.faults.iter().any(|fault| fault.what == Wrong::Dead && fault.is_on(now))
    }

    /// Duration of the echo pulse, µs, after a trigger at `now`. `undisturbed` is the pulse without
    /// faults, `silence` the pulse without an echo.
    pub fn pulse(&mut self, now: u64, undisturbed: u64, silence: u64) -> u64 {
        let mut pulse = undisturbed;
        for fault in self.faults.iter().filter(|fault| fault.is_on(now)) {
            pulse = match fault.what {
                Wrong::Lost(share) if self.rng.random::<f64>() < share => silence,
                // The earlier echo ends the pulse, whichever robot sent its ping.
                Wrong::CrossTalk(share) if self.rng.random::<f64>() < share => {
                    pulse.min(any_before(&mut self.rng, silence))
                }
                Wrong::False(share) if self.rng.random::<f64>() < share => {
                    any_before(&mut self.rng, silence)
                }
                Wrong::Stuck => fault.to - now,
                _ => pulse,
            };
        }
        pulse
    }
}

/// A time of flight shorter than `silence`, µs.
fn any_before(rng: &mut ChaCha8Rng, silence: u64) -> u64 {
    rng.random_range(NEAREST..silence.max(NEAREST + 1))
}
