//! What goes wrong with the hardware, and when.

use crate::document::{Node, Table};
use crate::error::FileError;
use crate::quantity::TIME;

const KEYS: [&str; 7] = ["kind", "from", "to", "wheel", "share", "times", "late"];

/// A wheel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wheel {
    /// The right one.
    Right,
    /// The left one.
    Left,
}

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultKind {
    /// This share of the echoes is not heard.
    LostEchoes(f64),
    /// In this share of the pings another robot's is heard first.
    CrossTalk(f64),
    /// The echo line stays high.
    StuckEcho,
    /// Channel A of an encoder stands still.
    DeadEncoder(Wheel),
    /// The channels of an encoder are swapped.
    ReversedEncoder(Wheel),
    /// This share of an encoder's edges is missed.
    MissingTicks(Wheel, f64),
    /// The servo does not move.
    StuckServo,
    /// The servo takes this many times as long.
    SlowServo(f64),
    /// The loop is polled late, by up to so many seconds.
    ClockJitter(f64),
    /// The controller has no power; then it starts again, from the pose it had.
    BrownOut,
}

/// A fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    /// What goes wrong.
    pub kind: FaultKind,
    /// When it begins, seconds from the start of the run.
    pub from: f64,
    /// When it ends, seconds.
    pub to: f64,
}

/// Reads `faults`, an array of tables; none where it is missing.
pub(crate) fn read(root: &Table<'_>) -> Result<Vec<Fault>, FileError> {
    match root.get("faults") {
        Some(list) => list.items()?.into_iter().map(fault).collect(),
        None => Ok(Vec::new()),
    }
}

fn fault(node: Node<'_>) -> Result<Fault, FileError> {
    let table = node.table(&KEYS)?;
    let from = table.require("from")?.deviation(&TIME)?;
    let to_node = table.require("to")?;
    let to = to_node.quantity(&TIME)?;
    Ok(Fault { kind: kind(&table)?, from, to: to_node.check(to, to > from, "after `from`")? })
}

fn kind(table: &Table<'_>) -> Result<FaultKind, FileError> {
    let node = table.require("kind")?;
    Ok(match node.text()? {
        "lost_echoes" => FaultKind::LostEchoes(share(table)?),
        "cross_talk" => FaultKind::CrossTalk(share(table)?),
        "stuck_echo" => FaultKind::StuckEcho,
        "dead_encoder" => FaultKind::DeadEncoder(wheel(table)?),
        "reversed_encoder" => FaultKind::ReversedEncoder(wheel(table)?),
        "missing_ticks" => FaultKind::MissingTicks(wheel(table)?, share(table)?),
        "stuck_servo" => FaultKind::StuckServo,
        "slow_servo" => FaultKind::SlowServo(times(table)?),
        "clock_jitter" => FaultKind::ClockJitter(table.require("late")?.deviation(&TIME)?),
        "brown_out" => FaultKind::BrownOut,
        _ => return Err(node.error("is none of the faults in docs/formats.md")),
    })
}

fn share(table: &Table<'_>) -> Result<f64, FileError> {
    let node = table.require("share")?;
    let share = node.fraction()?;
    node.check(share, (0.0..=1.0).contains(&share), "from 0 to 1")
}

fn times(table: &Table<'_>) -> Result<f64, FileError> {
    let node = table.require("times")?;
    let times = node.number()?;
    node.check(times, times >= 1.0, "at least 1")
}

fn wheel(table: &Table<'_>) -> Result<Wheel, FileError> {
    let node = table.require("wheel")?;
    match node.text()? {
        "right" => Ok(Wheel::Right),
        "left" => Ok(Wheel::Left),
        _ => Err(node.error("must be \"right\" or \"left\"")),
    }
}
