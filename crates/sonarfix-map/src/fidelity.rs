//! The fidelity of a simulation, and the simulated hardware.

use crate::document::Node;
use crate::keys::scenario::HEADING_SLIP;
use crate::scenario::Truth;
use crate::sonar_model::SonarName;

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

pub(crate) fn read_heading_slip(node: Node<'_>, into: &mut (Truth, Upsets)) {
    let table = node.table(&HEADING_SLIP.names());
    let read = || Some(HEADING_SLIP.read_from(&table, HeadingSlip::default()));
    let Some(slip) = table.faultless(read) else { return };
    if slip.most < slip.least {
        table.report_at("most", "must be at least the value of least");
    }
    into.1.heading_slip = slip;
}
