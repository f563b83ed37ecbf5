//! Finds values that are valid, and improbable: a wheel of 65 m, a room of 4 mm, a start outside of the room.
//!
//! A rule is a quantity, its usual interval, and causes. A value outside of the interval is explained by the first cause that
//! leads to a usual one: another unit, a cause of the table, the sign, the decimal point. [`values`] has the rules for the
//! numbers of a file, [`room`] those for its walls and its path. A line with the comment `# plausible` has no warnings.

mod facts;
mod room;
mod rule;
mod values;

use std::path::Path;

use crate::document::Document;
use crate::error::Mistake;
use crate::map_file::MapFile;
use crate::quantity::ANGLE;
use crate::scenario::Scenario;
use crate::{file, robot_file};

use facts::{Fact, Facts};
pub(crate) use room::intention;
use rule::Measure;
use values::{ANGLES, RULES};

/// The warnings about a file: a scenario with the map and the robot that it names, a robot file or a map. None about a file
/// that has mistakes, which its reader reports.
#[must_use]
pub fn of_file(path: &Path) -> Vec<Mistake> {
    let (name, base) = (file::name(path), path.parent().unwrap_or(Path::new("")));
    match file::read(path) {
        Ok(text) if !is_csv(path) => of_text(&text, &name, base),
        _ => of_map(path),
    }
}

/// The warnings about the text of a file called `name`, as [`of_file`]. The files that it names are relative to `base`.
#[must_use]
pub fn of_text(text: &str, name: &str, base: &Path) -> Vec<Mistake> {
    find(text, name, base).unwrap_or_default()
}

/// None about a file with mistakes.
fn find(text: &str, name: &str, base: &Path) -> Option<Vec<Mistake>> {
    let mut facts = Facts::of(text, name, base);
    let mut warnings = match kind(text) {
        Kind::Map => {
            let map = MapFile::parse(text.as_bytes().to_vec(), Path::new(name), None).ok()?;
            room::of_map(&facts, &map.floor)
        }
        Kind::Robot => {
            robot_file::parse(text, name).ok()?;
            of_facts(&facts)
        }
        Kind::Scenario => {
            facts.scenario = Some(Box::new(Scenario::parse(text, name, base).ok()?));
            let mut warnings = of_facts(&facts);
            warnings.extend(room::of_scenario(&facts));
            warnings
        }
    };
    warnings.sort_by(|a, b| (a.file(), a.line()).cmp(&(b.file(), b.line())));
    Some(warnings)
}

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// With a path.
    Scenario,
    /// With wheels, and without a path.
    Robot,
    /// Any other.
    Map,
}

/// The kind of a file by its tables. That of a text that cannot be read is a map.
#[must_use]
pub fn kind(text: &str) -> Kind {
    let Ok(document) = Document::parse(text, "") else { return Kind::Map };
    if document.has("path") || document.has("truth") {
        Kind::Scenario
    } else if document.has("drive") || document.has("sonar") {
        Kind::Robot
    } else {
        Kind::Map
    }
}

/// The improbable values of a file with mistakes, besides them: one of them may be the cause of a mistake.
pub(crate) fn suspects(text: &str, name: &str, mistakes: &[Mistake]) -> Vec<Mistake> {
    if mistakes.is_empty() {
        return Vec::new();
    }
    let is_known =
        |warning: &Mistake| mistakes.iter().any(|mistake| mistake.key().starts_with(warning.key()));
    let warnings = of_facts(&Facts::of_one(text, name)).into_iter();
    warnings.filter(|warning| !is_known(warning)).map(Mistake::suspected).collect()
}

fn is_csv(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"))
}

/// The warnings about the walls of a map that is no TOML.
fn of_map(path: &Path) -> Vec<Mistake> {
    let Ok(map) = MapFile::read(path, None) else { return Vec::new() };
    let lines = (0..map.floor.named_walls().len()).map(|wall| map.line(wall).unwrap_or(1));
    room::of_map(&Facts::of_walls(map.name(), lines), &map.floor)
}

fn of_facts(facts: &Facts) -> Vec<Mistake> {
    let mut warnings = Vec::new();
    let mut warn = |fact: &Fact, message: String| {
        if facts.report(fact) {
            warnings.push(fact.warn(message));
        }
    };
    for fact in ANGLES.iter().flat_map(|id| facts.with(id)) {
        if let Some(message) = radians(fact) {
            warn(fact, message);
        }
    }
    // A value that is wrong by itself is not compared with others.
    let is_first = |rule: &&rule::Rule| matches!(rule.measure, Measure::Value);
    let (first, second): (Vec<&rule::Rule>, Vec<&rule::Rule>) = RULES.iter().partition(is_first);
    for rule in first.into_iter().chain(second) {
        for fact in facts.with(rule.key) {
            if let Some(message) = rule.judge(facts, fact) {
                warn(fact, message);
            }
        }
    }
    warnings
}

/// The message for an angle in degrees whose number is a usual one in radians: a multiple of 15° with two decimals.
fn radians(fact: &Fact) -> Option<String> {
    let (number, unit) = ANGLE.split(&fact.text)?;
    let steps = number.to_degrees() / 15.0;
    let decimals = fact.text.split('.').nth(1)?.chars().take_while(char::is_ascii_digit).count();
    let precision = 0.6 * 10_f64.powi(-i32::try_from(decimals).ok()?);
    let distance = ((steps.round() * 15.0).to_radians() - number).abs();
    let is_radians = unit == "deg" && decimals >= 2 && steps.round().abs() >= 1.0;
    (is_radians && number.abs() < 3.2 && distance < precision).then(|| {
        let degrees = 15.0 * steps.round();
        format!(
            "{} is {degrees} degrees in radians; did you mean {}?",
            fact.quoted(),
            fact.quoted_as(&format!("{degrees} deg"))
        )
    })
}

/// What a value that its reader refuses was probably meant to be, as it is written in a file.
pub(crate) fn meant(key: &str, text: &str, is_number: bool) -> Option<String> {
    let fact = Fact::refused(key, text, is_number);
    RULES.iter().filter(|rule| rule.key == fact.id).find_map(|rule| rule.suggestion(&fact))
}

/// The table of the rules for `docs/formats.md`.
#[must_use]
pub fn table() -> String {
    let row = |rule: &rule::Rule| {
        let per = match rule.measure {
            Measure::Value => String::new(),
            Measure::Per(name, _) => format!(" times {name}"),
            Measure::Other(_) => " (computed)".to_owned(),
        };
        let (least, most) = rule.usual;
        let (key, what, source) = (rule.key, rule.what, rule.source);
        format!("| `{key}` | {what} | {least} to {most}{per} | {source} |\n")
    };
    let rows: String = RULES.iter().map(row).collect();
    format!("| key | quantity | usual | why |\n|---|---|---|---|\n{rows}")
}
