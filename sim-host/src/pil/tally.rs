//! What the emulator counted.

use serde::Serialize;
use sonarfix_pil::{Answer, Request};

/// Microseconds of an encoder tick's period, over which a load is summed.
const TICK: u64 = 100_000;

/// Instructions of calls of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Cost {
    /// How many calls.
    pub calls: u64,
    /// Instructions of all.
    pub all: u64,
    /// Instructions of the one with most.
    pub most: u64,
}

impl Cost {
    fn add(&mut self, instructions: u64) {
        self.calls += 1;
        self.all += instructions;
        self.most = self.most.max(instructions);
    }

    /// Instructions of a call, on average; none of no call.
    #[must_use]
    pub fn mean(&self) -> Option<u64> {
        self.all.checked_div(self.calls)
    }
}

/// All that was counted.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Tally {
    /// Localizer, a step of the wheels.
    pub predict: Cost,
    /// Localizer, where to look.
    pub aim: Cost,
    /// Localizer, a range.
    pub fix: Cost,
    /// Polls of the loop that did something.
    pub poll: Cost,
    /// Polls of the loop with nothing due.
    pub idle: Cost,
    /// All polls between two encoder ticks.
    pub per_tick: Cost,
    /// Bytes of stack of the deepest call.
    pub stack: u32,
    /// The tick's period that is being summed, and the sum.
    #[serde(skip)]
    now: (u64, u64),
}

impl Tally {
    /// Adds what a request took.
    pub fn add(&mut self, request: &Request, answer: &Answer, instructions: u32) {
        let instructions = u64::from(instructions);
        match (request, answer) {
            (Request::Odometry(..), _) => self.predict.add(instructions),
            (Request::Aim, _) => self.aim.add(instructions),
            (Request::Fix(_), _) => self.fix.add(instructions),
            (Request::Poll(sensors), Answer::Polled { belief, .. }) => {
                let poll = if belief.is_some() { &mut self.poll } else { &mut self.idle };
                poll.add(instructions);
                self.load(sensors.at.ticks() / TICK, instructions);
            }
            _ => {}
        }
    }

    fn load(&mut self, tick: u64, instructions: u64) {
        let (now, sum) = &mut self.now;
        if *now != tick {
            self.per_tick.add(*sum);
            (*now, *sum) = (tick, 0);
        }
        *sum += instructions;
    }

    /// What was counted, by name: whatever was called at all.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, Cost)> {
        let rows = [
            ("predict", self.predict),
            ("aim", self.aim),
            ("fix", self.fix),
            ("poll with work", self.poll),
            ("poll without", self.idle),
            ("all polls of 100 ms", self.per_tick),
        ];
        rows.into_iter().filter(|(_, cost)| cost.calls > 0 && cost.all > 0)
    }
}
