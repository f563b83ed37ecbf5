//! How far the verdict of health can be trusted, as a page of the documentation: how often it says
//! `Lost` of a pose that is not, and how long it takes to say it of one that is.

use std::fmt::Write;

use sonarfix_map::{CLASSROOM, FileError, Scenario};

use crate::kidnapped::{self, Outcome, TrialError, WATCHED};
use crate::monte_carlo;
use crate::simulate::{Simulation, SimulationError};
use crate::statistics::RunResult;

/// What can keep the page from being made.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    /// A scenario.
    #[error(transparent)]
    Scenario(#[from] FileError),
    /// A run.
    #[error(transparent)]
    Run(#[from] SimulationError),
    /// A robot that was carried off.
    #[error(transparent)]
    Trial(#[from] TrialError),
}

/// What the page is made of.
#[derive(Debug)]
pub struct Findings {
    /// Each scenario's name and runs.
    pub scenarios: Vec<(&'static str, Vec<RunResult>)>,
    /// The robots that were carried off.
    pub trials: Vec<Outcome>,
}

/// Runs both scenarios, and as many robots that are carried off, with the seeds 0 to `runs` − 1.
///
/// # Errors
/// [`PageError`], of the first run that could not go on.
pub fn findings(runs: u32) -> Result<Findings, PageError> {
    let classroom = Scenario::parse(CLASSROOM, "classroom.toml", std::path::Path::new(""))?;
    let scenarios = [("paper", Scenario::paper()?), ("classroom", classroom)];
    let conduct =
        |(name, scenario)| Ok((name, monte_carlo::results(&Simulation::new(scenario), 0, runs)?));
    let scenarios = scenarios.into_iter().map(conduct).collect::<Result<_, PageError>>()?;
    Ok(Findings { scenarios, trials: kidnapped::trials(runs.into())? })
}

const HEAD: &str = "\
# How far health can be trusted
Written by `sonarfix health`; change the code, not this page. What the verdict is made of is in
[model.md](model.md#health).

## Of a good pose
Runs of a scenario without faults. *Called lost*: how often the verdict became `Lost`, all runs together. *Falsely*: how often
it became so while the position was inside the filter's own 99.9 % ellipse and the heading off by no more than 0.1 rad.
*Degraded*: share of the time. *Outside*: share of the time with the position outside of that ellipse. *Silently*: the longest
stretch of that, over all runs, in which the verdict still was `Tracking`.

| scenario | runs | called lost | falsely | in runs | degraded | outside | silently, s |
|---|---|---|---|---|---|---|---|
";

/// The page.
#[must_use]
pub fn markdown(findings: &Findings) -> String {
    let mut page = HEAD.to_owned();
    for (name, results) in &findings.scenarios {
        let sum = |of: fn(&RunResult) -> u32| results.iter().map(of).sum::<u32>();
        let mean = |of: fn(&RunResult) -> f64| {
            100.0 * results.iter().map(of).sum::<f64>() / count(results.len())
        };
        let silence = results.iter().map(|result| result.claim.longest_silence());
        // Writing to a String cannot fail.
        let _ = writeln!(
            page,
            "| `{name}` | {} | {} | {} | {} | {:.1} % | {:.2} % | {:.1} |",
            results.len(),
            sum(|result| result.claim.called_lost()),
            sum(|result| result.claim.falsely_lost()),
            sum(|result| u32::from(result.claim.falsely_lost() > 0)),
            mean(|result| result.claim.share_degraded()),
            mean(|result| result.claim.share_outside()),
            silence.fold(0.0, f64::max),
        );
    }
    page.push_str(&kidnapped_section(&findings.trials));
    page
}

fn kidnapped_section(trials: &[Outcome]) -> String {
    let share = |holds: &dyn Fn(&Outcome) -> bool| {
        100.0 * count(trials.iter().filter(|outcome| holds(outcome)).count()) / count(trials.len())
    };
    let within = |fixes: usize| share(&|outcome| outcome.called_after.is_some_and(|n| n <= fixes));
    let [five, ten, fifteen, twenty, thirty] = [5, 10, 15, 20, 30].map(within);
    format!(
        "\n## Of a wrong pose\n\
         A robot in a room of 6 m × 8 m with a partition drives for 10 s, is picked up, and put down 1 m away and turned by 90°;\n\
         {} trials, watched for {WATCHED} fixes. Called `Lost`\n\n\
         | within 5 fixes | 10 | 15 | 20 | 30 | never in {WATCHED} |\n|---|---|---|---|---|---|\n\
         | {five:.1} % | {ten:.1} % | {fifteen:.1} % | {twenty:.1} % | {thirty:.1} % | {:.1} % |\n\n\
         ![How many have said that they are lost, over the fixes since](images/kidnapped.svg)\n\n\
         At the end of the watch {:.1} % have found back to their pose by themselves, and {:.1} % say `Tracking` of a wrong one:\n\
         from there the ranges agree with another place.\n",
        trials.len(),
        share(&|outcome| outcome.called_after.is_none()),
        share(&|outcome| outcome.found_back),
        share(&|outcome| outcome.falsely_sure),
    )
}

#[expect(clippy::cast_precision_loss, reason = "some thousand runs")]
fn count(n: usize) -> f64 {
    n as f64
}
