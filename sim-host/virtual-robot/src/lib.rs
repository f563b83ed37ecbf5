//! A robot without a robot: the shipped application on simulated hardware, behind a pseudo-terminal or a socket.
//!
//! ```text
//!   sonarfix monitor, command, live page ◀── bytes ──▶ Ports ──▶ App ──▶ drivers ──▶ simulated hardware
//!                                                               motion ─────────────▶ wheels
//! ```
//!
//! - [`robot`]: the robot, whose time is an argument;
//! - [`ports`]: what its link is connected to;
//! - this file: the clock.

pub mod ports;
pub mod robot;

use std::thread;
use std::time::{Duration, Instant};

use crate::ports::Ports;
use crate::robot::VirtualRobot;

/// Time between two steps: that in which a UART at 115,200 baud receives 23 bytes.
const STEP: Duration = Duration::from_millis(2);
/// A longer time between two steps passes without the robot: a process that was halted does not make up for it.
const LONGEST_STEP: Duration = Duration::from_millis(100);

/// Runs the robot by the clock of this computer, `speed` times as fast, until this time of the robot, µs, or until `is_over`.
///
/// # Errors
/// If a port fails.
pub fn run(
    robot: &mut VirtualRobot,
    ports: &mut Ports,
    speed: f64,
    until: u64,
    mut is_over: impl FnMut() -> bool,
) -> anyhow::Result<()> {
    let mut time = sonarfix_sim::time::seconds(robot.now());
    let mut stepped = Instant::now();
    while robot.now() < until && !is_over() {
        let now = Instant::now();
        time += speed * now.saturating_duration_since(stepped).min(LONGEST_STEP).as_secs_f64();
        stepped = now;
        robot.receive(&ports.receive()?);
        robot.run_to(sonarfix_sim::time::micros(time).min(until));
        ports.send(&robot.take_sent());
        thread::sleep(STEP);
    }
    Ok(())
}
