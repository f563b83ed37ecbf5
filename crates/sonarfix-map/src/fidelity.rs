//! The fidelity of a simulation, and the simulated hardware.

use crate::document::{Node, Table};
use crate::error::FileError;
use crate::quantity::LENGTH;

/// The part of the robot that is simulated between world and localizer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fidelity {
    /// None: the localizer receives travel and ranges without delay or jitter, as in the paper.
    #[default]
    Ideal,
    /// Pins and counters, with the drivers and the loop of a robot.
    Pins,
}

/// The robot's sonar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SonarName {
    /// The paper's: always detects the nearest wall in its cone. Noise and cone are in `[truth]`.
    #[default]
    Ideal,
    /// HC-SR04.
    HcSr04,
    /// LEGO NXT.
    Nxt,
    /// LV-MaxSonar-EZ, by pulse width.
    LvMaxSonar,
    /// SRF08.
    Srf08,
    /// Polaroid 6500 with its electrostatic transducer.
    Polaroid6500,
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
fn named<T: Copy + Default>(node: Option<Node<'_>>, names: &[(&str, T)]) -> Result<T, FileError> {
    let Some(node) = node else {
        return Ok(T::default());
    };
    let text = node.text()?;
    let found = names.iter().find(|(name, _)| *name == text);
    found.map(|(_, value)| *value).ok_or_else(|| {
        let known: Vec<String> = names.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        node.error(format!("must be {}", known.join(" or ")))
    })
}

pub(crate) fn read_fidelity(root: &Table<'_>) -> Result<Fidelity, FileError> {
    named(root.get("fidelity"), &[("ideal", Fidelity::Ideal), ("pins", Fidelity::Pins)])
}

pub(crate) fn read_follow(path: &Table<'_>) -> Result<Follow, FileError> {
    named(path.get("follow"), &[("truth", Follow::Truth), ("estimate", Follow::Estimate)])
}

/// Reads `[sensor]` and `[servo]`; the default is ideal.
pub(crate) fn read_hardware(root: &Table<'_>) -> Result<Hardware, FileError> {
    let optional = |key, keys: &[&str]| root.get(key).map(|node| node.table(keys)).transpose();
    let sensor = optional("sensor", &["model"])?;
    let servo = optional("servo", &["model"])?;
    let sonars = [
        ("ideal", SonarName::Ideal),
        ("hc_sr04", SonarName::HcSr04),
        ("nxt", SonarName::Nxt),
        ("lv_maxsonar", SonarName::LvMaxSonar),
        ("srf08", SonarName::Srf08),
        ("polaroid_6500", SonarName::Polaroid6500),
    ];
    let servos =
        [("ideal", ServoName::Ideal), ("sg90", ServoName::Sg90), ("mg996r", ServoName::Mg996r)];
    Ok(Hardware {
        sonar: named(model(sensor.as_ref()), &sonars)?,
        servo: named(model(servo.as_ref()), &servos)?,
    })
}

fn model<'a>(table: Option<&Table<'a>>) -> Option<Node<'a>> {
    table.and_then(|table| table.get("model"))
}

pub(crate) fn read_upsets(truth: &Table<'_>) -> Result<Upsets, FileError> {
    Ok(Upsets { slip: upset(truth, "slip")?, bump: upset(truth, "bump")? })
}

fn upset(truth: &Table<'_>, key: &str) -> Result<Upset, FileError> {
    let Some(node) = truth.get(key) else {
        return Ok(Upset::default());
    };
    let table = node.table(&["every", "by"])?;
    let every_node = table.require("every")?;
    let every = every_node.quantity(&LENGTH)?;
    Ok(Upset {
        every: every_node.check(every, every > 0.0, "positive")?,
        by: table.require("by")?.deviation(&LENGTH)?,
    })
}
