//! How far a run has come: a bar on a terminal, a line now and then elsewhere.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressStyle};
use sonarfix::units::Instant;

/// How far it is.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    /// Simulated seconds of all.
    length: u64,
    /// Tenths that were told, where there is no terminal.
    told: Option<u64>,
}

impl Progress {
    /// Of so many simulated seconds; of zero nothing is told where there is no terminal.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the cast saturates; a run lasts hours at most"
    )]
    pub fn of(seconds: f64) -> Self {
        let length = seconds.round() as u64;
        let bar = ProgressBar::new(length);
        let style = ProgressStyle::with_template("{bar:40} {pos} of {len} s, {eta} left");
        let bar = style.map_or_else(|_| bar.clone(), |style| bar.clone().with_style(style));
        let told = (!std::io::stderr().is_terminal()).then_some(0);
        Self { bar, length, told }
    }

    /// It has come to this simulated time.
    pub fn reach(&mut self, at: Instant) {
        let seconds = at.ticks() / 1_000_000;
        if seconds == self.bar.position() {
            return;
        }
        self.bar.set_position(seconds);
        if let Some(told) = &mut self.told
            && let Some(tenth) = (10 * seconds).checked_div(self.length)
            && tenth > *told
        {
            *told = tenth;
            eprintln!("{seconds} of {} s", self.length);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
