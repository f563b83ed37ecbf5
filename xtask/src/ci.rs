//! Runs the steps of CI, also after one has failed, and reports each with its time.

use std::collections::{BTreeMap, VecDeque};
use std::env;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::process::{Command, ExitCode};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use anyhow::ensure;

use crate::cargo;

/// A check.
pub struct Step<T> {
    /// The job that it belongs to.
    pub job: &'static str,
    pub name: &'static str,
    pub task: T,
    /// Whether it runs without being named.
    pub is_short: bool,
}

/// How a step ended.
struct Outcome {
    name: &'static str,
    seconds: u64,
    /// What failed; none if the step passed.
    failure: Option<String>,
}

/// Runs the steps of these names, or of jobs of these names, or the short ones if there is no name, two at a time. The last line
/// that it prints is `N passed, N failed`, with `, N skipped` if parts of checks were skipped.
pub fn run<T: Sync>(
    steps: &[Step<T>],
    names: &[String],
    run: impl Fn(&Step<T>, Output) -> anyhow::Result<()> + Sync,
) -> anyhow::Result<ExitCode> {
    for name in names {
        let is_known = steps.iter().any(|step| step.job == name || step.name == name);
        ensure!(is_known, "there is no job or step {name}");
    }
    fs::create_dir_all(cargo::target_folder())?;
    fs::write(cargo::skipped_file(), "")?;
    let is_chosen = |step: &&Step<T>| {
        let is_named = names.iter().any(|name| step.job == name || step.name == name);
        is_named || (names.is_empty() && step.is_short)
    };
    let chosen: Vec<&Step<T>> = steps.iter().filter(is_chosen).collect();
    let outcomes = outcomes(&chosen, &run);
    if names.is_empty() {
        let others: Vec<&str> = steps.iter().filter(|it| !it.is_short).map(|it| it.name).collect();
        println!("not run: cargo xtask ci {}", others.join(" "));
    }
    let skipped = fs::read_to_string(cargo::skipped_file())?;
    println!("{}", report(&outcomes, &skipped.lines().collect::<Vec<_>>()));
    let has_passed = outcomes.iter().all(|outcome| outcome.failure.is_none());
    Ok(if has_passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Where the output of a step goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// To the terminal, while the step runs.
    AtOnce,
    /// To the terminal in one piece when the step has ended: another step runs beside it.
    AtTheEnd,
}

/// One thread takes steps from the front and one from the back, so that steps of different workspaces run beside each other: each
/// workspace has a target folder, and cargo locks it while it builds. Much of a step has one thread: links, emulators.
fn outcomes<T: Sync>(
    steps: &[&Step<T>],
    run: &(impl Fn(&Step<T>, Output) -> anyhow::Result<()> + Sync),
) -> Vec<Outcome> {
    if let [step] = steps {
        return vec![outcome(step, |step| run(step, Output::AtOnce))];
    }
    let left: Mutex<VecDeque<_>> = Mutex::new(steps.iter().enumerate().collect());
    let next = |is_front| {
        let mut left = locked(&left);
        if is_front { left.pop_front() } else { left.pop_back() }
    };
    let ended = Mutex::new(BTreeMap::new());
    let worker = |is_front| {
        while let Some((number, step)) = next(is_front) {
            let outcome = outcome(step, |step| run(step, Output::AtTheEnd));
            locked(&ended).insert(number, outcome);
        }
    };
    thread::scope(|scope| {
        scope.spawn(|| worker(true));
        worker(false);
    });
    ended.into_inner().unwrap_or_else(PoisonError::into_inner).into_values().collect()
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs a step as a process of its own (`cargo xtask step`).
pub fn run_in_a_process<T>(step: &Step<T>, output: Output) -> anyhow::Result<()> {
    let mut process = Command::new(env::current_exe()?);
    process.args(["step", step.name]);
    if output == Output::AtOnce {
        let status = process.status()?;
        ensure!(status.success(), "see its output");
        return Ok(());
    }
    let path = cargo::target_folder().join(format!("{}.log", step.name));
    let log = File::create(&path)?;
    let status = process.stdout(log.try_clone()?).stderr(log).status()?;
    let log = fs::read(&path)?;
    let text = String::from_utf8_lossy(&log);
    eprintln!("══ output of {}\n{text}", step.name);
    let error = text.lines().rev().find_map(|line| line.strip_prefix("error: "));
    ensure!(status.success(), "{}", error.unwrap_or("see its output"));
    Ok(())
}

/// Reports that a check, or a part of it, is skipped.
pub fn skip(why: &str) {
    eprintln!("SKIPPED: {why}");
    let file = fs::OpenOptions::new().append(true).create(true).open(cargo::skipped_file());
    // The message above remains if the file cannot be written.
    let _ = file
        .and_then(|mut file| std::io::Write::write_all(&mut file, format!("{why}\n").as_bytes()));
}

fn outcome<T>(step: &Step<T>, run: impl Fn(&Step<T>) -> anyhow::Result<()>) -> Outcome {
    let name = step.name;
    eprintln!("══ {name}");
    let start = Instant::now();
    let failure = run(step).err().map(|error| format!("{error:#}"));
    let seconds = start.elapsed().as_secs();
    eprintln!("══ {name}: {} after {seconds} s", word(failure.as_ref()));
    Outcome { name, seconds, failure }
}

fn word(failure: Option<&String>) -> &'static str {
    if failure.is_some() { "failed" } else { "passed" }
}

/// A line for each step, then each failure, then what was skipped, then the counts.
fn report(outcomes: &[Outcome], skipped: &[&str]) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    for Outcome { name, seconds, failure } in outcomes {
        let _ = writeln!(text, "{} {seconds:>5} s  {name}", word(failure.as_ref()));
    }
    let total: u64 = outcomes.iter().map(|outcome| outcome.seconds).sum();
    let _ = writeln!(text, "total  {total:>5} s");
    let mut failed = 0;
    for (name, failure) in outcomes.iter().filter_map(|it| Some((it.name, it.failure.as_ref()?))) {
        failed += 1;
        let _ = writeln!(text, "FAILED {name}: {failure}");
    }
    for (number, why) in (1..).zip(skipped) {
        let _ = writeln!(text, "SKIPPED {number} of {}: {why}", skipped.len());
    }
    let _ = write!(text, "{} passed, {failed} failed", outcomes.len() - failed);
    if !skipped.is_empty() {
        let _ = write!(text, ", {} skipped", skipped.len());
    }
    text
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn steps() -> Vec<Step<u32>> {
        [("one", "a", 1), ("one", "b", 2), ("two", "c", 3), ("two", "d", 4)]
            .map(|(job, name, task)| Step { job, name, task, is_short: name != "d" })
            .into()
    }

    /// The tasks that run for these names, in order, of which the second fails.
    fn ran(names: &[&str]) -> (Vec<u32>, String) {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        let seen = Mutex::new(Vec::new());
        let code = run(&steps(), &names, |step, _| {
            locked(&seen).push(step.task);
            ensure!(step.task != 2, "broken");
            Ok(())
        });
        let mut seen = locked(&seen).clone();
        seen.sort_unstable();
        (seen, format!("{:?}", code.unwrap()))
    }

    /// Two steps that wait for each other both pass.
    #[test]
    fn two_steps_run_beside_each_other() {
        let both = std::sync::Barrier::new(2);
        let chosen = ["a", "c"].map(str::to_owned);
        let wait = |_: &Step<u32>, output| {
            both.wait();
            ensure!(output == Output::AtTheEnd);
            Ok(())
        };
        assert_eq!(
            format!("{:?}", run(&steps(), &chosen, wait).unwrap()),
            format!("{:?}", ExitCode::SUCCESS)
        );
    }

    #[test]
    fn jobs_and_steps_run_by_name_and_after_a_failure() {
        let [passed, failed] = [ExitCode::SUCCESS, ExitCode::FAILURE].map(|it| format!("{it:?}"));
        assert_eq!(ran(&[]), (vec![1, 2, 3], failed.clone()));
        assert_eq!(ran(&["one"]), (vec![1, 2], failed));
        assert_eq!(ran(&["two", "a"]), (vec![1, 3, 4], passed));
        assert!(run(&steps(), &["three".to_owned()], |_, _| Ok(())).is_err());
    }

    #[test]
    fn the_last_line_counts_the_steps() {
        let outcomes = [
            Outcome { name: "lint", seconds: 7, failure: None },
            Outcome { name: "docs", seconds: 12, failure: Some("`cargo doc` failed".to_owned()) },
        ];
        let steps = "passed     7 s  lint\nfailed    12 s  docs\ntotal     19 s\n\
             FAILED docs: `cargo doc` failed\n";
        assert_eq!(report(&outcomes, &[]), format!("{steps}1 passed, 1 failed"));
        assert_eq!(
            report(&outcomes, &["no browser", "no data"]),
            format!(
                "{steps}SKIPPED 1 of 2: no browser\nSKIPPED 2 of 2: no data\n\
                 1 passed, 1 failed, 2 skipped"
            )
        );
    }

    /// A name that is no step would leave one out without a word.
    #[test]
    fn every_short_name_is_a_step() {
        let short = crate::steps().iter().filter(|step| step.is_short).count();
        assert_eq!(short, crate::SHORT.len());
    }

    /// The workflow runs every job.
    #[test]
    fn the_workflow_has_all_jobs() {
        let workflow = fs::read_to_string(cargo::root().join(".github/workflows/ci.yml")).unwrap();
        let line = workflow.lines().find(|line| line.trim_start().starts_with("job: [")).unwrap();
        let jobs: BTreeSet<&str> = line.split(['[', ']']).nth(1).unwrap().split(", ").collect();
        let expected = crate::steps().iter().map(|step| step.job).collect();
        assert_eq!(jobs, expected);
    }
}
