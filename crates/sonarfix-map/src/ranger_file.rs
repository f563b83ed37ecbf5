//! Reads the ranger of a robot file: its name, or its name with different settings.

use sonarfix::config::{LightBeam, LightLinked, Ranging};
use sonarfix::geometry::units::{Duration, Radians};
use sonarfix_hal::config::RangerConfig;
use sonarfix_hal::ranger::{Celsius, PulseTiming, RangerKind, RangerSettings};

use crate::document::{Node, Table};
use crate::quantity::ANGLE;
use crate::single;
use crate::sonar_model::{self, CUSTOM};
use crate::surroundings::temperature;

/// The ranger's settings in `[sonar]`.
pub(crate) struct Ranger {
    /// The driver's part, without the pulses of the servo.
    pub config: RangerConfig,
    /// Shortest ping period.
    pub cycle: Duration,
    /// Sound, or the beam of light.
    pub ranging: Ranging,
}

/// Reads `ranger`, `temperature` and `cycle` of `[sonar]`.
pub(crate) fn read(sonar: &Table<'_>) -> Ranger {
    let node = sonar.require("ranger");
    let (kind, usual_cycle) = match node.as_text() {
        Some(name) => named(name, &node),
        None => described(node),
    };
    let cycle = match (sonar.get("cycle"), usual_cycle) {
        (Some(node), _) => node.span(),
        (None, Some(usual)) => usual,
        (None, None) => {
            sonar.report_at("cycle", "is missing: a custom ranger has its own");
            RangerSettings::HC_SR04.cycle
        }
    };
    let ranging = read_beam(sonar, kind);
    let temperature = Celsius(single(temperature(Some(sonar))));
    Ranger {
        config: RangerConfig { kind, temperature, servo_pulses: RangerConfig::NO_PULSES },
        cycle,
        ranging,
    }
}

/// The beam: that of the ranger, with different settings. A custom ranger measures with light if it has a beam.
fn read_beam(sonar: &Table<'_>, kind: RangerKind) -> Ranging {
    let usual = match kind {
        RangerKind::Vl53l1x { .. } => Some(LightBeam::VL53L1X),
        RangerKind::Vl53l0x { .. } => Some(LightBeam::VL53L0X),
        RangerKind::Pulse(_) | RangerKind::Srf { .. } | RangerKind::Custom => None,
    };
    let Some(node) = sonar.get("beam") else {
        return usual.map_or(Ranging::Sound, Ranging::Light);
    };
    if usual.is_none() && kind != RangerKind::Custom {
        node.report("is of a time-of-flight ranger, and this ranger is a sonar");
        return Ranging::Sound;
    }
    let table = node.table(&["spot", "pointing"]);
    let angle = |key, usual: Option<Radians>| match (table.get(key), usual) {
        (None, Some(usual)) => usual,
        _ => Radians(single(table.require(key).quantity(&ANGLE))),
    };
    Ranging::Light(LightBeam {
        spot: angle("spot", usual.map(|beam| beam.spot)),
        pointing: angle("pointing", usual.map(|beam| beam.pointing)),
        linked: LightLinked,
    })
}

fn named(name: &str, node: &Node<'_>) -> (RangerKind, Option<Duration>) {
    if name == CUSTOM {
        return (RangerKind::Custom, None);
    }
    let settings =
        sonar_model::read(node, &[CUSTOM], RangerSettings::HC_SR04, |model| model.ranger);
    (settings.kind, Some(settings.cycle))
}

/// A ranger by its kind, with different settings.
fn described(node: Node<'_>) -> (RangerKind, Option<Duration>) {
    const PULSE: [&str; 6] = ["trigger", "blanking", "longest", "silence", "listen", "stuck"];
    let table = node.table(&[&["kind", "address"], &PULSE[..]].concat());
    let kind = table.require("kind");
    let (usual, cycle) = named(kind.text(), &kind);
    let misplaced = |keys: &[&str]| {
        for node in keys.iter().filter_map(|key| table.get(key)) {
            node.report("is no setting of this kind of ranger");
        }
    };
    let kind = match usual {
        RangerKind::Pulse(usual) => {
            misplaced(&["address"]);
            RangerKind::Pulse(read_timing(&table, &usual))
        }
        RangerKind::Srf { address: usual } => {
            misplaced(&PULSE);
            RangerKind::Srf { address: read_address(&table).unwrap_or(usual) }
        }
        RangerKind::Vl53l1x { address: usual } => {
            misplaced(&PULSE);
            RangerKind::Vl53l1x { address: read_address(&table).unwrap_or(usual) }
        }
        RangerKind::Vl53l0x { address: usual } => {
            misplaced(&PULSE);
            RangerKind::Vl53l0x { address: read_address(&table).unwrap_or(usual) }
        }
        RangerKind::Custom => {
            misplaced(&["address"]);
            misplaced(&PULSE);
            RangerKind::Custom
        }
    };
    (kind, cycle)
}

fn read_timing(table: &Table<'_>, usual: &PulseTiming) -> PulseTiming {
    let time = |key, usual| table.get(key).map_or(usual, |node| node.span());
    PulseTiming {
        trigger: time("trigger", usual.trigger),
        blanking: time("blanking", usual.blanking),
        longest: time("longest", usual.longest),
        silence: time("silence", usual.silence),
        listen: time("listen", usual.listen),
        stuck: time("stuck", usual.stuck),
    }
}

/// A seven-bit I²C address that is not reserved.
fn read_address(table: &Table<'_>) -> Option<u8> {
    u8::try_from(table.get("address")?.integer(0x08..=0x77)).ok()
}
