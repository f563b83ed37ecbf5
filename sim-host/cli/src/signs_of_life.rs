//! `sonarfix monitor --signs-of-life`: what each device of a robot on the bench reads, with hints.

use std::io::{IsTerminal, stderr};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use sonarfix_link::{Command, CommandResult};
use sonarfix_monitor::port::Port;
use sonarfix_monitor::request;
use sonarfix_sim::text::wrapped;
use sonarfix_telemetry::Monitor;
use sonarfix_telemetry::signs::hints::Hint;
use sonarfix_telemetry::signs::{Row, Signs};
use sonarfix_terminal::output::width;

/// The robot shows its devices for a minute; it is asked again in time.
const ASK_AGAIN: Duration = Duration::from_secs(30);

/// Shows the devices until the port ends, or for this time by the robot's clock.
pub fn execute(port: &mut Port, seconds: Option<f64>) -> anyhow::Result<()> {
    let mut watch = Watch::default();
    let mut screen = Screen::new()?;
    let is_over = |watch: &Watch| seconds.is_some_and(|most| watch.seconds() >= most);
    loop {
        if port.can_send() {
            ask(port, &mut watch)?;
        }
        let asked = Instant::now();
        watch.is_restarted = false;
        let end = port.read(|bytes| {
            for &byte in bytes {
                if watch.take(byte) {
                    screen.show(&watch.rows());
                }
            }
            let is_due = watch.is_restarted || asked.elapsed() > ASK_AGAIN;
            let ends = is_due || is_over(&watch);
            Ok(if ends { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
        })?;
        if end.is_none() || is_over(&watch) {
            break;
        }
    }
    screen.end();
    for row in watch.rows() {
        println!("{row}");
    }
    Ok(())
}

fn ask(port: &mut Port, watch: &mut Watch) -> anyhow::Result<()> {
    let answer = request::ask_and_watch(port, &Command::ShowDevices, |byte| {
        watch.take(byte);
    })
    .context(
        "TX and RX swapped, no common ground, another program at the port, or no program in flash?",
    )?;
    if let CommandResult::Refused(reason) = answer {
        anyhow::bail!("the robot refuses: {reason}");
    }
    Ok(())
}

/// What has been received.
#[derive(Default)]
struct Watch {
    monitor: Monitor,
    signs: Signs,
    /// The first time of the robot's present run.
    began: Option<u64>,
    /// The time of the runs before it, µs.
    before: u64,
    /// Whether the robot has been restarted, and has to be asked again.
    is_restarted: bool,
}

impl Watch {
    /// Takes a byte; returns whether it has completed a message.
    fn take(&mut self, byte: u8) -> bool {
        let Some(received) = self.monitor.push(byte) else { return false };
        let before = self.elapsed();
        if self.signs.take(&received) {
            (self.before, self.began, self.is_restarted) = (before, None, true);
        }
        self.began = self.began.or(self.now());
        true
    }

    fn now(&self) -> Option<u64> {
        self.signs.time().map(|at| at.ticks())
    }

    /// The time of all runs, µs.
    fn elapsed(&self) -> u64 {
        let run = self.now().zip(self.began).map_or(0, |(now, began)| now.saturating_sub(began));
        self.before + run
    }

    #[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs, 285 years")]
    fn seconds(&self) -> f64 {
        self.elapsed() as f64 * 1e-6
    }

    fn rows(&self) -> [Row; 6] {
        self.signs.rows(&self.monitor.counters())
    }
}

/// The rows, redrawn on a terminal; elsewhere a line whenever a hint changes.
enum Screen {
    Terminal(ProgressBar),
    Lines([Option<Hint>; 6]),
}

impl Screen {
    fn new() -> anyhow::Result<Self> {
        if !stderr().is_terminal() {
            return Ok(Self::Lines([None; 6]));
        }
        let style = ProgressStyle::with_template("{msg}")?;
        Ok(Self::Terminal(ProgressBar::new_spinner().with_style(style)))
    }

    fn show(&mut self, rows: &[Row; 6]) {
        match self {
            Self::Terminal(bar) => {
                // The bar cuts a line that is longer than the terminal.
                let wrap = |row: &Row| wrapped(&row.to_string(), width(), 15);
                let lines: Vec<_> = rows.iter().flat_map(wrap).collect();
                bar.set_message(lines.join("\n"));
            }
            Self::Lines(shown) => {
                for (row, shown) in rows.iter().zip(shown) {
                    if *shown != Some(row.hint) {
                        println!("{row}");
                        *shown = Some(row.hint);
                    }
                }
            }
        }
    }

    fn end(&self) {
        match self {
            Self::Terminal(bar) => bar.finish_and_clear(),
            Self::Lines(_) => println!(""),
        }
    }
}
