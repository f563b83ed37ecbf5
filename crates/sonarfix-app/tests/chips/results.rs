//! What the scenarios measure: printed, and rows of the tables that `cargo xtask chips --write` writes.

use std::fmt::Display;
use std::fs::OpenOptions;
use std::io::Write;

use crate::pico::Polls;

/// The file to which the rows are added, if there is one.
const FILE: &str = "SONARFIX_CHIPS_ROWS";
/// The most instructions of a poll of a robot that drives: 1.04 ms, by which the motor code is late.
const LONGEST_POLL: u64 = 130_000;

/// A table of the page, by its name in `xtask/src/chips.rs`.
#[derive(Debug, Clone, Copy)]
pub enum Table {
    Measured,
    Polls,
    Drives,
    Cuts,
}

/// Adds a row.
pub fn row(table: Table, cells: &[&dyn Display]) {
    let cells: Vec<String> = cells.iter().map(ToString::to_string).collect();
    let row = format!("{table:?}: | {} |", cells.join(" | "));
    println!("{row}");
    if let Some(file) = std::env::var_os(FILE) {
        let mut file = OpenOptions::new().append(true).create(true).open(file).unwrap();
        writeln!(file, "{row}").unwrap();
    }
}

/// Reports the polls of a scenario, and compares the longest one with its limit.
pub fn polls(scenario: &str, polls: Polls) {
    let Polls { count, driving, waiting } = polls;
    row(Table::Polls, &[&scenario, &count, &driving, &waiting]);
    assert!(count > 0 && driving <= LONGEST_POLL, "{scenario}: {polls:?}");
}
