//! Reads the ranger of a robot file: its name, or its name with different settings.

use sonarfix::units::Duration;
use sonarfix_hal::config::RangerConfig;
use sonarfix_hal::ranger::{Celsius, PulseTiming, RangerKind, RangerSettings};

use crate::document::{Node, Table};
use crate::error::FileError;
use crate::single;
use crate::surroundings::temperature;

/// Names of rangers, with their settings.
const RANGERS: [(&str, RangerSettings); 4] = [
    ("hc_sr04", RangerSettings::HC_SR04),
    ("lv_maxsonar", RangerSettings::LV_MAXSONAR),
    ("srf02", RangerSettings::SRF),
    ("srf08", RangerSettings::SRF),
];

/// The ranger's settings in `[sonar]`.
pub(crate) struct Ranger {
    /// The driver's part.
    pub config: RangerConfig,
    /// Shortest ping period.
    pub cycle: Duration,
}

/// Reads `ranger`, `temperature` and `cycle` of `[sonar]`.
pub(crate) fn read(sonar: &Table<'_>) -> Result<Ranger, FileError> {
    let node = sonar.require("ranger")?;
    let (kind, usual_cycle) = match node.as_text() {
        Some(name) => named(name, &node)?,
        None => described(node)?,
    };
    let cycle = match (sonar.get("cycle"), usual_cycle) {
        (Some(node), _) => node.span()?,
        (None, Some(usual)) => usual,
        (None, None) => {
            return Err(sonar.error_at("cycle", "is missing: a custom ranger has its own"));
        }
    };
    let temperature = Celsius(single(temperature(Some(sonar))?));
    Ok(Ranger { config: RangerConfig { kind, temperature }, cycle })
}

fn named(name: &str, node: &Node<'_>) -> Result<(RangerKind, Option<Duration>), FileError> {
    if name == "custom" {
        return Ok((RangerKind::Custom, None));
    }
    let found = RANGERS.iter().find(|(known, _)| *known == name);
    let (_, settings) = found.ok_or_else(|| {
        let known = RANGERS.map(|(known, _)| format!("\"{known}\"")).join(", ");
        node.error(format!("must be {known}, \"custom\", or a table with such a `kind`"))
    })?;
    Ok((settings.kind, Some(settings.cycle)))
}

/// A ranger by its kind, with different settings.
fn described(node: Node<'_>) -> Result<(RangerKind, Option<Duration>), FileError> {
    const PULSE: [&str; 6] = ["trigger", "blanking", "longest", "silence", "listen", "stuck"];
    let table = node.table(&[&["kind", "address"], &PULSE[..]].concat())?;
    let kind = table.require("kind")?;
    let (usual, cycle) = named(kind.text()?, &kind)?;
    let others = |keys: &[&str]| keys.iter().find_map(|key| table.get(key));
    let misplaced = |keys: &[&str]| match others(keys) {
        Some(node) => Err(node.error("is no setting of this kind of ranger")),
        None => Ok(()),
    };
    let kind = match usual {
        RangerKind::Pulse(usual) => {
            misplaced(&["address"])?;
            RangerKind::Pulse(read_timing(&table, &usual)?)
        }
        RangerKind::Srf { address: usual } => {
            misplaced(&PULSE)?;
            RangerKind::Srf { address: read_address(&table)?.unwrap_or(usual) }
        }
        RangerKind::Custom => {
            misplaced(&["address"])?;
            misplaced(&PULSE)?;
            RangerKind::Custom
        }
    };
    Ok((kind, cycle))
}

fn read_timing(table: &Table<'_>, usual: &PulseTiming) -> Result<PulseTiming, FileError> {
    let time = |key, usual| table.get(key).map_or(Ok(usual), |node| node.span());
    Ok(PulseTiming {
        trigger: time("trigger", usual.trigger)?,
        blanking: time("blanking", usual.blanking)?,
        longest: time("longest", usual.longest)?,
        silence: time("silence", usual.silence)?,
        listen: time("listen", usual.listen)?,
        stuck: time("stuck", usual.stuck)?,
    })
}

/// A seven-bit I²C address that is not reserved.
fn read_address(table: &Table<'_>) -> Result<Option<u8>, FileError> {
    let Some(node) = table.get("address") else {
        return Ok(None);
    };
    let address = node.integer(0x08..=0x77)?;
    Ok(u8::try_from(address).ok())
}
