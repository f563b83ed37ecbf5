//! What becomes of a robot while its hardware fails, and after: the scenario `classroom` with one
//! fault at a time, as a page of the documentation.

use std::fmt::Write;

use rayon::prelude::*;
use sonarfix_hal::robot::Faults;
use sonarfix_map::{CLASSROOM, Fault, FaultKind, FileError, Scenario, Wheel};

use crate::simulate::{Simulation, SimulationError};
use crate::statistics::RunResult;

/// When the fault begins: after two laps, when the robot knows its wheels.
const FROM: f64 = 200.0;
/// When it ends: five minutes remain to recover.
const TO: f64 = 230.0;

/// Every fault there is, in words.
const CASES: [(&str, FaultKind); 11] = [
    ("half of the echoes lost", FaultKind::LostEchoes(0.5)),
    ("all echoes lost", FaultKind::LostEchoes(1.0)),
    ("cross-talk in half of the pings", FaultKind::CrossTalk(0.5)),
    ("echo line stuck high", FaultKind::StuckEcho),
    ("an encoder channel dead", FaultKind::DeadEncoder(Wheel::Right)),
    ("an encoder's channels swapped", FaultKind::ReversedEncoder(Wheel::Right)),
    ("a tenth of an encoder's edges missed", FaultKind::MissingTicks(Wheel::Right, 0.1)),
    ("servo stuck", FaultKind::StuckServo),
    ("servo three times as slow", FaultKind::SlowServo(3.0)),
    ("polls up to 50 ms late", FaultKind::ClockJitter(0.05)),
    ("brown-out and restart", FaultKind::BrownOut),
];

const HEAD: &str = "\
# What faults do
Written by `sonarfix faults`; change the code, not this page.

The scenario `classroom` (a cheap robot that steers by its own estimate) with one fault at a time, from 200 s to 230 s of
616 s. *Reported* is what the loop counted, a run on average. *Outside* is the share of the run in which the position error
left the filter's own claim (its 99.9 % ellipse); *silently* the longest stretch of that, over all runs, in which health
still said `Tracking`. *Recovered*: at the end of the run the error is inside the claim, and health does not say `Lost`.

";

/// One row: a fault, and what became of the runs with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The fault, in words.
    pub name: &'static str,
    /// Each run.
    pub results: Vec<RunResult>,
}

/// What can keep the table from being made.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The scenario.
    #[error(transparent)]
    Scenario(#[from] FileError),
    /// A run.
    #[error(transparent)]
    Run(#[from] SimulationError),
}

/// Runs every fault with the seeds 0 to `runs` − 1, and once none.
///
/// # Errors
/// [`TableError`], of the first run that could not go on.
pub fn rows(runs: u64) -> Result<Vec<Row>, TableError> {
    let none = std::iter::once(("none", None));
    let cases = none.chain(CASES.iter().map(|&(name, kind)| (name, Some(kind))));
    cases.map(|(name, kind)| Ok(Row { name, results: results(kind, runs)? })).collect()
}

fn results(kind: Option<FaultKind>, runs: u64) -> Result<Vec<RunResult>, TableError> {
    let mut scenario = Scenario::parse(CLASSROOM, "classroom.toml", std::path::Path::new(""))?;
    scenario.faults = kind.map(|kind| Fault { kind, from: FROM, to: TO }).into_iter().collect();
    let simulation = Simulation::new(scenario);
    let results = (0..runs).into_par_iter().map(|seed| simulation.run(seed, &mut ()));
    Ok(results.collect::<Result<_, _>>()?)
}

/// A counter of the loop, with its name.
type Counter = (&'static str, fn(&Faults) -> u32);

impl Row {
    /// How many runs ended inside the filter's claim, with health not giving them up.
    #[must_use]
    pub fn recovered(&self) -> usize {
        self.results.iter().filter(|result| result.claim.holds_at_the_end()).count()
    }

    /// The longest stretch, in seconds, of any run in which the error was outside the claim and
    /// health said nothing.
    #[must_use]
    pub fn longest_silence(&self) -> f64 {
        let longest = self.results.iter().map(|result| result.claim.longest_silence());
        longest.fold(0.0, f64::max)
    }

    fn outside(&self) -> f64 {
        self.mean(|result| result.claim.share_outside())
    }

    fn worst(&self) -> f64 {
        self.results.iter().map(|result| result.claim.worst()).fold(0.0, f64::max)
    }

    #[expect(clippy::cast_precision_loss, reason = "some hundred runs")]
    fn mean(&self, of: impl Fn(&RunResult) -> f64) -> f64 {
        self.results.iter().map(of).sum::<f64>() / self.results.len() as f64
    }

    /// The counters of the loop that are not zero, in words.
    #[must_use]
    pub fn reported(&self) -> String {
        let counters: [Counter; 7] = [
            ("ranger", |f| f.ranger),
            ("servo", |f| f.servo),
            ("illegal edges", |f| f.right.illegal + f.left.illegal),
            ("encoder errors", |f| f.right.errors + f.left.errors),
            ("travel", |f| f.travel),
            ("deadlines", |f| f.deadlines),
            ("clock", |f| f.clock),
        ];
        let text = |(name, count): &Counter| {
            let mean = self.mean(|result| f64::from(count(&result.faults)));
            (mean > 0.0).then(|| format!("{name} {mean:.1}"))
        };
        let words: Vec<String> = counters.iter().filter_map(text).collect();
        if words.is_empty() { "–".to_owned() } else { words.join(", ") }
    }
}

/// The page.
#[must_use]
pub fn markdown(rows: &[Row]) -> String {
    let mut page = HEAD.to_owned();
    page.push_str(
        "| fault | runs | reported | worst error, mm | outside | silently, s | recovered |\n",
    );
    page.push_str("|---|---|---|---|---|---|---|\n");
    for row in rows {
        // Writing to a String cannot fail.
        let _ = writeln!(
            page,
            "| {} | {} | {} | {:.0} | {:.1} % | {:.1} | {} |",
            row.name,
            row.results.len(),
            row.reported(),
            1e3 * row.worst(),
            100.0 * row.outside(),
            row.longest_silence(),
            row.recovered(),
        );
    }
    page
}
