//! Reads and writes the ranger of a robot file: its name, or its name with different settings.

use sonarfix::config::{LightBeam, LightLinked, RangerParameters, Ranging};
use sonarfix::geometry::units::{Duration, Radians};
use sonarfix_hal::config::RangerConfig;
use sonarfix_hal::ranger::{PulseTiming, RangerKind, RangerSettings};

use super::common_parts::usual;
use crate::devices::VL53L0X_BEAM;
use crate::document::{Node, Table};
use crate::keys::{Key, Section, Value, depends, number};
use crate::quantity::{ANGLE, TIME};
use crate::sonar_model::{self, CUSTOM};

/// A ranger as its table describes it.
#[derive(Clone, Copy)]
pub(crate) struct Ranger {
    pub sonar: RangerParameters,
    pub driver: RangerConfig,
    /// That of a sonar without a servo, radians.
    pub bearing: Option<f32>,
}

impl Ranger {
    pub(crate) fn usual() -> Self {
        Self {
            sonar: usual().localizer.rangers.first,
            driver: usual().rangers.first,
            bearing: None,
        }
    }
}

/// The settings of a ranger by its kind.
#[derive(Clone, Copy)]
pub(crate) struct RangerKeys {
    pub timing: PulseTiming,
    pub address: Option<u8>,
}

#[rustfmt::skip]
pub(crate) static RANGER: Section<RangerKeys> = Section { name: "ranger", usual: || RangerKeys { timing: PulseTiming::HC_SR04, address: None }, keys: &[
    depends(Key::new("kind", Value::Own("a driver of the list above", |_, _| {}, |_| None), "the kind of ranger")),
    depends(Key::new("address", Value::Own("0x08 to 0x77", |node, r| read_address(&node, r), |_| None),
        "address on the bus of an SRF, a VL53L1X or a VL53L0X. The other settings are those of an HC-SR04 and an LV-MaxSonar")),
    depends(number("trigger", &TIME, ("0 s", "10 s"), |r| &mut r.timing.trigger, "width of the trigger pulse")),
    depends(number("blanking", &TIME, ("0 s", "10 s"), |r| &mut r.timing.blanking, "time after the trigger in which the echo line is ignored")),
    depends(number("longest", &TIME, ("0 s", "10 s"), |r| &mut r.timing.longest, "the longest echo pulse that is a range")),
    depends(number("silence", &TIME, ("0 s", "10 s"), |r| &mut r.timing.silence, "pulses from this length on mean that there was no echo")),
    depends(number("listen", &TIME, ("0 s", "10 s"), |r| &mut r.timing.listen, "time after which the ranger is taken not to answer")),
    depends(number("stuck", &TIME, ("0 s", "10 s"), |r| &mut r.timing.stuck, "time after which the echo line is taken to be stuck")),
] };

#[rustfmt::skip]
pub(crate) static BEAM: Section<LightBeam> = Section { name: "beam", usual: || LightBeam::VL53L1X, keys: &[
    depends(number("spot", &ANGLE, ("0.01 deg", "20 deg"), |b| &mut b.spot.0, "half of the inner cone, which returns most of the light: a quarter of the field of view")),
    depends(number("pointing", &ANGLE, ("0 deg", "45 deg"), |b| &mut b.pointing.0,
        "standard deviation of its direction: of servo and mount")),
] };

const PULSE: [&str; 6] = ["trigger", "blanking", "longest", "silence", "listen", "stuck"];

/// Reads `ranger`: the driver, and the usual cycle and beam of this kind.
pub(crate) fn read_kind(node: Node<'_>, ranger: &mut Ranger) {
    let (kind, cycle) = match node.as_text() {
        Some(name) => named(name, &node),
        None => described(node),
    };
    ranger.driver.kind = kind;
    ranger.sonar.timing.cycle = cycle;
    ranger.sonar.ranging = match kind {
        RangerKind::Vl53l1x { .. } => Ranging::Light(LightBeam::VL53L1X),
        RangerKind::Vl53l0x { .. } => Ranging::Light(VL53L0X_BEAM),
        RangerKind::Pulse(_) | RangerKind::Srf { .. } | RangerKind::Custom => Ranging::Sound,
    };
}

/// Records that a custom ranger has no `cycle`, which is known of the others.
pub(crate) fn require_cycle(sonar: &Table<'_>, ranger: &Ranger) {
    if ranger.driver.kind == RangerKind::Custom && sonar.get("cycle").is_none() {
        sonar.report_at("cycle", "is missing: a custom ranger has its own");
    }
}

/// Reads `beam`: that of the ranger, with different settings. A custom ranger measures with light if it has a beam.
pub(crate) fn read_beam(node: Node<'_>, ranger: &mut Ranger) {
    let table = match ranger.sonar.ranging {
        Ranging::Sound if ranger.driver.kind != RangerKind::Custom => {
            return node.report("is of a time-of-flight ranger, and this ranger is a sonar");
        }
        _ => node.table(&BEAM.names()),
    };
    let usual = match ranger.sonar.ranging {
        Ranging::Light(beam) => beam,
        Ranging::Sound => {
            BEAM.names().into_iter().for_each(|key| drop(table.require(key)));
            LightBeam { spot: Radians(0.0), pointing: Radians(0.0), linked: LightLinked }
        }
    };
    ranger.sonar.ranging = Ranging::Light(BEAM.read_from(&table, usual));
}

fn named(name: &str, node: &Node<'_>) -> (RangerKind, Duration) {
    let usual = RangerSettings::HC_SR04;
    if name == CUSTOM {
        return (RangerKind::Custom, usual.cycle);
    }
    let settings = sonar_model::read(node, &[CUSTOM], usual, |model| model.ranger);
    (settings.kind, settings.cycle)
}

/// A ranger by its kind, with different settings.
fn described(node: Node<'_>) -> (RangerKind, Duration) {
    let table = node.table(&RANGER.names());
    let kind = table.require("kind");
    let (usual, cycle) = named(kind.text(), &kind);
    let (timing, is_pulse) = match usual {
        RangerKind::Pulse(timing) => (timing, true),
        _ => (PulseTiming::HC_SR04, false),
    };
    let RangerKeys { timing, address } =
        RANGER.read_from(&table, RangerKeys { timing, address: None });
    let has_address = !is_pulse && usual != RangerKind::Custom;
    let pulse = PULSE.iter().filter(|_| !is_pulse);
    for key in pulse.chain(["address"].iter().filter(|_| !has_address)) {
        if let Some(node) = table.get(key) {
            node.report("is no setting of this kind of ranger");
        }
    }
    let kind = match usual {
        RangerKind::Pulse(_) => RangerKind::Pulse(timing),
        RangerKind::Srf { address: usual } => RangerKind::Srf { address: address.unwrap_or(usual) },
        RangerKind::Vl53l1x { address: usual } => {
            RangerKind::Vl53l1x { address: address.unwrap_or(usual) }
        }
        RangerKind::Vl53l0x { address: usual } => {
            RangerKind::Vl53l0x { address: address.unwrap_or(usual) }
        }
        RangerKind::Custom => RangerKind::Custom,
    };
    (kind, cycle)
}

/// A seven-bit I²C address that is not reserved.
fn read_address(node: &Node<'_>, keys: &mut RangerKeys) {
    keys.address = u8::try_from(node.integer(0x08..=0x77)).ok();
}

/// The value of `ranger`.
pub(crate) fn kind_text(ranger: &Ranger) -> String {
    let (kind, address) = match ranger.driver.kind {
        RangerKind::Pulse(timing) => {
            let keys = RANGER.inline(&RangerKeys { timing, address: None });
            return keys.replacen('{', "{ kind = \"hc_sr04\",", 1);
        }
        RangerKind::Srf { address } => ("srf08", address),
        RangerKind::Vl53l1x { address } => ("vl53l1x", address),
        RangerKind::Vl53l0x { address } => ("vl53l0x", address),
        RangerKind::Custom => return format!("\"{CUSTOM}\""),
    };
    format!("{{ kind = \"{kind}\", address = {address} }}")
}
