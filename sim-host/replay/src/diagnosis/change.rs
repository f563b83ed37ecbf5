//! A change of a robot, a map, a start or a log, which is tried as the explanation of the log.

use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Metres;
use sonarfix::map::Wall;
use sonarfix_hal::config::RobotConfig;
use sonarfix_sim::trace::Pose;

use crate::diagnosis::recording::Entry;
use crate::diagnosis::walls::WallChange;
use crate::log::Record;
use crate::wheels;

/// Deviations of a start that the search has found: metres, radians.
const FOUND: [f64; 2] = [0.1, 0.1];
/// A smaller factor of the travel is another unit.
const LEAST_TRAVEL: f64 = 0.1;

/// Another start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    pub pose: Pose,
    /// Whether the search has found it; otherwise it is as accurate as the log says.
    pub is_found: bool,
}

/// A change; by default none. Factors multiply what the robot file, the map or the log states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// The log's right and left wheel are exchanged.
    pub is_swapped: bool,
    /// Of the travel of the right and of the left wheel; negative for a mirrored encoder.
    pub wheels: [f64; 2],
    pub track_width: f64,
    /// Factor of the wheels' noise.
    pub wheel_noise: f64,
    /// Factor of the bearings of the sonar; −1 for a mirrored servo.
    pub bearing: f64,
    /// Added to the bearings, radians.
    pub bearing_offset: f64,
    pub range: f64,
    /// Added to the ranges, metres.
    pub range_offset: f64,
    /// The delay of the ranges' times, seconds.
    pub delay: f64,
    /// Seconds by which the clock of the ranges gains on that of the encoders in a second.
    pub clock_gain: f64,
    /// By so many pings a range is older than its record.
    pub late_pings: u8,
    /// Whether the log's bearing and range are exchanged.
    pub is_exchanged: bool,
    /// Added to the mount of each ranger, metres ahead and to the left.
    pub mount: [f64; 2],
    /// The start, if it is another.
    pub start: Option<Start>,
    /// The time at which the robot was carried to another pose, and that pose.
    pub moved: Option<(f64, Pose)>,
    /// Of the start's heading.
    pub heading: f64,
    /// Added to the start's heading, radians.
    pub heading_offset: f64,
    /// The map's coordinates are multiplied by this matrix, row by row.
    pub map: [[f64; 2]; 2],
    /// Whether that is about the centre of the map instead of its origin.
    pub is_about_centre: bool,
    /// A change of a single wall.
    pub wall: Option<WallChange>,
}

impl Default for Change {
    fn default() -> Self {
        Self {
            is_swapped: false,
            wheels: [1.0; 2],
            track_width: 1.0,
            wheel_noise: 1.0,
            bearing: 1.0,
            bearing_offset: 0.0,
            range: 1.0,
            range_offset: 0.0,
            delay: 0.0,
            clock_gain: 0.0,
            late_pings: 0,
            is_exchanged: false,
            mount: [0.0; 2],
            start: None,
            moved: None,
            heading: 1.0,
            heading_offset: 0.0,
            map: [[1.0, 0.0], [0.0, 1.0]],
            is_about_centre: false,
            wall: None,
        }
    }
}

impl Change {
    /// The robot with the change.
    pub fn robot(&self, robot: &RobotConfig) -> RobotConfig {
        let mut changed = *robot;
        let width = &mut changed.localizer.drive.track_width;
        *width = single(f64::from(width.0) * self.track_width, Metres);
        let noise = &mut changed.localizer.drive.wheel_noise.0.0;
        *noise = single(f64::from(*noise) * self.wheel_noise, |noise| noise);
        // A wheel that is slower than its counts is no more accurate than they are.
        let by = 0.5 * self.wheels.iter().map(|by| by.abs()).sum::<f64>();
        if (LEAST_TRAVEL..1.0).contains(&by) {
            let drive = &mut changed.localizer.drive;
            let noises = [
                &mut drive.wheel_noise.0.0,
                &mut drive.scale_walk.0,
                &mut drive.track_width_walk.0.0,
            ];
            for noise in noises {
                *noise = single(f64::from(*noise) / by.sqrt(), |noise| noise);
            }
        }
        let [ahead, left] = self.mount;
        for ranger in changed.localizer.rangers.iter_mut() {
            let Point { x, y } = ranger.mount;
            ranger.mount = point(f64::from(x.0) + ahead, f64::from(y.0) + left);
        }
        changed
    }

    /// The map with the change. Walls that cannot be are left out.
    pub fn walls(&self, walls: &[Wall]) -> Vec<Wall> {
        let pivot = if self.is_about_centre { centre(walls) } else { [0.0; 2] };
        let moved = |of: Point| {
            let from = [f64::from(of.x.0) - pivot[0], f64::from(of.y.0) - pivot[1]];
            let [x, y] = self.map.map(|row| row[0] * from[0] + row[1] * from[1]);
            point(x + pivot[0], y + pivot[1])
        };
        let changed = |wall: &Wall| {
            let changed = Wall::new(moved(wall.from()), moved(wall.to())).ok()?;
            Some(wall.accuracy().map_or(changed, |accuracy| changed.with_accuracy(accuracy)))
        };
        let walls: Vec<_> = walls.iter().filter_map(changed).collect();
        match self.wall {
            Some(wall) => wall.of(walls),
            None => walls,
        }
    }

    /// The records with the change, in the order of their times. Encoder counts become the travel of the wheels of `robot`,
    /// and a range is of no certain wall: the robot chose one by what may be wrong.
    pub fn records(&self, entries: &[Entry], robot: &RobotConfig) -> Vec<Record> {
        let begin = entries.first().map_or(0.0, |entry| entry.record.time());
        let mut records: Vec<_> =
            entries.iter().map(|entry| self.record(&entry.record, robot, begin)).collect();
        self.advance_ranges(&mut records);
        if self.delay != 0.0 || self.clock_gain != 0.0 {
            records.sort_by(|a, b| a.time().total_cmp(&b.time()));
        }
        if let Some((time, pose)) = self.moved {
            let at = records.iter().position(|record| record.time() >= time);
            let [position_deviation, heading_deviation] = FOUND;
            let moved = Record::Pose { time, pose, position_deviation, heading_deviation };
            records.insert(at.unwrap_or(records.len()), moved);
        }
        records
    }

    /// Each record of a range gets the range that came later, of the same ranger.
    fn advance_ranges(&self, records: &mut [Record]) {
        if self.late_pings == 0 {
            return;
        }
        let all = records.iter().filter_map(|record| match record {
            Record::Range { range, ranger, .. } => Some((*ranger, *range)),
            _ => None,
        });
        let all: Vec<_> = all.collect();
        let mut own = 0;
        for record in records {
            let Record::Range { range, ranger, .. } = record else { continue };
            let later = all.get(own + 1..).unwrap_or_default().iter();
            let mut later = later.filter(|(other, _)| other == ranger);
            *range = later.nth(usize::from(self.late_pings) - 1).and_then(|(_, range)| *range);
            own += 1;
        }
    }

    /// The time of a range by the clock of the encoders.
    fn range_time(&self, time: f64, begin: f64) -> f64 {
        time - self.delay - self.clock_gain * (time - begin)
    }

    fn record(&self, record: &Record, robot: &RobotConfig, begin: f64) -> Record {
        match *record {
            #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
            Record::Ticks { time, right, left } => self
                .travel(time, wheels::of_counts(robot, self.ordered([right as f64, left as f64]))),
            Record::Wheels { time, right, left } => self.travel(time, self.ordered([right, left])),
            Record::Range { time, bearing, range: Some(range), ranger, .. }
                if self.is_exchanged =>
            {
                Record::Range { time, bearing: range, range: Some(bearing), wall: None, ranger }
            }
            Record::Range { time, bearing, range, ranger, .. } => Record::Range {
                time: self.range_time(time, begin),
                bearing: self.bearing * bearing + self.bearing_offset,
                range: range.map(|range| self.range * range + self.range_offset),
                wall: None,
                ranger,
            },
            Record::Scan { time, ref scan } => {
                let mut scan = scan.clone();
                scan.first = self.bearing * scan.first + self.bearing_offset;
                scan.step *= self.bearing;
                for range in scan.ranges.iter_mut().filter(|range| **range > 0.0) {
                    let changed = self.range * f64::from(*range) + self.range_offset;
                    *range = single(changed.max(0.0), |range| range);
                }
                Record::Scan { time: self.range_time(time, begin), scan }
            }
            Record::Skip { time } => Record::Skip { time: self.range_time(time, begin) },
            Record::Start { time, pose, position_deviation, heading_deviation } => {
                let pose = self.pose(pose);
                let stated = [position_deviation, heading_deviation];
                let [position_deviation, heading_deviation] = self.found().unwrap_or(stated);
                Record::Start { time, pose, position_deviation, heading_deviation }
            }
            Record::Resume { time, mut state, mut deviation } => {
                let [x, y, heading, ..] = state;
                let pose = self.pose(Pose { x, y, heading });
                state[..3].copy_from_slice(&[pose.x, pose.y, pose.heading]);
                if let Some([position, heading]) = self.found() {
                    deviation[..3].copy_from_slice(&[position, position, heading]);
                }
                Record::Resume { time, state, deviation }
            }
            ref other => other.clone(),
        }
    }

    fn ordered(&self, [right, left]: [f64; 2]) -> [f64; 2] {
        if self.is_swapped { [left, right] } else { [right, left] }
    }

    fn travel(&self, time: f64, [right, left]: [f64; 2]) -> Record {
        let [by_right, by_left] = self.wheels;
        Record::Wheels { time, right: by_right * right, left: by_left * left }
    }

    /// The start.
    fn pose(&self, pose: Pose) -> Pose {
        let heading = self.heading * pose.heading + self.heading_offset;
        self.start.map_or(Pose { heading, ..pose }, |start| start.pose)
    }

    /// The deviations of a start that the search has found.
    fn found(&self) -> Option<[f64; 2]> {
        self.start.filter(|start| start.is_found).map(|_| FOUND)
    }
}

/// The centre of a box around the walls, metres.
fn centre(walls: &[Wall]) -> [f64; 2] {
    let ends = || walls.iter().flat_map(|wall| [wall.from(), wall.to()]);
    [ends().map(|end| end.x.0).collect::<Vec<_>>(), ends().map(|end| end.y.0).collect()].map(
        |all| {
            let least = all.iter().copied().fold(f32::INFINITY, f32::min);
            let most = all.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            0.5 * (f64::from(least) + f64::from(most))
        },
    )
}

fn point(x: f64, y: f64) -> Point {
    Point { x: single(x, Metres), y: single(y, Metres) }
}

#[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
fn single<T>(value: f64, of: impl Fn(f32) -> T) -> T {
    of(value as f32)
}
