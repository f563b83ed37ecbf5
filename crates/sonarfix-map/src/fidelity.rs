//! The fidelity of a simulation, and the simulated hardware.

use crate::document::{Node, Table};
use crate::quantity::{ANGLE, LENGTH, TIME};
use crate::sonar_model::{self, SonarName};

/// The part of the robot that is simulated between world and localizer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fidelity {
    /// None: the localizer receives travel and ranges without delay or jitter, as in the paper.
    #[default]
    Ideal,
    /// Pins and counters, with the drivers and the loop of a robot.
    Pins,
}

/// The sonar's servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ServoName {
    /// Reaches the commanded bearing at once.
    #[default]
    Ideal,
    /// SG90.
    Sg90,
    /// MG996R.
    Mg996r,
}

/// How the robot follows its path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Follow {
    /// Exactly, whatever the estimate.
    #[default]
    Truth,
    /// A controller steers by the estimate only.
    Estimate,
}

/// Disturbances of a wheel at random distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Upset {
    /// Mean distance between two, metres; infinite for none.
    pub every: f64,
    /// Excess travel that the encoder counts each time, metres; of a bump, its standard deviation.
    pub by: f64,
}

impl Default for Upset {
    fn default() -> Self {
        Self { every: f64::INFINITY, by: 0.0 }
    }
}

/// Slips of one wheel at random times, which turn the odometry and not the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingSlip {
    /// Mean time between two, seconds; infinite for none.
    pub every: f64,
    /// Least turn of the odometry by one slip, radians; either wheel slips.
    pub least: f64,
    /// Greatest turn, radians.
    pub most: f64,
}

impl Default for HeadingSlip {
    fn default() -> Self {
        Self { every: f64::INFINITY, least: 0.0, most: 0.0 }
    }
}

/// Disturbances of the wheels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Upsets {
    /// A wheel turns without rolling.
    pub slip: Upset,
    /// A wheel rolls over something.
    pub bump: Upset,
    /// A wheel spins so far that the odometry turns.
    pub heading_slip: HeadingSlip,
}

/// The hardware of a scenario.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hardware {
    /// The sonar.
    pub sonar: SonarName,
    /// The servo.
    pub servo: ServoName,
}

/// Reads an optional key whose value is one of several names.
fn named<T: Copy + Default>(node: Option<Node<'_>>, names: &[(&str, T)]) -> T {
    node.map_or_else(T::default, |node| node.one_of(names, T::default()))
}

pub(crate) fn read_fidelity(root: &Table<'_>) -> Fidelity {
    named(root.get("fidelity"), &[("ideal", Fidelity::Ideal), ("pins", Fidelity::Pins)])
}

pub(crate) fn read_follow(path: &Table<'_>) -> Follow {
    named(path.get("follow"), &[("truth", Follow::Truth), ("estimate", Follow::Estimate)])
}

pub(crate) fn read_hardware(root: &Table<'_>) -> Hardware {
    let model = |key| root.get(key)?.table(&["model"]).get("model");
    let servos =
        [("ideal", ServoName::Ideal), ("sg90", ServoName::Sg90), ("mg996r", ServoName::Mg996r)];
    let ideal = SonarName::default();
    let sonar = model("sensor")
        .map_or(ideal, |node| sonar_model::read(&node, &[], ideal, |model| model.simulated));
    Hardware { sonar, servo: named(model("servo"), &servos) }
}

pub(crate) fn read_upsets(truth: &Table<'_>) -> Upsets {
    Upsets {
        slip: upset(truth, "slip"),
        bump: upset(truth, "bump"),
        heading_slip: truth.get("heading_slip").map_or_else(HeadingSlip::default, heading_slip),
    }
}

fn heading_slip(node: Node<'_>) -> HeadingSlip {
    let table = node.table(&["every", "least", "most"]);
    let every_node = table.require("every");
    let every = every_node.quantity(&TIME);
    let least = table.require("least").deviation(&ANGLE);
    let most_node = table.require("most");
    let most = most_node.deviation(&ANGLE);
    HeadingSlip {
        every: every_node.check(every, every > 0.0, "positive"),
        least,
        most: most_node.check(most, most >= least, "at least the value of least"),
    }
}

fn upset(truth: &Table<'_>, key: &str) -> Upset {
    let Some(node) = truth.get(key) else {
        return Upset::default();
    };
    let table = node.table(&["every", "by"]);
    let every_node = table.require("every");
    let every = every_node.quantity(&LENGTH);
    Upset {
        every: every_node.check(every, every > 0.0, "positive"),
        by: table.require("by").deviation(&LENGTH),
    }
}
