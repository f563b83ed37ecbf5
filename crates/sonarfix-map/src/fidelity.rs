//! The fidelity of a simulation, and the simulated hardware.

use crate::document::{Node, Table};
use crate::quantity::LENGTH;
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

/// Disturbances of the wheels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Upsets {
    /// A wheel turns without rolling.
    pub slip: Upset,
    /// A wheel rolls over something.
    pub bump: Upset,
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
    Upsets { slip: upset(truth, "slip"), bump: upset(truth, "bump") }
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
