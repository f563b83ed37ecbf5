//! The reference: the true poses of the robot, read in step with the log.

use std::io::BufRead;

use sonarfix_sim::angle;
use sonarfix_sim::trace::Pose;

use crate::fault::{Fault, ReplayError, Source};
use crate::lines::Lines;
use crate::log::{Fields, Malformed};

/// The first line of a reference.
pub const HEADER: &str = "time_s,x_m,y_m,heading_rad";

/// Largest gap between rows that is interpolated, microseconds.
const GAP: i64 = 2_000_000;

/// The pose of the robot at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Microseconds of the log's clock.
    pub time: i64,
    /// The pose.
    pub pose: Pose,
}

/// A reference file; only two rows are held in memory.
#[derive(Debug)]
pub struct Reference<R> {
    lines: Lines<R>,
    taken: Option<Row>,
    next: Option<Row>,
}

impl<R: BufRead> Reference<R> {
    /// Opens a reference. [`Self::read`] reads its first row.
    ///
    /// # Errors
    /// [`ReplayError`] if it cannot be read or is not a reference.
    pub fn open(reader: R) -> Result<Self, ReplayError> {
        let mut lines = Lines::of(reader);
        expect_header(&mut lines, Source::Reference, HEADER)?;
        Ok(Self { lines, taken: None, next: None })
    }

    /// Advances by one row.
    ///
    /// # Errors
    /// [`ReplayError`] if the file cannot be read, or the error that `complain` returns for a row
    /// that is skipped.
    pub fn read(
        &mut self,
        mut complain: impl FnMut(u64, Fault) -> Result<(), ReplayError>,
    ) -> Result<(), ReplayError> {
        self.taken = self.next.take().or(self.taken);
        while self.next.is_none() {
            let row = match self.lines.next() {
                Err(error) => return Err(ReplayError::Read(Source::Reference, error)),
                Ok(None) => return Ok(()),
                Ok(Some(line)) => line.and_then(parse),
            };
            match row {
                Ok(None) => {}
                Ok(Some(row)) if self.taken.is_some_and(|taken| row.time < taken.time) => {
                    complain(self.lines.number(), Fault::TimeWentBack)?;
                }
                Ok(Some(row)) => self.next = Some(row),
                Err(malformed) => complain(self.lines.number(), malformed.into())?,
            }
        }
        Ok(())
    }

    /// The next row.
    pub fn next(&self) -> Option<Row> {
        self.next
    }

    /// The interpolated pose at a time between the last row and the next.
    pub fn pose_at(&self, time: i64) -> Option<Pose> {
        let taken = self.taken?;
        if time == taken.time {
            return Some(taken.pose);
        }
        let next = self.next?;
        let within = taken.time < time && time <= next.time && next.time - taken.time <= GAP;
        within.then(|| {
            let share = seconds(time - taken.time) / seconds(next.time - taken.time);
            let (from, to) = (taken.pose, next.pose);
            Pose {
                x: from.x + share * (to.x - from.x),
                y: from.y + share * (to.y - from.y),
                heading: angle::wrap(from.heading + share * angle::wrap(to.heading - from.heading)),
            }
        })
    }
}

/// Reads the first line of a file, which identifies its format.
pub(super) fn expect_header<R: BufRead>(
    lines: &mut Lines<R>,
    source: Source,
    header: &'static str,
) -> Result<(), ReplayError> {
    let first = lines.next().map_err(|error| ReplayError::Read(source, error))?;
    match first {
        Some(Ok(line)) if line.trim() == header => Ok(()),
        _ => Err(ReplayError::Header(source, header)),
    }
}

fn parse(line: &str) -> Result<Option<Row>, Malformed> {
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    let mut fields = Fields::of(line);
    let row = Row {
        time: micros(fields.time()?),
        pose: Pose {
            x: fields.number("x")?,
            y: fields.number("y")?,
            heading: angle::wrap(fields.number("heading")?),
        },
    };
    fields.end()?;
    Ok(Some(row))
}

/// A time of a log in microseconds.
#[expect(clippy::cast_possible_truncation, reason = "the log format keeps times below 1e10 s")]
pub(super) fn micros(seconds: f64) -> i64 {
    (seconds * 1e6).round() as i64
}

/// A span of microseconds in seconds.
#[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs, 285 years")]
pub(super) fn seconds(micros: i64) -> f64 {
    micros as f64 * 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(text: &str) -> Reference<&[u8]> {
        Reference::open(text.as_bytes()).unwrap()
    }

    #[test]
    fn rows_are_read_one_by_one_with_their_errors() {
        let text = format!("{HEADER}\n1,2,3,0.5\n\n# no row\n0.5,0,0,0\n2,x,0,0\n3,4,5\n4,5,6,7\n");
        let mut reference = open(&text);
        let mut complaints = Vec::new();
        let mut times = Vec::new();
        loop {
            reference
                .read(|line, fault| {
                    complaints.push((line, fault.to_string()));
                    Ok(())
                })
                .unwrap();
            let Some(row) = reference.next() else { break };
            times.push(row.time);
        }
        assert_eq!(times, [1_000_000, 4_000_000]);
        let lines: Vec<u64> = complaints.iter().map(|(line, _)| *line).collect();
        assert_eq!(lines, [5, 6, 7], "{complaints:?}");
    }

    #[test]
    fn the_heading_is_interpolated_along_the_smaller_angle() {
        let text = format!("{HEADER}\n0,0,0,3.1\n1,2,4,-3.1\n9,0,0,0\n");
        let mut reference = open(&text);
        reference.read(|_, _| Ok(())).unwrap();
        assert_eq!(reference.pose_at(0), None, "nothing was taken yet");
        reference.read(|_, _| Ok(())).unwrap();
        let middle = reference.pose_at(500_000).unwrap();
        assert!((middle.x - 1.0).abs() < 1e-12 && (middle.y - 2.0).abs() < 1e-12);
        assert!((middle.heading.abs() - std::f64::consts::PI).abs() < 1e-12);
        reference.read(|_, _| Ok(())).unwrap();
        assert_eq!(reference.pose_at(2_000_000), None, "eight seconds are a gap");
    }

    #[test]
    fn another_file_is_no_reference() {
        assert!(Reference::open("time,x,y,heading\n".as_bytes()).is_err());
        assert!(Reference::open("".as_bytes()).is_err());
    }
}
