//! The `[start]` table of a scenario: the initial estimate.

use sonarfix_hal::config::RobotConfig;
use sonarfix_search::navigator::{UNKNOWN_HEADING, UNKNOWN_POSITION};

use crate::document::Table;
use crate::keys::{Key, Section, Value, number};
use crate::quantity::{ANGLE, LENGTH};

/// The initial standard deviations of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Of x and of y, metres.
    pub position: f64,
    /// Of the heading, radians.
    pub heading: f64,
    /// Whether the estimate's start is drawn with these deviations around the truth; if not, it
    /// starts on the truth.
    pub drawn: bool,
    /// Whether the robot starts without a pose; the other fields then have no meaning.
    pub is_unknown: bool,
}

impl Start {
    fn unknown() -> Self {
        Self {
            position: UNKNOWN_POSITION.0.into(),
            heading: UNKNOWN_HEADING.0.into(),
            drawn: false,
            is_unknown: true,
        }
    }
}

#[rustfmt::skip]
pub(crate) static START: Section<Start> = Section { name: "start", usual: Start::unknown, keys: &[
    number("position", &LENGTH, ("0 m", "1000 m"), |s| &mut s.position, "deviation of x and of y"),
    number("heading", &ANGLE, ("0 deg", "360 deg"), |s| &mut s.heading, "deviation of the heading"),
    Key::new("drawn", Value::Flag(|s| &mut s.drawn), "whether the initial estimate has a random error with these deviations, or equals the truth"),
] };

/// Reads `start`: the deviations, or that there is no estimate.
pub(crate) fn read(root: &Table<'_>, robot: Option<&RobotConfig>) -> Start {
    let start = root.require("start");
    if let Some(text) = start.as_text() {
        start.check((), text == "unknown", "a table of deviations, or \"unknown\"");
        let searches = robot.is_none_or(|robot| robot.start.is_unknown());
        return start.check(Start::unknown(), searches, "that of a robot with start = \"unknown\"");
    }
    Start { is_unknown: false, ..START.read(start, Start::unknown()) }
}
