//! The values of a sweep: a list, or a range.

use std::str::FromStr;

use anyhow::{Context, ensure};

/// A key of a scenario or robot file, and its values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sweep {
    /// The key, like `sonar.noise`.
    pub key: String,
    /// The values, as in the file.
    pub values: Vec<String>,
}

impl FromStr for Sweep {
    type Err = anyhow::Error;

    /// Reads `KEY=A,B,…` or `KEY=A..B:N`, N equidistant values from A to B.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        let form = "a sweep is KEY=A,B,… or KEY=A..B:N, like sonar.noise=2mm..10mm:5";
        let (key, values) = text.split_once('=').context(form)?;
        let values = match values.split_once("..") {
            Some((from, rest)) => {
                let (to, count) = rest.rsplit_once(':').context(form)?;
                range(from, to, count.trim().parse().context(form)?)?
            }
            None => values.split(',').map(|value| value.trim().to_owned()).collect(),
        };
        ensure!(!key.trim().is_empty() && values.iter().all(|value| !value.is_empty()), form);
        Ok(Self { key: key.trim().to_owned(), values })
    }
}

/// Equidistant values, both ends included.
fn range(from: &str, to: &str, count: u32) -> anyhow::Result<Vec<String>> {
    let ((first, unit), (last, other_unit)) = (quantity(from)?, quantity(to)?);
    ensure!(unit == other_unit, "{from} and {to} have different units");
    ensure!(count > 1, "a range has at least two values");
    let value = |n: u32| {
        let value = first + (last - first) * f64::from(n) / f64::from(count - 1);
        // Without the digits of rounding.
        let value: f64 = format!("{value:.12e}").parse()?;
        Ok(format!("{value} {unit}").trim_end().to_owned())
    };
    (0..count).map(value).collect()
}

/// The number and the unit of a quantity.
fn quantity(text: &str) -> anyhow::Result<(f64, &str)> {
    let text = text.trim();
    let ends = (1..=text.len()).rev().filter(|&end| text.is_char_boundary(end));
    let parts = ends.map(|end| text.split_at(end));
    let mut numbers = parts.filter_map(|(number, unit)| Some((number.parse().ok()?, unit.trim())));
    let found: Option<(f64, &str)> = numbers.find(|(number, _): &(f64, &str)| number.is_finite());
    found.with_context(|| format!("\"{text}\" is not a number with its unit"))
}

impl Sweep {
    /// The position of a value on an axis: the number, or its place in the list.
    pub fn place(&self, value: &str) -> f64 {
        if self.is_numeric() {
            return quantity(value).map_or(0.0, |(number, _)| number);
        }
        let place = self.values.iter().position(|held| held == value).unwrap_or_default();
        u32::try_from(place).map_or(0.0, f64::from)
    }

    /// The label of an axis: the key with the unit, or with the numbers of the values.
    pub fn label(&self) -> String {
        if self.is_numeric() {
            let unit = self.values.first().and_then(|value| quantity(value).ok());
            return match unit {
                Some((_, unit)) if !unit.is_empty() => format!("{} ({unit})", self.key),
                _ => self.key.clone(),
            };
        }
        let numbered = self.values.iter().enumerate().map(|(n, value)| format!("{n}: {value}"));
        format!("{} ({})", self.key, numbered.collect::<Vec<_>>().join(", "))
    }

    /// Whether all values are numbers of one unit.
    fn is_numeric(&self) -> bool {
        let units: Vec<_> = self.values.iter().map(|value| quantity(value).ok()).collect();
        let unit = |quantity: &Option<(f64, &str)>| quantity.map(|(_, unit)| unit.to_owned());
        let first = units.first().and_then(unit);
        first.is_some() && units.iter().all(|other| unit(other) == first)
    }
}

/// All combinations of the values; the last key changes fastest.
pub fn combinations(sweeps: &[Sweep]) -> Vec<Vec<(String, String)>> {
    sweeps.iter().fold(vec![Vec::new()], |combinations, sweep| {
        let with = |held: &Vec<(String, String)>, value: &String| {
            let mut longer = held.clone();
            longer.push((sweep.key.clone(), value.clone()));
            longer
        };
        let longer =
            combinations.iter().flat_map(|held| sweep.values.iter().map(move |v| with(held, v)));
        longer.collect()
    })
}
