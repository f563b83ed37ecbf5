//! Rows as CSV: the plan in a comment, the names of the columns, a line per run. Numbers are written with the digits that
//! identify them, so that they are read back to the bit. The last cell of a line is the checksum of the cells before it, so
//! that a line which is torn is not taken for a whole one.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufRead, BufReader, Read as _, Write};
use std::path::Path;

use anyhow::{Context, ensure};
use sonarfix_files::{Checksum, Output};
use sonarfix_sim::row::{COUNTS, REALS, Row};

use crate::plan::{Plan, Rows};

/// The names of the columns.
#[must_use]
pub fn names() -> String {
    let names = std::iter::once("seed").chain(COUNTS).chain(REALS).chain(["checksum"]);
    names.collect::<Vec<_>>().join(",")
}

/// The line of a row, with its end.
#[must_use]
pub fn line(row: &Row) -> String {
    let mut line = row.seed.to_string();
    for count in row.counts {
        // Writing to a string does not fail.
        let _ = write!(line, ",{count}");
    }
    for real in row.reals {
        let _ = write!(line, ",{real:?}");
    }
    let sum = Checksum::of(&line);
    let _ = writeln!(line, ",{sum}");
    line
}

/// Reads a line with its end.
///
/// # Errors
/// If it is not a whole row.
pub fn parse(line: &str) -> anyhow::Result<Row> {
    let line = line.strip_suffix('\n').context("it is torn: the line has no end")?;
    let (cells, sum) = line.rsplit_once(',').context("the line is too short")?;
    let is_whole = sum == Checksum::of(cells).to_string();
    ensure!(is_whole, "it is torn or changed: its checksum is another");
    let mut cells = cells.split(',');
    let mut cell = || cells.next().context("the line is too short");
    let seed = cell()?.parse().context("seed")?;
    let (mut counts, mut reals) = ([0; COUNTS.len()], [0.0; REALS.len()]);
    for (count, name) in counts.iter_mut().zip(COUNTS) {
        *count = cell()?.parse().context(name)?;
    }
    for (real, name) in reals.iter_mut().zip(REALS) {
        *real = cell()?.parse().context(name)?;
    }
    ensure!(cells.next().is_none(), "the line is too long");
    Ok(Row { seed, reals, counts })
}

/// The longest line that is read, bytes: a multiple of that of any row.
const LONGEST: u64 = 1 << 16;

/// Reads the next line with its end; empty after the last.
///
/// # Errors
/// If the file cannot be read, or the line is too long to be one of rows.
pub fn read_line(reader: &mut impl BufRead) -> anyhow::Result<String> {
    let mut line = String::new();
    let length = reader.take(LONGEST + 1).read_line(&mut line)?;
    ensure!(length as u64 <= LONGEST, "a line has more than {} KiB", LONGEST >> 10);
    Ok(line)
}

/// Opens a file: its plan, and its rows.
///
/// # Errors
/// If the file cannot be read or is no file of rows.
pub fn open(file: &Path) -> anyhow::Result<(Plan, Rows)> {
    let mut reader = BufReader::new(File::open(file)?);
    let plan = Plan::parse(read_line(&mut reader)?.trim_end())?;
    let columns = read_line(&mut reader)?;
    ensure!(columns.trim_end() == names(), "the columns are those of another version");
    let lines = std::iter::from_fn(move || {
        let line = read_line(&mut reader);
        line.map(|line| (!line.is_empty()).then_some(line)).transpose()
    });
    let rows = lines.enumerate().map(move |(run, line)| {
        let run = u32::try_from(run)?;
        let row = parse(&line?).with_context(|| format!("row {}", u64::from(run) + 1))?;
        ensure!(row.seed == plan.seed_of(run), "row {} has another seed", u64::from(run) + 1);
        Ok(row)
    });
    Ok((plan, Box::new(rows)))
}

/// Writes a file.
///
/// # Errors
/// If the file cannot be written, or a row cannot be read.
pub fn write(
    file: &Path,
    plan: &Plan,
    rows: impl Iterator<Item = anyhow::Result<Row>>,
) -> anyhow::Result<()> {
    let mut out = Output::create(file)?;
    writeln!(out, "{}\n{}", plan.line(), names())?;
    for row in rows {
        out.write_all(line(&row?).as_bytes())?;
    }
    Ok(out.finish()?)
}
