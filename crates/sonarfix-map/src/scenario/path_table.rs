//! The `[path]` table of a scenario, and the rules for a path, a map and a robot.

use sonarfix_hal::config::RobotConfig;

use crate::clearance::Collision;
use crate::document::{Node, Table};
use crate::floor::Floor;
use crate::keys::{Key, Section, Value, number, optional, other};
use crate::path::{Path, PathPlan};
use crate::plausibility::outline::intention;
use crate::quantity::{LENGTH, SPEED, TURN_RATE};

/// How the robot follows its path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Follow {
    /// Exactly, whatever the estimate.
    #[default]
    Truth,
    /// A controller steers by the estimate only.
    Estimate,
}

/// How the path is driven.
#[derive(Clone, Copy)]
pub(crate) struct Drive {
    pub laps: u32,
    pub speed: f64,
    pub turn_rate: f64,
    pub clearance: f64,
    pub follow: Follow,
}

impl Default for Drive {
    fn default() -> Self {
        Self { laps: 1, speed: 0.0, turn_rate: 0.0, clearance: 0.0, follow: Follow::default() }
    }
}

#[rustfmt::skip]
pub(crate) static PATH: Section<Drive> = Section { name: "path", usual: Drive::default, keys: &[
    other("unit", "`\"m\"`, `\"cm\"` or `\"mm\"`", "unit of the coordinates"),
    other("start", "within 8 km of the origin", "start point"),
    other("corners", "at least one, within 8 km of the origin", "the corners, in order. Each is different from the point before"),
    optional(Key::new("laps", Value::Own("1 to 10000", |node, d| d.laps = node.count(), |d| Some(d.laps.to_string())),
        "number of laps. 1 if the last corner is not the start")),
    number("speed", &SPEED, ("1 mm/s", "100 m/s"), |d| &mut d.speed, "speed on straight legs. Within the robot's `max_wheel_speed`"),
    number("turn_rate", &TURN_RATE, ("0.1 deg/s", "10000 deg/s"), |d| &mut d.turn_rate, "turn rate on the spot. No wheel is faster than `max_wheel_speed`"),
    optional(number("clearance", &LENGTH, ("0 m", "100 m"), |d| &mut d.clearance,
        "minimum distance of the path from walls, such as the robot's radius. A path through a wall is refused in any case")),
    optional(Key::new("follow", Value::Word(&["truth", "estimate"], |d| usize::from(d.follow == Follow::Estimate), |d, word| {
        d.follow = if word == 0 { Follow::Truth } else { Follow::Estimate };
    }), "whether the robot follows its path exactly, regardless of the estimate, or is steered by the estimate. Then the run ends when the path would")),
] };

/// Reads the path; `drive` is what [`PATH`] has read. Rules that concern several values are checked only if all of them could
/// be read.
pub(crate) fn read(
    table: &Table<'_>,
    drive: Option<Drive>,
    floor: Option<&Floor>,
    robot: Option<&RobotConfig>,
) -> Option<Path> {
    let unit = table.require("unit").unit_of_length();
    let corners = table.require("corners").items();
    let points = table.faultless(|| {
        let start = table.require("start").point(unit);
        Some((start, corners.iter().map(|node| node.point(unit)).collect()))
    });
    let (drive, (start, corner_points)) = drive.zip(points)?;
    let Drive { laps, speed, turn_rate, clearance, .. } = drive;
    let plan = PathPlan { start, corners: corner_points, laps, speed, turn_rate };
    let path = match Path::new(plan) {
        Ok(path) => path,
        Err(error) => {
            let corner = error.corner().and_then(|index| corners.get(index));
            match corner {
                Some(node) => node.report(error.to_string()),
                None => table.report_at(error.field(), error.to_string()),
            }
            return None;
        }
    };
    if let Some(robot) = robot {
        check_speeds(table, &path, robot);
    }
    if let Some(floor) = floor {
        check_clearance(&path, &corners, floor, clearance);
    }
    Some(path)
}

/// Checks the wheel speed: the localizer refuses the travel of a wheel that is faster than `max_wheel_speed`.
fn check_speeds(table: &Table<'_>, path: &Path, robot: &RobotConfig) {
    let fastest = f64::from(robot.localizer.max_wheel_speed.0);
    let half_width = 0.5 * f64::from(robot.localizer.drive.track_width.0);
    let plan = path.plan();
    for (key, wheel) in [("speed", plan.speed), ("turn_rate", plan.turn_rate * half_width)] {
        if wheel > fastest {
            let message = format!(
                "rolls a wheel at {wheel:.3} m/s, faster than the robot's \
                 drive.max_wheel_speed of {fastest:.3} m/s"
            );
            table.report_at(key, message);
        }
    }
}

/// Records a collision, at the corner at the end of the leg.
fn check_clearance(path: &Path, corners: &[Node<'_>], floor: &Floor, clearance: f64) {
    if let Some(collision) = Collision::first(path.plan(), floor, clearance)
        && let Some(corner) = corners.get(collision.corner)
    {
        let intention = intention(floor, path.plan(), clearance);
        corner.report(format!("{collision}{}", intention.unwrap_or_default()));
    }
}
