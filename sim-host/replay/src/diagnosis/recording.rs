//! The beginning of a log in memory, on which the causes are tried.

use std::io::BufRead;

use sonarfix_sim::trace::Pose;

use crate::fault::{ReplayError, Source};
use crate::lines::Lines;
use crate::log::{self, Malformed, Record};
use crate::reference;

/// The most records that are held: ten minutes of a robot with 10 encoder records and 5 ranges a second.
const MOST_RECORDS: usize = 10_000;
/// The most beams of all their scans.
const MOST_BEAMS: usize = 1 << 20;

/// A record with the line that it is from.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The line of the log, from 1.
    pub line: u64,
    pub record: Record,
}

/// Lines that are no records.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Skipped {
    pub lines: u64,
    /// Those whose range is a number that programs write instead of no echo.
    pub placeholders: u64,
    /// The first of them, and what is wrong with it.
    pub first: Option<(u64, Malformed)>,
}

impl Skipped {
    fn add(&mut self, line: u64, malformed: Malformed) {
        self.lines += 1;
        self.placeholders += u64::from(is_placeholder(&malformed));
        // A checksum of other lines is the mark of an edited log: what was edited says more.
        let is_better = |(_, first): &(u64, Malformed)| {
            *first == Malformed::Changed && malformed != Malformed::Changed
        };
        if self.first.as_ref().is_none_or(is_better) {
            self.first = Some((line, malformed));
        }
    }
}

/// Whether a range is a number that programs write instead of no echo.
fn is_placeholder(malformed: &Malformed) -> bool {
    let Malformed::Field { field: "range", text, .. } = malformed else { return false };
    text.trim().parse().is_ok_and(|value: f64| [0.0, -1.0].contains(&value))
}

/// What is read of a log.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// The first records; those of a longer log are not held.
    pub entries: Vec<Entry>,
    pub skipped: Skipped,
    /// All lines.
    pub lines: u64,
}

impl Recording {
    /// Reads a log, and passes each record to `visit`.
    ///
    /// # Errors
    /// [`ReplayError`], if it cannot be read or is of another format.
    pub fn read(log: impl BufRead, mut visit: impl FnMut(&Entry)) -> Result<Self, ReplayError> {
        let mut lines = Lines::of(log);
        reference::expect_header(&mut lines, Source::Log, log::HEADER)?;
        let mut recording = Self::default();
        let mut beams = 0;
        loop {
            let line = lines.next().map_err(|error| ReplayError::Read(Source::Log, error))?;
            let Some(parsed) = line.map(|line| line.and_then(log::parse)) else { break };
            let number = lines.number();
            let record = match parsed {
                Ok(None) => continue,
                Ok(Some(record)) => record,
                Err(malformed) => {
                    recording.skipped.add(number, malformed);
                    continue;
                }
            };
            let entry = Entry { line: number, record };
            visit(&entry);
            if let Record::Scan { scan, .. } = &entry.record {
                beams += scan.ranges.len();
            }
            if recording.entries.len() < MOST_RECORDS && beams <= MOST_BEAMS {
                recording.entries.push(entry);
            }
        }
        recording.lines = lines.number();
        Ok(recording)
    }

    /// Replaces the start.
    pub fn start_at(&mut self, pose: Pose) {
        self.entries
            .retain(|it| !matches!(it.record, Record::Start { .. } | Record::Resume { .. }));
        let time = self.entries.first().map_or(0.0, |entry| entry.record.time());
        let (position_deviation, heading_deviation) = GIVEN;
        let record = Record::Start { time, pose, position_deviation, heading_deviation };
        self.entries.insert(0, Entry { line: 0, record });
    }
}

/// Deviations of a start that somebody has measured: metres, radians.
const GIVEN: (f64, f64) = (0.05, 0.05);

/// The share of the whole way that the robot drives between two pings in one direction that are both used.
const APART: f64 = 0.005;
/// A ping in another direction is used, too, radians.
const OTHER_DIRECTION: f64 = 0.5;

/// The records without the pings that say little new: a robot that hardly moves between two of them could as well stand still
/// or drive the other way.
pub fn thinned(entries: &[Entry]) -> Vec<Entry> {
    let whole = way(entries).last().copied().unwrap_or(0.0);
    let mut last: Option<(f64, f64)> = None;
    let is_new = |(entry, way): &(&Entry, f64)| {
        let Record::Range { bearing, .. } = entry.record else { return true };
        let is_new = last.is_none_or(|(used, at)| {
            way - used >= APART * whole || (bearing - at).abs() > OTHER_DIRECTION
        });
        if is_new {
            last = Some((*way, bearing));
        }
        is_new
    };
    let ways = way(entries);
    entries.iter().zip(ways).filter(is_new).map(|(entry, _)| entry.clone()).collect()
}

/// The way of both wheels at each record, in counts or metres.
fn way(entries: &[Entry]) -> Vec<f64> {
    let (mut way, mut last) = (0.0, None);
    let add = |entry: &Entry| {
        let wheels = match entry.record {
            #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
            Record::Ticks { right, left, .. } => [right as f64, left as f64],
            Record::Wheels { right, left, .. } => [right, left],
            _ => return way,
        };
        let before: [f64; 2] = last.replace(wheels).unwrap_or(wheels);
        way += (wheels[0] - before[0]).abs() + (wheels[1] - before[1]).abs();
        way
    };
    entries.iter().map(add).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torn_line_that_ends_in_a_zero_is_no_number_instead_of_an_echo() {
        let mut skipped = Skipped::default();
        let range = |text: &str| Malformed::Field {
            field: "range",
            text: text.to_owned(),
            rule: "a positive number",
        };
        skipped.add(2, range("0."));
        skipped.add(3, Malformed::Missing("time"));
        skipped.add(4, Malformed::UnknownKind("ran".to_owned()));
        assert_eq!((skipped.placeholders, skipped.lines), (1, 3));
        skipped.add(5, range("-1"));
        assert_eq!(skipped.placeholders, 2);
    }
}
