//! A trace as a CSV file: one line per instant, every column named with its unit
//! (`docs/formats.md`).

use std::io::{Read, Write};

use anyhow::{Context, bail, ensure};
use sonarfix_sim::trace::Trace;

use crate::row::{self, Kind, Row, Sink, Value, columns};

/// Writes a trace. The first line is the start, if it is known. A measurement cycle is in the line of the first tick at or after it, and so is a
/// measurement from outside; several before one tick have a line each, with the same state. Unknown values are empty cells.
///
/// # Errors
/// Errors of the writer.
pub fn write(trace: &Trace, out: impl Write) -> anyhow::Result<()> {
    let mut csv = Lines { csv: csv::Writer::from_writer(out) };
    csv.csv.write_record(columns().map(|(name, _)| name))?;
    row::pass(trace, &mut csv)?;
    csv.csv.flush()?;
    Ok(())
}

struct Lines<W: Write> {
    csv: csv::Writer<W>,
}

impl<W: Write> Sink for Lines<W> {
    fn take(&mut self, row: &Row) -> anyhow::Result<()> {
        Ok(self.csv.write_record(row.values().iter().map(text))?)
    }
}

/// Reads a trace; passes each row on.
///
/// # Errors
/// If it is not a trace of this version, with the line.
pub fn read(file: impl Read, sinks: &mut [&mut dyn Sink]) -> anyhow::Result<u64> {
    let mut reader = csv::Reader::from_reader(file);
    let names: Vec<&str> = columns().map(|(name, _)| name).collect();
    ensure!(reader.headers()?.iter().eq(names), "the columns are not those of a trace");
    let mut count = 0;
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        let values = record.iter().zip(columns()).map(|(cell, column)| value(cell, column));
        let values: anyhow::Result<_> = values.collect();
        let row = Row::of_values(values.with_context(|| format!("line {line}"))?)?;
        ensure!(row.real("time_s").is_some(), "line {line}: the time is missing");
        for sink in &mut *sinks {
            sink.take(&row)?;
        }
        count += 1;
    }
    Ok(count)
}

fn value(cell: &str, (name, kind): (&str, Kind)) -> anyhow::Result<Value> {
    if cell.is_empty() {
        return Ok(Value::Unknown);
    }
    Ok(match kind {
        Kind::Text => Value::Text(cell.to_owned()),
        Kind::Whole => {
            Value::Whole(cell.parse().with_context(|| format!("{name}: `{cell}` is no number"))?)
        }
        Kind::Real => match cell.parse::<f64>() {
            Ok(number) if number.is_finite() => Value::Real(number),
            _ => bail!("{name}: `{cell}` is no finite number"),
        },
    })
}

fn text(value: &Value) -> String {
    match value {
        Value::Real(value) => cell(*value),
        Value::Whole(value) => value.to_string(),
        Value::Text(text) => text.clone(),
        Value::Unknown => String::new(),
    }
}

fn cell(value: f64) -> String {
    // Nine digits identify any f32.
    let text = format!("{value:.9}");
    let trimmed = text.trim_end_matches('0').trim_end_matches('.');
    if value != 0.0 && value.abs() < 1e-4 { format!("{value:.8e}") } else { trimmed.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_sim::trace::{
        AbsoluteRecord, Estimate, FixRecord, GyroEstimate, Outcome, Pose, Tick, Why,
    };

    fn tick(time: f64) -> Tick {
        Tick {
            time,
            truth: None,
            estimate: Estimate::default(),
            bound: None,
            odometry: Pose::default(),
        }
    }

    fn fix(time: f64) -> FixRecord {
        FixRecord {
            ranger: 0,
            time,
            wall: None,
            sonar: [0.0, 0.0],
            direction: 0.0,
            bearing: 0.5,
            range: Some(1.25),
            source: None,
            why: Some(Why { gain: 2e-6, success: 0.75, seconds: 0.25, candidates: 3 }),
            outcome: Outcome::Downweighted,
            association: Some(0.25),
            reason: "no wall, \"none\"".to_owned(),
            innovation: None,
            innovation_variance: None,
        }
    }

    #[test]
    fn every_tick_and_every_fix_has_its_line() {
        let trace = Trace {
            start: Some(tick(0.0)),
            ticks: [0.1, 0.2, 0.3].map(tick).to_vec(),
            searches: Vec::new(),
            fixes: [0.15, 0.2, 0.3].map(fix).to_vec(),
            ..Trace::default()
        };
        let mut out = Vec::new();
        write(&trace, &mut out).unwrap();
        let mut reader = csv::Reader::from_reader(out.as_slice());
        let names: Vec<_> = columns().map(|(name, _)| name).collect();
        assert_eq!(reader.headers().unwrap(), &names[..]);
        let lines: Vec<_> = reader.records().map(Result::unwrap).collect();
        let times: Vec<_> = lines.iter().map(|l| (l[0].to_owned(), l[35].to_owned())).collect();
        let expected = [("0", ""), ("0.1", ""), ("0.2", "0.15"), ("0.2", "0.2"), ("0.3", "0.3")];
        assert_eq!(times, expected.map(|(t, f)| (t.to_owned(), f.to_owned())));
        assert_eq!([&lines[2][23], &lines[2][24]], ["tracking", "0"]);
        assert_eq!(
            [44, 45, 46].map(|c| &lines[2][c]),
            ["downweighted", "0.25", "no wall, \"none\""]
        );
        let why = [40, 41, 42, 43].map(|column| &lines[2][column]);
        assert_eq!(why, ["2.00000000e-6", "0.75", "0.25", "3"]);
    }

    /// A gyro and measurements from outside: two of them before one tick have a line each.
    #[test]
    fn a_gyro_and_measurements_from_outside_have_their_columns() {
        let absolute = |time: f64, position, heading| AbsoluteRecord {
            time,
            position,
            heading,
            outcome: Outcome::Gated,
            reason: String::new(),
            nis: Some(20.5),
        };
        let mut with_gyro = tick(0.3);
        with_gyro.estimate.gyro = Some(GyroEstimate { bias: 0.02, deviation: 0.001, slips: 2 });
        let absolutes = [absolute(0.21, None, Some(-1.5)), absolute(0.25, Some([1.0, 2.0]), None)];
        let trace = Trace {
            ticks: [tick(0.2), with_gyro].to_vec(),
            fixes: [fix(0.3)].to_vec(),
            absolutes: absolutes.to_vec(),
            ..Trace::default()
        };
        let mut out = Vec::new();
        write(&trace, &mut out).unwrap();
        let mut reader = csv::Reader::from_reader(out.as_slice());
        let lines: Vec<_> = reader.records().map(Result::unwrap).collect();
        assert_eq!(lines.len(), 3);
        assert_eq!([31, 32, 33, 34].map(|c| &lines[0][c]), ["", "", "", ""]);
        assert_eq!([31, 32, 33, 34].map(|c| &lines[1][c]), ["", "0.02", "0.001", "2"]);
        let of = |line: usize| [35, 52, 53, 54, 55, 56, 58].map(|c| lines[line][c].to_owned());
        assert_eq!(of(1), ["0.3", "0.21", "", "", "-1.5", "gated", "20.5"]);
        assert_eq!(of(2), ["", "0.25", "1", "2", "", "gated", "20.5"]);
    }

    #[test]
    fn cells_have_nine_significant_digits() {
        assert_eq!([0.0, -20.0, 0.5, 2e-4].map(cell), ["0", "-20", "0.5", "0.0002"]);
        assert_eq!(cell(5.6e-5), "5.60000000e-5");
    }
}
