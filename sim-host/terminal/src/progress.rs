//! A progress bar on a terminal, and the end of many runs by Ctrl-C.

use std::process::ExitCode;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sonarfix_sim::progress::Progress;

use crate::output;

/// Exit code after Ctrl-C, as of a shell: 128 + the number of SIGINT.
const INTERRUPTED: u8 = 130;
/// How long runs that have begun may take after Ctrl-C: with the end of the program less than a second.
const LAST_RUNS: Duration = Duration::from_millis(800);

static IS_INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// Whether there are [`Runs`] that have not ended.
static IS_RUNNING: AtomicBool = AtomicBool::new(false);
static HANDLER: Once = Once::new();

/// A progress bar, which is hidden if standard error is not a terminal. After Ctrl-C no further run is started, and the results
/// are those of the finished ones. Runs that take longer than a second are not waited for: then there are no results,
/// because those of the shorter runs alone would be biased.
#[derive(Debug)]
pub struct Runs {
    bar: ProgressBar,
    /// What one finished run counts.
    weight: u64,
}

impl Runs {
    /// A bar for this number of runs.
    #[must_use]
    pub fn new(runs: u32) -> Self {
        Self::weighted(runs, 1)
    }

    /// A bar for results that take several runs each.
    #[must_use]
    pub fn weighted(runs: u32, weight: u64) -> Self {
        catch_interrupt();
        IS_RUNNING.store(true, Ordering::Relaxed);
        let bar = bar(Some(runs.into()));
        let bar = match ProgressStyle::with_template("{bar:40} {pos}/{len} runs, {eta} left") {
            Ok(style) => bar.with_style(style),
            Err(_) => bar,
        };
        Self { bar, weight }
    }

    /// Removes the bar; reports an interruption.
    ///
    /// # Errors
    /// If it was interrupted before the first run was finished.
    pub fn end(self) -> anyhow::Result<()> {
        IS_RUNNING.store(false, Ordering::Relaxed);
        let (finished, all) = (self.bar.position(), self.bar.length().unwrap_or(0));
        self.bar.finish_and_clear();
        if is_interrupted() {
            anyhow::ensure!(finished > 0, "interrupted before the first run was finished");
            output::report_error(format_args!(
                "interrupted: the results are those of {finished} of {all} runs"
            ));
        }
        Ok(())
    }
}

/// A bar of this length, or one of unknown length. It is hidden if the command is quiet, and by indicatif itself where
/// standard error is not a terminal.
#[must_use]
pub fn bar(length: Option<u64>) -> ProgressBar {
    let is_shown = output::is_shown(output::Detail::Usual);
    let target = if is_shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    ProgressBar::with_draw_target(length, target)
}

impl Progress for Runs {
    fn finished(&self) {
        self.bar.inc(self.weight);
    }

    fn is_interrupted(&self) -> bool {
        is_interrupted()
    }
}

/// From now on the first Ctrl-C sets [`is_interrupted`], and a second one ends the command at once.
pub fn catch_interrupt() {
    // Without a handler Ctrl-C ends the command at once.
    HANDLER.call_once(|| drop(ctrlc::set_handler(interrupt)));
}

/// Whether Ctrl-C was pressed.
#[must_use]
pub fn is_interrupted() -> bool {
    IS_INTERRUPTED.load(Ordering::Relaxed)
}

fn interrupt() {
    if IS_INTERRUPTED.swap(true, Ordering::Relaxed) {
        std::process::exit(INTERRUPTED.into());
    }
    thread::spawn(|| {
        thread::sleep(LAST_RUNS);
        if IS_RUNNING.load(Ordering::Relaxed) {
            output::report_error(format_args!(
                "interrupted: a run takes longer than a second, so that there are no results; `run --rows FILE` keeps each \
                 run that has ended"
            ));
            std::process::exit(INTERRUPTED.into());
        }
    });
}

/// The exit code of a command that has succeeded, perhaps with fewer runs than requested.
#[must_use]
pub fn exit_code() -> ExitCode {
    if is_interrupted() { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS }
}

/// The exit code of a command that has failed, perhaps because it was interrupted before it had a result.
#[must_use]
pub fn exit_code_of_error() -> ExitCode {
    if is_interrupted() { ExitCode::from(INTERRUPTED) } else { ExitCode::FAILURE }
}
