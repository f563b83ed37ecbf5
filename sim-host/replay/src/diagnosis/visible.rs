//! Faults that the records show without a replay, read in one pass.

mod bearings;
mod clock;
mod longest;
mod ranges;
mod wheel;

use sonarfix_hal::config::RobotConfig;

use crate::diagnosis::finding::Finding;
use crate::diagnosis::recording::{Entry, Recording};
use crate::log::{Malformed, Record};
use bearings::Bearings;
use clock::Clock;
use longest::Longest;
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
    bearings: Bearings,
    longest: Longest,
}

impl<'a> Visible<'a> {
    pub fn new(robot: &'a RobotConfig) -> Self {
        let [right, left] = [&robot.right_wheel, &robot.left_wheel].map(|wheel| {
            let per_count = f64::from(wheel.travel_per_edge.0);
            Wheel::new(per_count, f64::from(robot.localizer.max_wheel_speed.0))
        });
        let (clock, ranges) = (Clock::default(), Ranges::default());
        let (bearings, longest) = (Bearings::default(), Longest::default());
        Self { robot, clock, right, left, ranges, bearings, longest }
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
            Record::Range { time, bearing, range, ranger, .. } => {
                self.bearings.add(line, bearing, ranger, self.robot);
                if let Some(range) = range {
                    self.longest.add(line, range);
                }
                let moved = self.right.travelled + self.left.travelled;
                let width = f64::from(self.robot.localizer.drive.track_width.0);
                let heading = (self.right.signed - self.left.signed) / width;
                self.clock.range(line, time);
                self.ranges.add(line, time, bearing + heading, range, moved);
            }
            Record::Skip { time } | Record::Scan { time, .. } => self.ranges.alive(time),
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
        self.ranges.drive(line, time, self.right.travelled + self.left.travelled);
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
        findings.extend(self.longest.placeholder(self.max_range()));
        self.bearings.findings(&mut findings);
        let are_constant = !self.right.has_changed && !self.left.has_changed;
        if are_constant && self.clock.records > STANDING && self.ranges.spread() > 0.3 {
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

    /// What the records show of a log that no cause explains.
    pub fn unexplained(&self) -> Option<Finding> {
        self.too_fast().or_else(|| self.constant_bearing()).or_else(|| self.ranges.noise())
    }

    /// A servo whose bearings never change.
    pub fn constant_bearing(&self) -> Option<Finding> {
        self.bearings.constant(self.robot)
    }

    /// Ranges that have as little to do with each other as random numbers.
    pub fn certain_noise(&self) -> Option<Finding> {
        self.ranges.is_noise().then(|| self.ranges.noise()).flatten()
    }

    /// Ranges that are cut to a longest one, in a log that its files do not explain.
    pub fn clipped(&self) -> Option<Finding> {
        self.longest.clipped(self.max_range())
    }

    /// A number in place of no echo within the other ranges, in a log that its files do not explain.
    pub fn repeated(&self) -> Option<Finding> {
        self.longest.repeated()
    }

    fn max_range(&self) -> f64 {
        f64::from(self.robot.localizer.rangers.first.max_range.0)
    }

    /// Whether both wheels are faster than they can be again and again.
    pub fn are_too_fast(&self) -> bool {
        self.right.is_often_too_fast() && self.left.is_often_too_fast()
    }

    /// Wheels that are faster than they can be again and again.
    fn too_fast(&self) -> Option<Finding> {
        let wheels = [("right", &self.right), ("left", &self.left)];
        let mut fast = wheels.into_iter().filter(|(_, wheel)| wheel.is_often_too_fast());
        let (first, second) = (fast.next(), fast.next());
        let (side, wheel) = first?;
        let (who, drives) = match second {
            Some(_) => ("both wheels".to_owned(), "drive"),
            None => (format!("the {side} wheel"), "drives"),
        };
        let factor = wheel.excess();
        Some(Finding::new(
            "wheel_travel",
            format!("{who} {drives} up to {factor:.0} times as fast as max_wheel_speed: the travel per count or its unit is too large, or counts are lost"),
            "check diameter and edges_per_revolution of the wheels, and the unit of `wheels` records, metres".to_owned(),
        ))
    }
}

/// Lines that are no records.
fn malformed(recording: &Recording) -> Option<Finding> {
    let skipped = &recording.skipped;
    let (line, malformed) = skipped.first.as_ref()?;
    let cause = match malformed {
        Malformed::Changed => return None,
        // A torn line may end in a zero, too.
        _ if 2 * skipped.placeholders > skipped.lines => "range_placeholder",
        _ => "malformed_lines",
    };
    Some(Finding::at(
        *line,
        cause,
        format!(
            "{} of {} lines are no records; the first: {malformed}",
            skipped.lines, recording.lines
        ),
        "correct the program that writes the log (docs/formats.md)".to_owned(),
    ))
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
