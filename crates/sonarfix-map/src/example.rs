//! The remedy for a missing key: the value that the shipped scenario `classroom` has there.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

const CLASSROOM: &str = include_str!("../scenarios/classroom.toml");

/// The message for a missing key, given in full, of a map, robot or scenario file.
pub(crate) fn missing(key: &str) -> String {
    let name = key.rsplit('.').next().unwrap_or(key);
    // A robot file has the keys of a scenario's `robot`.
    let remedy = remedy(name, key).or_else(|| remedy(name, &format!("robot.{key}")));
    remedy.map_or_else(|| "is missing".into(), |remedy| format!("is missing: {remedy}"))
}

fn remedy(name: &str, key: &str) -> Option<String> {
    let classroom = DeTable::parse(CLASSROOM).ok()?;
    let (first, rest) = key.split_once('.').unwrap_or((key, ""));
    let mut value = entry(classroom.get_ref(), first)?;
    for part in rest.split('.').filter(|part| !part.is_empty()) {
        value = entry(value.get_ref().as_table()?, part)?;
    }
    let text = CLASSROOM.get(value.span()).filter(|text| !text.contains('\n'));
    match (value.get_ref(), text) {
        (DeValue::Table(table), text) if text.is_none_or(|text| text.starts_with('[')) => {
            let keys: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).collect();
            Some(format!("a table with {}", keys.join(", ")))
        }
        (_, text) => Some(format!("write, for example, {name} = {}", text?)),
    }
}

/// The value of a key; of an array's item, the first.
fn entry<'t, 'a>(table: &'t DeTable<'a>, part: &str) -> Option<&'t Spanned<DeValue<'a>>> {
    let (name, index) = part.split_once('[').unwrap_or((part, ""));
    let value = table.get(name)?;
    if index.is_empty() { Some(value) } else { value.get_ref().as_array()?.first() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_key_has_the_value_of_the_shipped_scenario() {
        let cases = [
            ("format", "is missing: write, for example, format = 1"),
            ("robot.sonar.cone", "is missing: write, for example, cone = \"12 deg\""),
            ("sonar.cone", "is missing: write, for example, cone = \"12 deg\""),
            ("map.wall[7].to", "is missing: write, for example, to = [6, 0]"),
            ("prior", "is missing: a table with range_scale, scale_left, scale_right, track_width"),
            ("drive.right_wheel.edges_per_revolution", "is missing"),
        ];
        for (key, message) in cases {
            assert_eq!(missing(key), message);
        }
    }
}
