//! What a robot says when: one place for firmware, simulator and emulator.

use sonarfix::ekf::State;
use sonarfix::health::Health;
use sonarfix::localizer::Localizer;
use sonarfix::units::Instant;
use sonarfix_hal::robot::{self, Heard, Report, Taken};

use crate::message::{Estimate, Look, Skip, Step, Telemetry};

/// Turns what the loop did into telemetry, in the order in which the localizer was told. What is
/// said is all that it was told: replayed from [`Telemetry::Began`] on, it makes the same
/// estimates bit for bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reporter {
    /// The last step taken, with what was rolled in all.
    last: Step,
}

impl Reporter {
    /// A reporter for a localizer that begins, and what it says of that.
    ///
    /// What the localizer was told is taken from the localizer itself, which gives it back bit for
    /// bit if its calibration starts at zero and both wheels' scale errors are equally uncertain
    /// (it holds them as mean and difference). Otherwise use [`Self::resume`].
    #[must_use]
    pub fn begin(localizer: &Localizer) -> (Self, Telemetry) {
        let Estimate { at, state, deviation, .. } = estimate(localizer);
        Self::resume(at, state, deviation)
    }

    /// A reporter for a localizer that was made by [`Localizer::resume`] of the same arguments,
    /// and what it says of that.
    #[must_use]
    pub fn resume(at: Instant, state: State, deviation: State) -> (Self, Telemetry) {
        let last = Step { at, right_metres: 0.0, left_metres: 0.0 };
        let began = Estimate { at, state, deviation, health: Health::default() };
        (Self { last }, Telemetry::Began(began))
    }

    /// Says what a poll of the loop did, a message at a time; `localizer` is that of the loop,
    /// after the poll.
    pub fn report(
        &mut self,
        report: &Report,
        localizer: &Localizer,
        mut say: impl FnMut(&Telemetry),
    ) {
        if let Some(heard) = &report.heard {
            self.step(heard.step.as_ref(), &mut say);
            self.look(heard, &mut say);
        }
        if let Some(tick) = &report.tick {
            self.step(tick.step.as_ref(), &mut say);
            say(&Telemetry::Estimate(estimate(localizer)));
        }
        if let Some(Err(reason)) = report.aimed {
            say(&Telemetry::Skip(Skip { at: self.last.at, reason }));
        }
    }

    /// The localizer's time, as far as it was reported.
    #[must_use]
    pub fn time(&self) -> Instant {
        self.last.at
    }

    fn step(&mut self, step: Option<&robot::Step>, say: &mut impl FnMut(&Telemetry)) {
        // One that was not taken has changed nothing; it comes again, or is counted as a fault.
        if let Some(step) = step.filter(|step| step.taken == Taken::Yes) {
            self.last = Step {
                at: step.at,
                right_metres: self.last.right_metres + f64::from(step.travel.right.0),
                left_metres: self.last.left_metres + f64::from(step.travel.left.0),
            };
            say(&Telemetry::Step(self.last));
        }
    }

    fn look(&mut self, heard: &Heard, say: &mut impl FnMut(&Telemetry)) {
        // An echo without a reading of the encoders to go with it was told to nobody.
        if let Some(fix) = heard.fix {
            let Heard { aim, outcome, .. } = *heard;
            say(&Telemetry::Look(Look { at: self.last.at, aim, outcome, fix }));
        }
    }
}

/// What the localizer believes.
#[must_use]
pub fn estimate(localizer: &Localizer) -> Estimate {
    let filter = localizer.filter();
    Estimate {
        at: localizer.time(),
        state: filter.state(),
        deviation: filter.deviation(),
        health: localizer.health(),
    }
}
