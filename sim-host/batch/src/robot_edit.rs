//! Writes what was measured into the text of a robot file and keeps its comments.

use anyhow::Context;
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::ranger::{Air, Celsius};
use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

use crate::bearings::Bearings;
use crate::calibrate::{Calibration, Determined};
use crate::constants::Name;
use crate::turned::Turned;

/// The robot file with the calibration: wheels, track width and mount; the bearings of the servo's pulses and the
/// temperature if they are determined; and the deviations of the prior.
///
/// # Errors
/// If the text is no robot file.
pub fn calibrated(text: &str, robot: &RobotConfig, found: &Calibration) -> anyhow::Result<String> {
    let mut document: DocumentMut = text.parse().context("the robot file is not TOML")?;
    let constants = &found.constants;
    let is_known = |name: Name| {
        let estimate = found.estimates.iter().find(|estimate| estimate.name == name);
        estimate.is_some_and(|estimate| estimate.determined != Determined::No)
    };
    let drive = table(&mut document, "drive")?;
    let width = robot.localizer.drive.track_width.0;
    let width = f64::from(width) * (1.0 + constants.get(Name::Track));
    if is_known(Name::Track) {
        set(drive, "track_width", millimetres(width));
    }
    for (key, name) in [("right_wheel", Name::Right), ("left_wheel", Name::Left)] {
        if is_known(name) {
            wheel(drive, key, 1.0 + constants.get(name))?;
        }
    }
    let sonar = table(&mut document, "sonar")?;
    if is_known(Name::MountAhead) && is_known(Name::MountLeft) {
        let mount = [Name::MountAhead, Name::MountLeft];
        let mount = mount.map(|name| Value::from(millimetres(constants.get(name))));
        replace(sonar, "mount", Value::Array(mount.into_iter().collect()));
    }
    if found.bearings.is_some() {
        pulses(sonar, robot, |bearing| found.constants.bearing(bearing))?;
    }
    if is_known(Name::RangeScale) && sonar.contains_key("temperature") {
        let corrected =
            temperature(robot.rangers.first.temperature, constants.get(Name::RangeScale));
        if let Some(Celsius(celsius)) = corrected {
            set(sonar, "temperature", format!("{celsius:.1} degC"));
        }
    }
    priors(&mut document, robot, found)?;
    Ok(document.to_string())
}

/// The temperature at which the driver's ranges have no scale error; `None` if the driver cannot compute with it. The speed
/// of sound in air is proportional to the square root of the absolute temperature.
fn temperature(celsius: Celsius, scale: f64) -> Option<Celsius> {
    const ZERO: f64 = 273.15;
    let corrected = (f64::from(celsius.0) + ZERO) / (1.0 + scale).powi(2) - ZERO;
    #[expect(clippy::cast_possible_truncation, reason = "a tenth of a degree matters")]
    let corrected = Celsius(corrected as f32);
    Air::at(corrected).is_ok().then_some(corrected)
}

/// The table of the document: the file's own, or that of `[robot]`.
fn table<'d>(document: &'d mut DocumentMut, name: &str) -> anyhow::Result<&'d mut Table> {
    let table = document.get_mut(name).and_then(Item::as_table_mut);
    table.with_context(|| format!("the robot file has no table [{name}]"))
}

/// Replaces a value and keeps the comment behind it.
fn put(old: &mut Value, new: impl Into<Value>) {
    let decor = old.decor().clone();
    *old = new.into();
    *old.decor_mut() = decor;
}

fn replace(table: &mut Table, key: &str, value: Value) {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => put(old, value),
        None => drop(table.insert(key, Item::Value(value))),
    }
}

fn set(table: &mut Table, key: &str, text: String) {
    replace(table, key, Value::from(text));
}

fn millimetres(metres: f64) -> String {
    format!("{:.3} mm", 1e3 * metres)
}

/// Scales the wheel's diameter, or its travel per edge.
fn wheel(drive: &mut Table, key: &str, scale: f64) -> anyhow::Result<()> {
    let wheel = drive.get_mut(key).and_then(Item::as_table_like_mut);
    let wheel = wheel.with_context(|| format!("the robot file has no table {key}"))?;
    for length in ["diameter", "travel_per_edge"] {
        let Some(value) = wheel.get_mut(length).and_then(Item::as_value_mut) else { continue };
        let text = value.as_str().with_context(|| format!("{key}.{length} must be text"))?;
        let (number, unit) = text.trim().split_once(' ').context("a length needs a unit")?;
        let number: f64 = number.parse().with_context(|| format!("{key}.{length}"))?;
        let scaled = format!("{:.6} {}", number * scale, unit.trim());
        put(value, scaled);
    }
    Ok(())
}

/// The robot file with what was measured on the bench: the wheels, right and left, and the servo.
///
/// # Errors
/// If the text is no robot file.
pub fn measured(
    text: &str,
    robot: &RobotConfig,
    wheels: &[Turned; 2],
    servo: Option<&Bearings>,
) -> anyhow::Result<String> {
    let mut document: DocumentMut = text.parse().context("the robot file is not TOML")?;
    let drive = table(&mut document, "drive")?;
    for (key, turned) in ["right_wheel", "left_wheel"].into_iter().zip(wheels) {
        let wheel = drive.get_mut(key).and_then(Item::as_table_like_mut);
        turn(wheel.with_context(|| format!("the robot file has no table {key}"))?, turned);
        if let Some(inline) = drive.get_mut(key).and_then(Item::as_inline_table_mut) {
            inline.fmt();
        }
    }
    if let Some(servo) = servo {
        let sonar = table(&mut document, "sonar")?;
        pulses(sonar, robot, |bearing| servo.offset + servo.scale * bearing)?;
    }
    Ok(document.to_string())
}

/// Direction and edges per revolution of a wheel. A number that agrees with the file's is less exact than that.
fn turn(wheel: &mut dyn TableLike, turned: &Turned) {
    if turned.is_mirrored() {
        wheel.insert("mirrored", Item::Value(Value::from(true)));
    } else {
        wheel.remove("mirrored");
    }
    let edges = wheel.get("edges_per_revolution").and_then(number);
    if edges.is_some_and(|edges| !turned.agrees_with(edges)) {
        let edges = Value::from(turned.edges_per_revolution().round());
        wheel.insert("edges_per_revolution", Item::Value(edges));
    }
}

#[expect(clippy::cast_precision_loss, reason = "edges of a revolution")]
fn number(item: &Item) -> Option<f64> {
    item.as_float().or_else(|| item.as_integer().map(|integer| integer as f64))
}

/// The bearings of the servo's two measured pulses, or the bearing of a sonar without a servo; `truth` is that of a bearing of the robot file, both in radians.
fn pulses(
    sonar: &mut Table,
    robot: &RobotConfig,
    truth: impl Fn(f64) -> f64,
) -> anyhow::Result<()> {
    if let Some(bearing) = robot.localizer.rangers.first.fixed_bearing() {
        let bearing = truth(bearing.0.into()).to_degrees();
        set(sonar, "bearing", format!("{bearing:.2} deg"));
        return Ok(());
    }
    let pulses = sonar.get_mut("servo_pulses").and_then(Item::as_array_mut);
    let pulses = pulses.context("the robot file has no servo_pulses")?;
    for (pulse, measured) in pulses.iter_mut().zip(robot.rangers.first.servo_pulses) {
        let pulse = pulse.as_inline_table_mut().context("servo_pulses must be tables")?;
        let bearing = truth(measured.bearing.0.into()).to_degrees();
        if let Some(value) = pulse.get_mut("bearing") {
            put(value, format!("{bearing:.2} deg"));
        }
    }
    Ok(())
}

/// The deviations with which the localizer starts. At least a tenth of a per cent: wheels wear, and air warms.
fn priors(
    document: &mut DocumentMut,
    robot: &RobotConfig,
    found: &Calibration,
) -> anyhow::Result<()> {
    const LEAST: f64 = 1e-3;
    let prior = table(document, "prior")?;
    let width = f64::from(robot.localizer.drive.track_width.0);
    for estimate in &found.estimates {
        let deviation = estimate.deviation.max(LEAST);
        let per_cent = || format!("{:.2} %", 100.0 * deviation);
        match estimate.name {
            _ if estimate.determined == Determined::No => {}
            Name::Right => set(prior, "scale_right", per_cent()),
            Name::Left => set(prior, "scale_left", per_cent()),
            Name::Track => set(prior, "track_width", millimetres(width * deviation)),
            // The temperature of the next day is another one.
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Celsius, temperature};

    #[test]
    fn a_range_that_is_too_long_needs_a_lower_temperature() {
        // 0.18 % per °C: 343.4 m/s at 20 °C, 340.4 m/s at 15 °C.
        let corrected = temperature(Celsius(20.0), 343.4 / 340.4 - 1.0).unwrap().0;
        assert!((corrected - 15.0).abs() < 0.2, "{corrected}");
        assert_eq!(temperature(Celsius(20.0), 0.5), None);
    }
}
