//! The causes in words, with the corrected line.

use sonarfix::geometry::pose::Point;
use sonarfix::map::Wall;
use sonarfix_hal::config::RobotConfig;

use crate::diagnosis::causes::{CENTIMETRES_AS_INCHES, Candidate, Cause, INCHES_AS_CENTIMETRES};
use crate::diagnosis::change::Change;
use crate::diagnosis::evidence::{Broken, Evidence};
use crate::diagnosis::finding::Finding;
use crate::diagnosis::recording::Entry;
use crate::diagnosis::walls::WallChange;
use crate::log::Record;

/// A cause as a finding.
pub fn finding(
    candidate: &Candidate,
    evidence: &Evidence,
    robot: &RobotConfig,
    walls: &[Wall],
    entries: &[Entry],
) -> Finding {
    let (cause, message, remedy) = words(candidate, robot, walls);
    let line = match candidate.change.moved {
        Some((time, _)) => line_at(time, entries),
        None => candidate.is_of_start().then(|| start_line(entries)).flatten(),
    };
    Finding { cause, line, message, remedy, explained: Some(evidence.explained()) }
}

/// The name of a cause, what is wrong, and what to do.
type Words = (&'static str, String, String);

fn words(candidate: &Candidate, robot: &RobotConfig, walls: &[Wall]) -> Words {
    wheels(candidate, robot).or_else(|| sonar(candidate)).unwrap_or_else(|| place(candidate, walls))
}

/// Causes at the wheels.
fn wheels(candidate: &Candidate, robot: &RobotConfig) -> Option<Words> {
    let value = candidate.value;
    let factor = factor(value);
    let words = match candidate.cause {
        Cause::WheelsSwapped => swapped(candidate.change.wheels),
        Cause::TravelUnit => (
            "wheel_travel",
            format!("both wheels drive {value} times as far per count as the log and the robot file state: the travel is in another unit"),
            "write `wheels` records in metres, or correct the unit of the diameter or of `travel_per_edge` of both wheels".to_owned(),
        ),
        Cause::RightMirrored => ("encoder_mirrored", mirrored("right"), negate("right")),
        Cause::LeftMirrored => ("encoder_mirrored", mirrored("left"), negate("left")),
        Cause::BothMirrored => (
            "encoder_mirrored",
            "both encoders count backwards".to_owned(),
            "change the sign of both, `mirrored` of `drive.right_wheel` and of `drive.left_wheel`"
                .to_owned(),
        ),
        Cause::RightTravel => (
            "wheel_travel",
            format!("the right wheel drives {factor} as far per count as the robot file states"),
            travel("right_wheel", f64::from(robot.right_wheel.travel_per_edge.0), value),
        ),
        Cause::LeftTravel => (
            "wheel_travel",
            format!("the left wheel drives {factor} as far per count as the robot file states"),
            travel("left_wheel", f64::from(robot.left_wheel.travel_per_edge.0), value),
        ),
        Cause::Travel => (
            "wheel_travel",
            format!("both wheels drive {factor} as far per count as the robot file states"),
            format!(
                "{}; {}",
                travel("right_wheel", f64::from(robot.right_wheel.travel_per_edge.0), value),
                travel("left_wheel", f64::from(robot.left_wheel.travel_per_edge.0), value)
            ),
        ),
        Cause::WheelNoise => {
            let noise = 1e3 * f64::from(robot.localizer.drive.wheel_noise.0.0);
            (
                "wheel_noise",
                format!("the travel of the wheels is {factor} as inaccurate as the robot file states"),
                format!(
                    "drive.wheel_noise = \"{:.1} mm/sqrt(m)\" instead of \"{noise:.1} mm/sqrt(m)\"; `sonarfix calibrate` estimates it",
                    noise * value
                ),
            )
        }
        Cause::TrackWidth => {
            let width = 1e3 * f64::from(robot.localizer.drive.track_width.0);
            (
                "track_width",
                format!("the track width is {factor} that of the robot file"),
                format!(
                    "drive.track_width = \"{:.0} mm\" instead of \"{width:.0} mm\"",
                    width * value
                ),
            )
        }
        _ => return None,
    };
    Some(words)
}

/// Causes at the ranger and its servo.
fn sonar(candidate: &Candidate) -> Option<Words> {
    let value = candidate.value;
    let words = match candidate.cause {
        Cause::BearingMirrored => (
            "bearing_mirrored",
            "the sonar turns the other way: its bearings have the wrong sign".to_owned(),
            "counter-clockwise is positive: exchange the two `sonar.servo_pulses`, or change the sign of the bearings of the log"
                .to_owned(),
        ),
        Cause::BearingOffset => (
            "bearing_offset",
            format!("the sonar points {value:+.0} deg from where the log and the robot file say"),
            format!("add {value:.0} deg to `sonar.bearing` or to the bearings of `sonar.servo_pulses`"),
        ),
        Cause::BearingScale => (
            "bearing_scale",
            format!("the servo turns {} as far as the bearings of the log state", factor(value)),
            "measure the bearings of the two `sonar.servo_pulses` again".to_owned(),
        ),
        Cause::BearingUnit => (BEARING_UNIT, IN_DEGREES.to_owned(), IN_RADIANS.to_owned()),
        Cause::Columns => (
            "range_columns",
            "the columns of bearing and range are exchanged".to_owned(),
            "a range record has the time, the bearing and then the range".to_owned(),
        ),
        Cause::MountAhead => mount(value, if value > 0.0 { "farther ahead" } else { "farther back" }, 0),
        Cause::MountLeft => mount(value, if value > 0.0 { "farther to the left" } else { "farther to the right" }, 1),
        Cause::RangeScale => (
            "range_scale",
            format!("all ranges are right if they are multiplied by {value:.2}"),
            "check the speed of sound and the ticks per second with which the ranger's times are converted".to_owned(),
        ),
        Cause::RangeClock => (
            "range_delay",
            format!(
                "the clock of the ranges runs {:.1} % too {}, compared with that of the encoders",
                1e2 * value.abs(),
                if value > 0.0 { "fast" } else { "slow" }
            ),
            STAMP.to_owned(),
        ),
        Cause::LatePings => (
            "range_delay",
            format!("each range is that of {value:.0} pings before"),
            "log a range with the bearing and the time of its own ping".to_owned(),
        ),
        Cause::RangeUnit => (
            "range_unit",
            format!("the ranges are right if they are multiplied by {}", (1e4 * value).round() / 1e4),
            range_unit(value),
        ),
        Cause::RangeOffset => (
            "range_offset",
            format!("all ranges are {:.0} mm too {}", 1e3 * value.abs(), if value > 0.0 { "short" } else { "long" }),
            format!("add {:.0} mm to the ranges, or correct `sonar.mount`", 1e3 * value),
        ),
        Cause::RangeDelay => (
            "range_delay",
            format!(
                "the ranges are stamped {:.2} s too {}, compared with the encoders",
                value.abs(),
                if value > 0.0 { "late" } else { "early" }
            ),
            STAMP.to_owned(),
        ),
        _ => return None,
    };
    Some(words)
}

/// What to do with ranges whose times are wrong.
const STAMP: &str =
    "stamp both by one clock: a range at its reflection, the encoders when they are read";

/// Bearings in degrees: the cause, what is wrong, and what to do.
pub const BEARING_UNIT: &str = "bearing_unit";
pub const IN_DEGREES: &str = "the bearings are in degrees";
pub const IN_RADIANS: &str = "write the bearings in radians";

/// A sonar at another place of the robot, by a length along an axis.
fn mount(by: f64, direction: &str, axis: u8) -> Words {
    let coordinate = if axis == 0 { "first" } else { "second" };
    (
        "mount",
        format!("the sonar is {:.0} mm {direction} than the robot file states", 1e3 * by.abs()),
        format!("add {:.0} mm to the {coordinate} coordinate of `sonar.mount`", 1e3 * by),
    )
}

/// Exchanged encoders, some of which also count backwards.
fn swapped([right, left]: [f64; 2]) -> Words {
    let and_backwards = match (right < 0.0, left < 0.0) {
        (false, false) => "",
        (true, false) => ", and the right wheel then counts backwards",
        (false, true) => ", and the left wheel then counts backwards",
        (true, true) => ", and both count backwards",
    };
    (
        "wheels_swapped",
        format!("the right and the left encoder are exchanged{and_backwards}"),
        "exchange the two columns of the log, or the two encoders; `mirrored` of a wheel changes its sign".to_owned(),
    )
}

/// Causes of the start, the course and the map.
fn place(candidate: &Candidate, walls: &[Wall]) -> Words {
    let value = candidate.value;
    match candidate.cause {
        Cause::StartHeading => (
            "start_heading",
            format!("the heading at the start is wrong by {value:.0} deg"),
            format!("add {:.3} rad to the heading of the start record", value.to_radians()),
        ),
        Cause::StartUnit if value == 0.0 => (
            "start_unit",
            "the heading at the start is in degrees".to_owned(),
            "write it in radians".to_owned(),
        ),
        Cause::StartUnit => (
            "start_unit",
            format!("the position at the start is right if it is multiplied by {value}"),
            "write it in metres".to_owned(),
        ),
        Cause::StartAxes => (
            "start_axes",
            "x and y of the start are exchanged".to_owned(),
            "exchange them in the start record".to_owned(),
        ),
        Cause::StartPose => {
            let start = candidate.change.start.map(|start| start.pose).unwrap_or_default();
            (
                "start_pose",
                "the robot starts elsewhere than the start record says".to_owned(),
                format!(
                    "x {:.2} m, y {:.2} m, heading {:.3} rad explain the ranges",
                    start.x,
                    start.y,
                    sonarfix_sim::angle::wrap(start.heading)
                ),
            )
        }
        Cause::Moved => (
            "moved",
            format!(
                "the ranges fit until {value:.1} s, and then from another place on: the robot was carried, or its wheels slipped"
            ),
            MOVED.to_owned(),
        ),
        Cause::MapMirrored => (
            "map_mirrored",
            "the map is a mirror image of the room".to_owned(),
            mirrored_map(&candidate.change),
        ),
        Cause::MapTurned => (
            "map_turned",
            format!(
                "the map is turned by {:.0} deg against the room, or the start is",
                turn(&candidate.change)
            ),
            "measure the heading of the start in the frame of the map, or turn the map".to_owned(),
        ),
        Cause::WallShifted | Cause::WallRemoved | Cause::WallAdded => {
            wall(&candidate.change, walls)
        }
        Cause::MapScale => map_scale(value, "its coordinates"),
        Cause::MapScaleX => map_scale(value, "its x coordinates"),
        Cause::MapScaleY => map_scale(value, "its y coordinates"),
        _ => (
            "map_unit",
            format!("the map is right if its coordinates are multiplied by {value}"),
            "correct `map.unit`".to_owned(),
        ),
    }
}

/// A single wrong wall of the map.
fn wall(change: &Change, walls: &[Wall]) -> Words {
    const CAUSE: &str = "map_wall";
    let ends = |wall: &Wall| {
        let end = |at: Point| format!("({:.2}, {:.2})", at.x.0, at.y.0);
        format!("from {} to {} m", end(wall.from()), end(wall.to()))
    };
    let stated = |index: usize| walls.get(index).map(ends).unwrap_or_default();
    let corrected = |index: usize| change.walls(walls).get(index).map(ends).unwrap_or_default();
    match change.wall {
        Some(WallChange::Shifted(index, by)) => (
            CAUSE,
            format!(
                "the wall {} is {:.2} m away from its place in the map",
                stated(index),
                by.abs()
            ),
            format!("measure it again; {} explains the ranges", corrected(index)),
        ),
        Some(WallChange::Removed(index)) => (
            CAUSE,
            format!("the wall {} of the map is not in the room", stated(index)),
            "remove it from the map; of an open door, only the opening".to_owned(),
        ),
        _ => (
            CAUSE,
            format!("the map has no wall {}", corrected(walls.len())),
            "measure it, and add it to the map".to_owned(),
        ),
    }
}

/// A map of another size.
fn map_scale(by: f64, coordinates: &str) -> Words {
    (
        "map_scale",
        format!("the map is right if {coordinates} are multiplied by {by:.2}"),
        "measure the room again: one long wall of each direction".to_owned(),
    )
}

/// What makes a mirrored map right.
fn mirrored_map(change: &Change) -> String {
    let how = match change.map {
        [[x, _], _] if x < 0.0 => "change the sign of its x coordinates",
        [_, [_, y]] if y < 0.0 => "change the sign of its y coordinates",
        [[_, by], _] if by < 0.0 => "exchange x and y of its coordinates, and change both signs",
        _ => "exchange x and y of its coordinates",
    };
    let then = if change.is_about_centre { ", and shift it to its old place" } else { "" };
    format!("{how}{then}")
}

/// The turn of a map that a change takes back, degrees counter-clockwise.
fn turn(change: &Change) -> f64 {
    let [[cos, sin], _] = change.map;
    sin.atan2(cos).to_degrees()
}

fn factor(value: f64) -> String {
    format!("{value:.2} times")
}

fn mirrored(side: &str) -> String {
    format!("the {side} encoder counts backwards")
}

fn negate(side: &str) -> String {
    format!("change `mirrored` of `drive.{side}_wheel`, or the sign of its counts in the log")
}

fn travel(wheel: &str, metres: f64, by: f64) -> String {
    let now = 1e3 * metres;
    format!(
        "drive.{wheel}: travel per edge {:.4} mm instead of {now:.4} mm; check its diameter and edges_per_revolution",
        now * by
    )
}

fn range_unit(by: f64) -> String {
    const NAMED: [(f64, &str); 10] = [
        (1e-3, "they are in millimetres: write metres"),
        (1e-2, "they are in centimetres: write metres"),
        (0.1, "they are in decimetres: write metres"),
        (0.0254, "they are in inches: write metres"),
        (0.3048, "they are in feet: write metres"),
        (INCHES_AS_CENTIMETRES, "they are inches, converted as centimetres: 1 in is 0.0254 m"),
        (CENTIMETRES_AS_INCHES, "they are centimetres, converted as inches: 1 cm is 0.01 m"),
        (0.5, "they are the way there and back: halve them"),
        (2.0, "they were halved twice: double them"),
        (1e3, "they were divided by 1,000 twice: write metres"),
    ];
    let named = NAMED.iter().find(|(factor, _)| (factor / by - 1.0).abs() < 1e-6);
    named.map_or("write metres", |(_, text)| text).to_owned()
}

impl Candidate {
    fn is_of_start(&self) -> bool {
        matches!(
            self.cause,
            Cause::StartHeading | Cause::StartUnit | Cause::StartPose | Cause::StartAxes
        )
    }
}

fn start_line(entries: &[Entry]) -> Option<u64> {
    let is_start =
        |entry: &&Entry| matches!(entry.record, Record::Start { .. } | Record::Resume { .. });
    entries.iter().find(is_start).map(|entry| entry.line)
}

fn line_at(time: f64, entries: &[Entry]) -> Option<u64> {
    entries.iter().find(|entry| entry.record.time() >= time).map(|entry| entry.line)
}

/// A stretch that nothing explains, of a log that is right before it and begins at `begin`, seconds.
pub fn broken(broken: Broken, begin: f64, entries: &[Entry]) -> Finding {
    let from = begin + broken.from;
    let until =
        broken.until.map_or_else(String::new, |until| format!(", to {:.1} s", begin + until));
    let message = format!(
        "the ranges fit until {from:.1} s, and not from then on{until}: the robot was carried, or its wheels slipped"
    );
    let line = line_at(from, entries);
    Finding { line, ..Finding::new("moved", message, MOVED.to_owned()) }
}

/// What to do with a robot that was carried.
const MOVED: &str = "add a pose record there, or let the robot search: `start = \"unknown\"`";

/// No cause explains the log.
pub fn unexplained(as_is: &Evidence, walls: &[Wall]) -> Option<Finding> {
    // Fewer walls enclose no room: most echoes may come from what the map leaves out.
    (as_is.explained() < 0.5 && walls.len() >= 3).then(|| {
        Finding::new(
            "map_or_start",
            "no pose and no single correction explains the ranges".to_owned(),
            "is it the map of this room? Are furniture, glass or people in it that are not in the map? Measure two walls by hand"
                .to_owned(),
        )
    })
}
