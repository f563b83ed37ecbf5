//! The times of the records.

use sonarfix_hal::config::RobotConfig;

use crate::diagnosis::finding::{Finding, SHOWN};
use crate::median::Median;

/// A gap in the encoder records: longer than this many intervals, and seconds.
const GAP_INTERVALS: f64 = 10.0;
const SHORTEST_GAP: f64 = 1.0;

/// From one time to another, seconds, and the line of the second one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Span {
    line: u64,
    from: f64,
    to: f64,
}

/// The times of the records.
#[derive(Debug, Default)]
pub struct Clock {
    pub records: u64,
    last: Option<f64>,
    latest: Option<f64>,
    intervals: Median,
    gaps: Vec<Span>,
    back: Option<Span>,
    backs: u64,
    repeated: u64,
}

impl Clock {
    /// Seconds since the last encoder record.
    pub fn encoders(&mut self, line: u64, time: f64) -> f64 {
        self.records += 1;
        let Some(last) = self.last.replace(time) else { return 0.0 };
        let elapsed = time - last;
        if elapsed < 0.0 {
            self.backs += 1;
            self.back.get_or_insert(Span { line, from: last, to: time });
        } else if elapsed == 0.0 {
            self.repeated += 1;
        } else {
            self.intervals.add(elapsed);
            if elapsed > SHORTEST_GAP {
                self.gap(Span { line, from: last, to: time });
            }
        }
        elapsed
    }

    /// Keeps the longest gaps.
    fn gap(&mut self, gap: Span) {
        self.gaps.push(gap);
        if self.gaps.len() > 2 * SHOWN {
            self.gaps.sort_by(|a, b| (b.to - b.from).total_cmp(&(a.to - a.from)));
            self.gaps.truncate(SHOWN);
        }
    }

    pub fn range(&mut self, line: u64, time: f64) {
        if let Some(last) = self.last
            && time < last - 1.0
            && self.latest.is_some_and(|latest| time < latest - 1.0)
        {
            self.backs += 1;
            self.back.get_or_insert(Span { line, from: last, to: time });
        }
        self.latest = Some(time);
    }

    pub fn findings(&self, robot: &RobotConfig, findings: &mut Vec<Finding>) {
        if let Some(back) = self.back {
            findings.push(Finding::at(
                back.line,
                "clock_back",
                format!(
                    "the time goes back from {:.3} s to {:.3} s, {} in the log",
                    back.from,
                    back.to,
                    times(self.backs)
                ),
                "the clock was set, a counter of it overflowed, or lines are out of order: correct the times, or split the log there"
                    .to_owned(),
            ));
        }
        if 2 * self.repeated > self.records {
            findings.push(Finding::new(
                "clock_repeats",
                format!(
                    "{} of {} encoder records have the time of the one before",
                    self.repeated, self.records
                ),
                "write the times in seconds with at least three decimals".to_owned(),
            ));
        }
        let Some(interval) = self.intervals.value() else { return };
        let expected = robot.encoder_period.to_micros();
        #[expect(clippy::cast_precision_loss, reason = "a period of seconds")]
        let expected = expected as f64 * 1e-6;
        if let Some(unit) = unit_of(interval / expected) {
            findings.push(Finding::new(
                "time_unit",
                format!(
                    "the encoders are read every {interval:.4} s by the log, and every {expected} s by the robot file: the times are probably in {unit}"
                ),
                "write the times in seconds".to_owned(),
            ));
            return;
        }
        let mut gaps: Vec<_> =
            self.gaps.iter().filter(|gap| gap.to - gap.from > GAP_INTERVALS * interval).collect();
        gaps.sort_by(|a, b| (b.to - b.from).total_cmp(&(a.to - a.from)));
        for gap in gaps.iter().take(SHOWN) {
            findings.push(Finding::at(
                gap.line,
                "clock_gap",
                format!(
                    "the encoders have no record for {:.1} s, from {:.3} s to {:.3} s; usually one every {interval:.3} s",
                    gap.to - gap.from,
                    gap.from,
                    gap.to
                ),
                "records are missing, or the clock jumped ahead: record again, or split the log there".to_owned(),
            ));
        }
    }
}

/// The unit of times that are so many times too long.
fn unit_of(ratio: f64) -> Option<&'static str> {
    let is_near = |factor: f64| (ratio / factor).ln().abs() < 0.7;
    [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds"), (1.0 / 60.0, "minutes")]
        .into_iter()
        .find(|(factor, _)| is_near(*factor))
        .map(|(_, unit)| unit)
}

fn times(count: u64) -> String {
    if count == 1 { "once".to_owned() } else { format!("{count} times") }
}
