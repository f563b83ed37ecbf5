//! Faults of the hardware, with their times.

use crate::document::{Node, Table};
use crate::quantity::TIME;

const KEYS: [&str; 7] = ["kind", "from", "to", "wheel", "share", "times", "late"];

/// A wheel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wheel {
    /// The right wheel.
    Right,
    /// The left wheel.
    Left,
}

/// The kind of a fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultKind {
    /// This fraction of the echoes is not detected.
    LostEchoes(f64),
    /// In this fraction of the pings the ping of another robot is detected first.
    CrossTalk(f64),
    /// The echo line stays high.
    StuckEcho,
    /// The sonar does not answer.
    DeadSonar,
    /// Channel A of an encoder is stuck.
    DeadEncoder(Wheel),
    /// The channels of an encoder are swapped.
    ReversedEncoder(Wheel),
    /// This fraction of an encoder's edges is missed.
    MissingTicks(Wheel, f64),
    /// This fraction of the readings of an encoder's counter fail.
    ReadErrors(Wheel, f64),
    /// The servo does not move.
    StuckServo,
    /// The servo is slower by this factor.
    SlowServo(f64),
    /// The loop is polled late, by up to this time in seconds.
    ClockJitter(f64),
    /// The controller loses power and restarts at the stored pose.
    BrownOut,
    /// The gyro repeats its last rate.
    StuckGyro,
    /// The rate of the gyro stays at the end of its range.
    SaturatedGyro,
    /// This fraction of the readings of the gyro are random numbers of its range.
    GarbledGyro(f64),
    /// This fraction of the readings of the gyro fail.
    GyroReadErrors(f64),
}

/// A fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    /// The kind of a fault.
    pub kind: FaultKind,
    /// Start, seconds from the start of the run.
    pub from: f64,
    /// End, seconds from the start of the run.
    pub to: f64,
}

/// Reads `faults`, an optional array of tables.
pub(crate) fn read(root: &Table<'_>) -> Vec<Fault> {
    let items = root.get("faults").map(|list| list.items());
    items.into_iter().flatten().filter_map(fault).collect()
}

/// None if its kind is unknown.
fn fault(node: Node<'_>) -> Option<Fault> {
    let table = node.table(&KEYS);
    let from = table.require("from").deviation(&TIME);
    let to_node = table.require("to");
    let to = to_node.quantity(&TIME);
    let kind = kind(&table)?;
    Some(Fault { kind, from, to: to_node.check(to, to > from, "after `from`") })
}

fn kind(table: &Table<'_>) -> Option<FaultKind> {
    let node = table.require("kind");
    Some(match node.text() {
        "lost_echoes" => FaultKind::LostEchoes(share(table)),
        "cross_talk" => FaultKind::CrossTalk(share(table)),
        "stuck_echo" => FaultKind::StuckEcho,
        "dead_sonar" => FaultKind::DeadSonar,
        "dead_encoder" => FaultKind::DeadEncoder(wheel(table)),
        "reversed_encoder" => FaultKind::ReversedEncoder(wheel(table)),
        "missing_ticks" => FaultKind::MissingTicks(wheel(table), share(table)),
        "read_errors" => FaultKind::ReadErrors(wheel(table), share(table)),
        "stuck_servo" => FaultKind::StuckServo,
        "slow_servo" => FaultKind::SlowServo(times(table)),
        "clock_jitter" => FaultKind::ClockJitter(table.require("late").deviation(&TIME)),
        "brown_out" => FaultKind::BrownOut,
        "stuck_gyro" => FaultKind::StuckGyro,
        "saturated_gyro" => FaultKind::SaturatedGyro,
        "garbled_gyro" => FaultKind::GarbledGyro(share(table)),
        "gyro_read_errors" => FaultKind::GyroReadErrors(share(table)),
        _ => {
            node.report("must be one of the faults in docs/formats.md");
            return None;
        }
    })
}

fn share(table: &Table<'_>) -> f64 {
    let node = table.require("share");
    let share = node.fraction();
    node.check(share, (0.0..=1.0).contains(&share), "from 0 to 1")
}

fn times(table: &Table<'_>) -> f64 {
    let node = table.require("times");
    let times = node.number();
    node.check(times, times >= 1.0, "at least 1")
}

fn wheel(table: &Table<'_>) -> Wheel {
    table.require("wheel").one_of(&[("right", Wheel::Right), ("left", Wheel::Left)], Wheel::Right)
}
