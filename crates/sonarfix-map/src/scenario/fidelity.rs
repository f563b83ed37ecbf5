//! The fidelity of a simulation, and the simulated hardware.

use crate::document::Node;
use crate::keys::{Key, Section, Value, optional};
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

/// The hardware of a scenario.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hardware {
    /// The sonar.
    pub sonar: SonarName,
    /// The servo.
    pub servo: ServoName,
}

#[rustfmt::skip]
pub(crate) static SENSOR: Section<SonarName> = Section { name: "sensor", usual: SonarName::default, keys: &[
    optional(Key::new("model", Value::Own("a simulation of the list above", |node, sonar| read_sensor(&node, sonar), |_| None),
        "the simulated sonar. `\"ideal\"`, which is usual, always detects the nearest wall in its cone; `\"hc_sr04\"` and `\"nxt\"` are as measured ([the \
        fit](sonar-model.md)), `\"ev3\"` has [the cone of a recorded drive](hardware.md#ultrasonic-rangers), the others are by their datasheets")),
] };

#[rustfmt::skip]
pub(crate) static SERVO: Section<ServoName> = Section { name: "servo", usual: ServoName::default, keys: &[
    optional(Key::new("model", Value::Word(&["ideal", "sg90", "mg996r"], |servo| *servo as usize, |servo, word| {
        *servo = [ServoName::Ideal, ServoName::Sg90, ServoName::Mg996r].get(word).copied().unwrap_or_default();
    }), "reaches the commanded bearing at once, or has frame, slew, dead band, ringing and backlash")),
] };

fn read_sensor(node: &Node<'_>, sonar: &mut SonarName) {
    *sonar = sonar_model::read(node, &[], *sonar, |model| model.simulated);
}
