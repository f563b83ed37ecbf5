//! Instruction counts of the emulator.

use serde::Serialize;
use sonarfix_pil::{Answer, Request};

/// Period over which the load is summed, µs: that of an encoder tick.
const TICK: u64 = 100_000;

/// Instruction counts of one kind of call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Cost {
    /// Number of calls.
    pub calls: u64,
    /// Total instructions.
    pub all: u64,
    /// Instructions of the most expensive call.
    pub most: u64,
}

impl Cost {
    fn add(&mut self, instructions: u64) {
        self.calls += 1;
        self.all += instructions;
        self.most = self.most.max(instructions);
    }

    /// Mean instructions per call; `None` without calls.
    #[must_use]
    pub fn mean(&self) -> Option<u64> {
        self.all.checked_div(self.calls)
    }
}

/// All counts.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Tally {
    /// Odometry input of the localizer.
    pub predict: Cost,
    /// Aim of the localizer.
    pub aim: Cost,
    /// Range input of the localizer.
    pub fix: Cost,
    /// The longest poll of each start of a loop.
    pub start: Cost,
    /// Polls of the loop with work.
    pub poll: Cost,
    /// Polls of the loop with nothing due.
    pub idle: Cost,
    /// All polls between two encoder ticks.
    pub per_tick: Cost,
    /// Stack of the deepest call, bytes.
    pub stack: u32,
    /// The current tick period and its sum.
    #[serde(skip)]
    now: (u64, u64),
}

impl Tally {
    /// Adds the instructions of the longest poll of a start.
    pub(crate) fn begun(&mut self, instructions: u32) {
        self.start.add(instructions.into());
    }

    /// Adds the instructions of a request.
    pub fn add(&mut self, request: &Request, answer: &Answer, instructions: u32) {
        let instructions = u64::from(instructions);
        match (request, answer) {
            (Request::Odometry(..), _) => self.predict.add(instructions),
            (Request::Aim, _) => self.aim.add(instructions),
            (Request::Fix(_), _) => self.fix.add(instructions),
            (Request::Poll(sensors), Answer::Polled { snapshot, .. }) => {
                let poll = if snapshot.is_some() { &mut self.poll } else { &mut self.idle };
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

    /// The counts of all calls that occurred, by name.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, Cost)> {
        let rows = [
            ("predict", self.predict),
            ("aim", self.aim),
            ("fix", self.fix),
            ("longest poll of the start", self.start),
            ("poll with work", self.poll),
            ("poll without", self.idle),
            ("all polls of 100 ms", self.per_tick),
        ];
        rows.into_iter().filter(|(_, cost)| cost.calls > 0 && cost.all > 0)
    }
}
