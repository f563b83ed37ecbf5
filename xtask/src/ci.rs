//! Runs all steps of CI, also after one has failed, and reports each with its time.

use std::process::ExitCode;
use std::time::Instant;

/// How a step ended.
struct Outcome {
    name: &'static str,
    seconds: u64,
    /// What failed; none if the step passed.
    failure: Option<String>,
}

/// Runs the steps in order. The last line that it prints is `N passed, N failed`.
pub fn run<S>(steps: &[(&'static str, S)], run: impl Fn(&S) -> anyhow::Result<()>) -> ExitCode {
    let outcomes: Vec<Outcome> = steps
        .iter()
        .map(|(name, step)| {
            eprintln!("══ {name}");
            let start = Instant::now();
            let failure = run(step).err().map(|error| format!("{error:#}"));
            let seconds = start.elapsed().as_secs();
            let word = if failure.is_some() { "failed" } else { "passed" };
            eprintln!("══ {name}: {word} after {seconds} s");
            Outcome { name, seconds, failure }
        })
        .collect();
    println!("{}", report(&outcomes));
    if outcomes.iter().all(|outcome| outcome.failure.is_none()) {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// A line for each step, then each failure, then the counts.
fn report(outcomes: &[Outcome]) -> String {
    let mut lines = Vec::new();
    for Outcome { name, seconds, failure } in outcomes {
        let word = if failure.is_some() { "failed" } else { "passed" };
        lines.push(format!("{word} {seconds:>5} s  {name}"));
    }
    let failures: Vec<String> = outcomes
        .iter()
        .filter_map(|outcome| Some(format!("{}: {}", outcome.name, outcome.failure.as_ref()?)))
        .collect();
    let total: u64 = outcomes.iter().map(|outcome| outcome.seconds).sum();
    lines.push(format!("total  {total:>5} s"));
    lines.extend_from_slice(&failures);
    lines.push(format!("{} passed, {} failed", outcomes.len() - failures.len(), failures.len()));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    #[test]
    fn every_step_runs_after_a_failure() {
        let seen = RefCell::new(Vec::new());
        let steps = [("a", 1), ("b", 2), ("c", 3)];
        let code = run(&steps, |&step| {
            seen.borrow_mut().push(step);
            anyhow::ensure!(step != 2, "broken");
            Ok(())
        });
        assert_eq!(seen.into_inner(), [1, 2, 3]);
        assert_eq!(format!("{code:?}"), format!("{:?}", ExitCode::FAILURE));
        assert_eq!(format!("{:?}", run(&steps, |_| Ok(()))), format!("{:?}", ExitCode::SUCCESS));
    }

    #[test]
    fn the_last_line_counts_the_steps() {
        let outcomes = [
            Outcome { name: "lint", seconds: 7, failure: None },
            Outcome { name: "docs", seconds: 12, failure: Some("`cargo doc` failed".to_owned()) },
        ];
        assert_eq!(
            report(&outcomes),
            "passed     7 s  lint\nfailed    12 s  docs\ntotal     19 s\n\
             docs: `cargo doc` failed\n1 passed, 1 failed"
        );
    }
}
