//! The ledger of turns: what the gyro has measured, and how much of it the localizer has taken.

use sonarfix::geometry::units::Instant;
use sonarfix::sensor::gyro::{GyroParameters, MeasuredTurn, TurnIntegral, TurnReading};

use super::Hardware;
use super::poll::Poll;
use super::schedule::Schedule;

/// The ledger of a robot with a gyro.
#[derive(Debug, Clone, Copy)]
pub(super) struct YawLedger {
    integral: TurnIntegral,
    samples: Schedule,
    /// The reading up to which the localizer has taken the turn.
    taken: TurnReading,
}

impl YawLedger {
    /// A ledger that starts at `now`.
    pub fn new(parameters: &GyroParameters, now: Instant) -> Self {
        let integral = TurnIntegral::new(parameters);
        let samples = Schedule::new(now, parameters.period);
        Self { integral, samples, taken: integral.reading(now) }
    }

    /// The time of the next sample.
    pub fn next(&self) -> Instant {
        self.samples.next()
    }

    /// Takes a sample if one is due. A fault is counted; the integral states what it interrupts.
    pub fn sample(&mut self, poll: &mut Poll<'_, '_, impl Hardware>) {
        if self.samples.take(poll.now).is_none() {
            return;
        }
        poll.has_read_gyro = true;
        let is_faulty = if let Some(Ok(rate)) = poll.hardware.yaw_rate() {
            self.integral.sample(poll.now, rate).is_err()
        } else {
            self.integral.unreadable();
            true
        };
        let faults = &mut poll.faults;
        faults.gyro = faults.gyro.saturating_add(u32::from(is_faulty));
    }

    /// The reading at `now`.
    pub fn reading(&self, now: Instant) -> TurnReading {
        self.integral.reading(now)
    }

    /// The turn up to a reading that the localizer has not taken.
    pub fn turn_to(&self, reading: &TurnReading) -> Option<MeasuredTurn> {
        reading.since(&self.taken)
    }

    /// Records that the localizer has taken the turn up to this reading. That of a discarded step is part of the next one.
    pub fn settle(&mut self, reading: TurnReading) {
        self.taken = reading;
    }
}
