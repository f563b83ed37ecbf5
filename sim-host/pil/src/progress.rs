//! Progress of a run: a bar on a terminal, occasional lines elsewhere.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressStyle};
use sonarfix::geometry::units::Instant;
use sonarfix_terminal::progress::bar;

/// Progress of a run.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    /// Length of the run, simulated seconds.
    length: u64,
    /// Printed tenths of the run, without a terminal.
    printed: Option<u64>,
}

impl Progress {
    /// Progress of a run with a length in simulated seconds. With a length of zero nothing is
    /// printed without a terminal.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the cast saturates; a run lasts hours at most"
    )]
    pub fn of(seconds: f64) -> Self {
        let length = seconds.round() as u64;
        let bar = bar(Some(length));
        let style = ProgressStyle::with_template("{bar:40} {pos} of {len} s, {eta} left");
        let bar = style.map_or_else(|_| bar.clone(), |style| bar.clone().with_style(style));
        let printed = (!std::io::stderr().is_terminal()).then_some(0);
        Self { bar, length, printed }
    }

    /// Advances to a simulated time.
    pub fn reach(&mut self, at: Instant) {
        let seconds = at.ticks() / 1_000_000;
        if seconds == self.bar.position() {
            return;
        }
        self.bar.set_position(seconds);
        if let Some(printed) = &mut self.printed
            && let Some(tenth) = (10 * seconds).checked_div(self.length)
            && tenth > *printed
        {
            *printed = tenth;
            sonarfix_terminal::eprintln!("{seconds} of {} s", self.length);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
