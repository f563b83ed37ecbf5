//! `sonarfix monitor`: shows the telemetry of a robot and records it.

use std::io::{IsTerminal, stderr};
use std::ops::ControlFlow;
use std::path::PathBuf;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use sonarfix_link::Telemetry;

use sonarfix_monitor::port::Port;
use sonarfix_monitor::recording::Recording;
use sonarfix_monitor::{Monitor, Received, view};

use crate::output::check_file;
use crate::signs_of_life;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// Records the inputs of the robot's localizer for `sonarfix replay`. When the robot restarts,
    /// a new log begins, with a number in its name.
    #[arg(long, value_name = "LOG.csv")]
    record: Option<PathBuf>,
    /// Shows what each device of a robot that waits reads, with hints (docs/build-a-robot.md). The sonar turns and pings; the
    /// motors stay off.
    #[arg(long, conflicts_with = "record")]
    signs_of_life: bool,
    /// Ends the signs of life after this time by the robot's clock.
    #[arg(long, requires = "signs_of_life", value_name = "SECONDS")]
    seconds: Option<f64>,
}

/// The connection to a robot.
#[derive(Debug, clap::Args)]
pub struct PortArgs {
    /// A serial port, `tcp:HOST:PORT`, a file of recorded bytes, or `-` for the standard input.
    #[arg(long)]
    port: String,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = 115_200)]
    baud: u32,
}

impl PortArgs {
    /// Opens it.
    pub fn open(&self) -> anyhow::Result<Port> {
        Port::open(&self.port, self.baud)
    }
}

/// Period of the lines without a terminal, µs of the robot's clock.
const EVERY: u64 = 1_000_000;

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if let Some(file) = &args.record {
        check_file("--record", file)?;
    }
    let mut port = args.port.open()?;
    if args.signs_of_life {
        return signs_of_life::execute(&mut port, args.seconds);
    }
    let mut recording = args.record.clone().map(Recording::new);
    let mut monitor = Monitor::default();
    let mut screen = Screen::new()?;
    port.read(|bytes| -> anyhow::Result<ControlFlow<()>> {
        for &byte in bytes {
            let Some(received) = monitor.push(byte) else { continue };
            if let Some(recording) = &mut recording {
                recording.take(&received).context("cannot write the log")?;
            }
            screen.print(&monitor, &received);
        }
        screen.refresh(&monitor);
        Ok(ControlFlow::Continue(()))
    })?;
    screen.end();
    println!("{}", view::page(&monitor));
    if let Some(path) = &args.record {
        match recording.map_or(0, |recording| recording.logs()) {
            0 => eprintln!("nothing was recorded: the robot sent no estimate"),
            1 => eprintln!("recorded {}", path.display()),
            logs => {
                let more = logs - 1;
                eprintln!("recorded {} and {more} more, one for each start", path.display());
            }
        }
    }
    Ok(())
}

/// A page that is redrawn on a terminal; elsewhere periodic lines.
enum Screen {
    Terminal(ProgressBar),
    Lines { next: u64 },
}

impl Screen {
    fn new() -> anyhow::Result<Self> {
        if !stderr().is_terminal() {
            return Ok(Self::Lines { next: 0 });
        }
        let style = ProgressStyle::with_template("{msg}")?;
        Ok(Self::Terminal(ProgressBar::new_spinner().with_style(style)))
    }

    /// Prints a line for a notable message.
    fn print(&mut self, monitor: &Monitor, received: &Received) {
        let Self::Lines { next } = self else { return };
        match &received.telemetry {
            Telemetry::Hello(hello) => println!("{}", view::hello(hello)),
            Telemetry::Initialized(_) | Telemetry::PoseSet(_) => {
                println!("began   {}", view::line(monitor));
                *next = 0;
            }
            Telemetry::Estimate(estimate) if estimate.at.ticks() >= *next => {
                println!("{}", view::line(monitor));
                *next = estimate.at.ticks().saturating_add(EVERY);
            }
            _ => {}
        }
    }

    fn refresh(&self, monitor: &Monitor) {
        if let Self::Terminal(bar) = self {
            bar.set_message(view::page(monitor));
        }
    }

    fn end(&self) {
        if let Self::Terminal(bar) = self {
            bar.finish_and_clear();
        }
    }
}
