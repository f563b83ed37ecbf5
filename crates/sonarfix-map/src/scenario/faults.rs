//! Faults of the hardware, with their times.

use crate::document::{Node, Table};
use crate::keys::{Key, Section, Value, depends, number, other};
use crate::quantity::{FRACTION, NUMBER, TIME};

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
    /// In this fraction of the pings the range is any, whatever is there.
    FalseRanges(f64),
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

/// The keys of a fault; which of them it has depends on its kind.
#[derive(Clone, Copy, Default)]
pub(crate) struct FaultKeys {
    pub from: f64,
    pub to: f64,
    pub is_left: bool,
    pub share: f64,
    pub times: f64,
    pub late: f64,
}

#[rustfmt::skip]
pub(crate) static FAULT: Section<FaultKeys> = Section { name: "faults", usual: FaultKeys::default, keys: &[
    other("kind", "a fault of the list below", "the fault"),
    number("from", &TIME, ("0 s", "1000000 s"), |f| &mut f.from, "when it begins, from the start of the run"),
    number("to", &TIME, ("0 s", "1000000 s"), |f| &mut f.to, "when it ends. After `from`"),
    depends(Key::new("wheel", Value::Word(&["right", "left"], |f| usize::from(f.is_left), |f, word| f.is_left = word == 1), "the wheel")),
    depends(number("share", &FRACTION, ("0", "1"), |f| &mut f.share, "how many, a fraction")),
    depends(number("times", &NUMBER, ("1", "1000"), |f| &mut f.times, "how many times as long")),
    depends(number("late", &TIME, ("0 s", "100 s"), |f| &mut f.late, "the maximum delay")),
] };

/// Reads `faults`, an optional array of tables.
pub(crate) fn read(root: &Table<'_>) -> Vec<Fault> {
    let items = root.get("faults").map(|list| list.items());
    items.into_iter().flatten().filter_map(fault).collect()
}

/// None if its kind is unknown.
fn fault(node: Node<'_>) -> Option<Fault> {
    let table = node.table(&FAULT.names());
    let mistakes = table.mistakes();
    let keys = FAULT.read_from(&table, FaultKeys::default());
    if table.mistakes() == mistakes && keys.to <= keys.from {
        table.report_at("to", "must be after `from`");
    }
    Some(Fault { kind: kind(&table, &keys)?, from: keys.from, to: keys.to })
}

fn kind(table: &Table<'_>, keys: &FaultKeys) -> Option<FaultKind> {
    let needs = |names: &[&str]| names.iter().for_each(|name| drop(table.require(name)));
    let share = || {
        needs(&["share"]);
        keys.share
    };
    let wheel = || {
        needs(&["wheel"]);
        if keys.is_left { Wheel::Left } else { Wheel::Right }
    };
    let node = table.require("kind");
    Some(match node.text() {
        "lost_echoes" => FaultKind::LostEchoes(share()),
        "cross_talk" => FaultKind::CrossTalk(share()),
        "false_ranges" => FaultKind::FalseRanges(share()),
        "stuck_echo" => FaultKind::StuckEcho,
        "dead_sonar" => FaultKind::DeadSonar,
        "dead_encoder" => FaultKind::DeadEncoder(wheel()),
        "reversed_encoder" => FaultKind::ReversedEncoder(wheel()),
        "missing_ticks" => FaultKind::MissingTicks(wheel(), share()),
        "read_errors" => FaultKind::ReadErrors(wheel(), share()),
        "stuck_servo" => FaultKind::StuckServo,
        "slow_servo" => {
            needs(&["times"]);
            FaultKind::SlowServo(keys.times)
        }
        "clock_jitter" => {
            needs(&["late"]);
            FaultKind::ClockJitter(keys.late)
        }
        "brown_out" => FaultKind::BrownOut,
        "stuck_gyro" => FaultKind::StuckGyro,
        "saturated_gyro" => FaultKind::SaturatedGyro,
        "garbled_gyro" => FaultKind::GarbledGyro(share()),
        "gyro_read_errors" => FaultKind::GyroReadErrors(share()),
        _ => {
            node.report("must be one of the faults in docs/formats.md");
            return None;
        }
    })
}
