//! Faults that the records show without a replay, read in one pass.

mod clock;
mod ranges;
mod wheel;

use sonarfix_hal::config::RobotConfig;

use crate::diagnosis::finding::Finding;
use crate::diagnosis::recording::{Entry, Recording};
use crate::log::{Malformed, Record};
use clock::Clock;
use ranges::Ranges;
use wheel::Wheel;

/// Encoder records of a robot that stands.
const STANDING: u64 = 20;

/// What has been seen.
pub struct Visible<'a> {
    robot: &'a RobotConfig,
    clock: Clock,
    right: Wheel,
    left: Wheel,
    ranges: Ranges,
}

impl<'a> Visible<'a> {
    pub fn new(robot: &'a RobotConfig) -> Self {
        let [right, left] = [&robot.right_wheel, &robot.left_wheel].map(|wheel| {
            let per_count = f64::from(wheel.travel_per_edge.0);
            Wheel::new(per_count, f64::from(robot.localizer.max_wheel_speed.0))
        });
        Self { robot, clock: Clock::default(), right, left, ranges: Ranges::default() }
    }

    /// Takes the next record.
    pub fn see(&mut self, entry: &Entry) {
        let line = entry.line;
        match entry.record {
            #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
            Record::Ticks { time, right, left } => {
                let unit = [&self.right, &self.left].map(|wheel| wheel.per_count);
                let wheels = [&self.robot.right_wheel, &self.robot.left_wheel];
                let [by_right, by_left] = wheels.map(|it| if it.is_mirrored { -1.0 } else { 1.0 });
                let counts = [by_right * right as f64, by_left * left as f64];
                self.wheels(line, time, counts, unit, true);
            }
            Record::Wheels { time, right, left } => {
                self.wheels(line, time, [right, left], [1.0; 2], false);
            }
            Record::Range { time, bearing, range, .. } => {
                let moved = self.right.travelled + self.left.travelled;
                let width = f64::from(self.robot.localizer.drive.track_width.0);
                let heading = (self.right.signed - self.left.signed) / width;
                self.clock.range(line, time);
                self.ranges.add(line, time, bearing + heading, range, moved);
            }
            _ => {}
        }
    }

    fn wheels(&mut self, line: u64, time: f64, values: [f64; 2], unit: [f64; 2], are_counts: bool) {
        let elapsed = self.clock.encoders(line, time);
        let [right, left] = values;
        let before = [self.right.travelled, self.left.travelled];
        self.right.add(line, time, right, unit[0], elapsed, are_counts);
        self.left.add(line, time, left, unit[1], elapsed, are_counts);
        // A robot that turns about a standing wheel drives the other one around it.
        let circle =
            1.5 * std::f64::consts::TAU * f64::from(self.robot.localizer.drive.track_width.0);
        self.right.stand(line, time, self.left.travelled - before[1], circle);
        self.left.stand(line, time, self.right.travelled - before[0], circle);
    }

    /// What is wrong.
    pub fn findings(&self, recording: &Recording) -> Vec<Finding> {
        let mut findings = Vec::new();
        findings.extend(malformed(recording));
        self.clock.findings(self.robot, &mut findings);
        self.right.findings("right", &mut findings);
        self.left.findings("left", &mut findings);
        let travelled = self.right.travelled + self.left.travelled;
        self.ranges.findings(self.robot, travelled, &mut findings);
        if travelled == 0.0 && self.clock.records > STANDING && self.ranges.spread() > 0.3 {
            findings.push(Finding::new(
                "encoders_stopped",
                format!(
                    "both encoders always have the same value, although the ranges change by {:.1} m",
                    self.ranges.spread()
                ),
                "check the encoders' supply and cables, and the columns of the log".to_owned(),
            ));
        }
        findings
    }

    /// Ranges that have nothing to do with each other, if no cause explains them.
    pub fn noise(&self) -> Option<Finding> {
        self.ranges.noise()
    }
}

/// Lines that are no records.
fn malformed(recording: &Recording) -> Option<Finding> {
    let skipped = &recording.skipped;
    let (line, malformed) = skipped.first.as_ref()?;
    (*malformed != Malformed::Changed).then(|| {
        Finding::at(
            *line,
            "malformed_lines",
            format!(
                "{} of {} lines are no records; the first: {malformed}",
                skipped.lines, recording.lines
            ),
            "correct the program that writes the log (docs/formats.md)".to_owned(),
        )
    })
}

/// A log whose checksums do not match.
pub fn edited(recording: &Recording) -> Option<Finding> {
    let (line, malformed) = recording.skipped.first.as_ref()?;
    (*malformed == Malformed::Changed).then(|| {
        Finding::at(
            *line,
            "edited",
            malformed.to_string(),
            "use the log as it was recorded, or remove its checksum lines after an intended change"
                .to_owned(),
        )
    })
}
