//! Faults of the servo, of the loop's timing and of the power supply.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::FaultKind;

use super::timed::Timed;

/// A fault of servo, timing or power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Wrong {
    StuckServo,
    SlowServo(f64),
    /// µs.
    Late(u64),
    NoPower,
}

pub(super) fn of(kind: FaultKind) -> Option<Wrong> {
    match kind {
        FaultKind::StuckServo => Some(Wrong::StuckServo),
        FaultKind::SlowServo(times) => Some(Wrong::SlowServo(times)),
        FaultKind::ClockJitter(late) => Some(Wrong::Late(crate::time::micros(late))),
        FaultKind::BrownOut => Some(Wrong::NoPower),
        _ => None,
    }
}

/// The faults of servo, timing and power in a run.
#[derive(Debug)]
pub struct ControllerFaults {
    faults: Vec<Timed<Wrong>>,
    rng: ChaCha8Rng,
}

impl ControllerFaults {
    pub(super) fn new(faults: Vec<Timed<Wrong>>, rng: ChaCha8Rng) -> Self {
        Self { faults, rng }
    }

    fn on(&self, now: u64) -> impl Iterator<Item = &Timed<Wrong>> {
        self.faults.iter().filter(move |fault| fault.is_on(now))
    }

    /// Factor on the travel time of the servo; `None` if it is stuck.
    #[must_use]
    pub fn servo_slowness(&self, now: u64) -> Option<f64> {
        self.on(now).try_fold(1.0, |slowness, fault| match fault.what {
            Wrong::StuckServo => None,
            Wrong::SlowServo(times) => Some(slowness * times),
            Wrong::Late(_) | Wrong::NoPower => Some(slowness),
        })
    }

    /// Time of the poll that is due at `at`, µs, with its jitter.
    pub fn poll_at(&mut self, now: u64, at: u64) -> u64 {
        let late = |fault: &Timed<Wrong>| match fault.what {
            Wrong::Late(most) if fault.is_on(now) => Some(most),
            _ => None,
        };
        let most: u64 = self.faults.iter().filter_map(late).sum();
        if most == 0 { at } else { at + self.rng.random_range(0..=most) }
    }

    /// When the power returns, µs, if it is off at `now`.
    #[must_use]
    pub fn power_back_at(&self, now: u64) -> Option<u64> {
        let off = self.on(now).filter(|fault| fault.what == Wrong::NoPower);
        off.map(|fault| fault.to).max()
    }
}
