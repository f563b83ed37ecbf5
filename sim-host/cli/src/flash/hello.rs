//! The first `Hello` of a flashed robot, compared with what was flashed.

use std::ops::ControlFlow;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::bail;
use indicatif::{ProgressBar, ProgressStyle};
use sonarfix_link::message::ImageStatus;
use sonarfix_link::{Hello, Telemetry};
use sonarfix_monitor::port::Port;
use sonarfix_telemetry::{Monitor, view};
use sonarfix_terminal::progress;

/// Time between two attempts to open a port: that of a board is missing while the board restarts.
const AGAIN: Duration = Duration::from_millis(200);

/// The port of the robot's link.
#[derive(Debug, Clone, Copy)]
pub struct Link<'a> {
    /// Its name, as [`Port::open`] takes it.
    pub name: &'a str,
    /// The baud rate of a serial port.
    pub baud: u32,
}

/// The checksums of what was flashed.
#[derive(Debug, Clone, Copy)]
pub struct Flashed {
    pub configuration: u32,
    pub map: u32,
}

/// Waits for `Hello` and prints whether the robot has what was flashed from its folder. Without a handler of Ctrl-C, which
/// therefore ends the command at once.
pub fn check(link: Link, timeout: Duration, flashed: Flashed, robot: &Path) -> anyhow::Result<()> {
    let name = link.name;
    println!("waiting for Hello at {name}, {} s at most; Ctrl-C ends it", timeout.as_secs());
    let Some(hello) = Wait::new(timeout)?.hello(link)? else {
        bail!(
            "no Hello at {name} within {} s: is this the port of the robot's link and not of its USB drive, are TX and RX crossed, \
             and is no other program at the port? A board that still shows its drive has not taken the file: it is for another board",
            timeout.as_secs()
        );
    };
    println!("{}", view::hello(&hello));
    let differences = differences(&hello, flashed, name, robot);
    if differences.is_empty() {
        println!("the robot has this configuration and this map");
        return Ok(());
    }
    bail!("{}", differences.join("\n"))
}

/// A wait with a timeout.
struct Wait {
    began: Instant,
    timeout: Duration,
    bar: ProgressBar,
}

impl Wait {
    fn new(timeout: Duration) -> anyhow::Result<Self> {
        let style = ProgressStyle::with_template("{bar:40} {pos}/{len} s {msg}")?;
        let bar = progress::bar(Some(timeout.as_secs())).with_style(style);
        Ok(Self { began: Instant::now(), timeout, bar })
    }

    fn is_over(&self) -> bool {
        let elapsed = self.began.elapsed();
        self.bar.set_position(elapsed.as_secs());
        elapsed >= self.timeout
    }

    /// The first `Hello` at a port; `None` after the timeout. A port that is absent or was closed is opened again.
    ///
    /// # Errors
    /// Why the port could not be opened at the end.
    fn hello(self, link: Link) -> anyhow::Result<Option<Hello>> {
        let mut hello = None;
        let mut opened = Ok(());
        while hello.is_none() && !self.is_over() {
            match Port::open(link.name, link.baud) {
                Ok(mut port) => {
                    opened = Ok(());
                    hello = self.read(&mut port);
                }
                Err(error) => {
                    self.bar.set_message("the port cannot be opened yet");
                    opened = Err(error);
                }
            }
            if hello.is_none() {
                thread::sleep(AGAIN);
            }
        }
        self.bar.finish_and_clear();
        opened.map(|()| hello)
    }

    /// The first `Hello` until the port is closed or the time is over.
    fn read(&self, port: &mut Port) -> Option<Hello> {
        self.bar.set_message("");
        let mut monitor = Monitor::default();
        let read = port.read(|bytes| {
            let hello = bytes.iter().find_map(|&byte| match monitor.push(byte)?.telemetry {
                Telemetry::Hello(hello) => Some(hello),
                _ => None,
            });
            let is_last = hello.is_some() || self.is_over();
            Ok(if is_last { ControlFlow::Break(hello) } else { ControlFlow::Continue(()) })
        });
        // A port that fails is opened again, like one that is closed.
        read.ok().flatten().flatten()
    }
}

/// What the robot has otherwise than it was flashed, each with what to do.
fn differences(hello: &Hello, flashed: Flashed, port: &str, robot: &Path) -> Vec<String> {
    let send = format!(
        "a configuration that was sent to the robot outlasts flashing: send this one by `sonarfix command --port {port} \
         set-configuration {}`; else check that this is the port of the flashed board, and flash it again",
        robot.join("robot.toml").display()
    );
    let again = "check that this is the port of the flashed board, and flash it again";
    let parts = [
        ("configuration", hello.configuration, flashed.configuration, send.as_str()),
        ("map", hello.map, flashed.map, again),
    ];
    let difference = |(what, found, expected, other): (&str, ImageStatus, u32, &str)| {
        let remedy = match found {
            ImageStatus::Valid(sum) if sum == expected => return None,
            ImageStatus::Valid(_) => other,
            ImageStatus::Version(_) => {
                "program and command are of different releases: flash the program of this release"
            }
            ImageStatus::Missing | ImageStatus::Corrupt => again,
        };
        let found = view::flashed(found);
        Some(format!("the robot's {what} is {found}, not {expected:08x} as flashed: {remedy}"))
    };
    parts.into_iter().filter_map(difference).collect()
}
