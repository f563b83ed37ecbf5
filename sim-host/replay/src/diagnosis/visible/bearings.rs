//! The bearings of the pings, compared with what the robot file states.

use std::f64::consts::{PI, TAU};

use sonarfix::config::{RangerId, RangerParameters};
use sonarfix_hal::config::RobotConfig;
use sonarfix_sim::angle;

use crate::diagnosis::finding::Finding;
use crate::diagnosis::report::{BEARING_UNIT, IN_DEGREES, IN_RADIANS};

/// Pings that show a bearing.
const PINGS: u64 = 10;
/// The accuracy of a bearing that is measured or rounded, radians: 3°.
const ACCURACY: f64 = 0.05;

/// What the records show.
#[derive(Debug, Default)]
pub struct Bearings {
    pings: u64,
    /// Those of more than a turn.
    beyond_a_turn: u64,
    least: Option<f64>,
    most: Option<f64>,
    /// Of the rangers without a servo: the first line that contradicts the robot file, how many do, and the bearings of both.
    contradictions: Option<Contradiction>,
}

#[derive(Debug)]
struct Contradiction {
    line: u64,
    pings: u64,
    logged: f64,
    stated: f64,
}

impl Bearings {
    /// Takes the bearing of a ping.
    pub fn add(&mut self, line: u64, bearing: f64, ranger: RangerId, robot: &RobotConfig) {
        self.pings += 1;
        self.beyond_a_turn += u64::from(bearing.abs() > TAU);
        self.least = Some(self.least.map_or(bearing, |least| least.min(bearing)));
        self.most = Some(self.most.map_or(bearing, |most| most.max(bearing)));
        let parameters = robot.localizer.rangers.get(ranger);
        let Some(fixed) = parameters.and_then(RangerParameters::fixed_bearing) else { return };
        let stated = f64::from(fixed.0);
        if angle::wrap(bearing - stated).abs() > ACCURACY {
            let new = Contradiction { line, pings: 0, logged: bearing, stated };
            self.contradictions.get_or_insert(new).pings += 1;
        }
    }

    pub fn findings(&self, findings: &mut Vec<Finding>) {
        if self.pings < PINGS {
            return;
        }
        if 4 * self.beyond_a_turn > self.pings {
            findings.push(Finding::new(BEARING_UNIT, IN_DEGREES.to_owned(), IN_RADIANS.to_owned()));
        } else if let Some(found) = &self.contradictions
            && 2 * found.pings > self.pings
        {
            findings.push(found.finding());
        }
    }

    /// Bearings of a servo that always are the same, if no cause explains the ranges.
    pub fn constant(&self, robot: &RobotConfig) -> Option<Finding> {
        let is_fixed = robot.localizer.rangers.iter().any(|(_, it)| it.fixed_bearing().is_some());
        let is_constant = self.most? - self.least? < ACCURACY;
        (!is_fixed && is_constant && self.pings >= PINGS).then(|| {
            Finding::new(
                "bearing_stuck",
                format!("all bearings are {:.0} deg, although the sonar is on a servo", self.most.unwrap_or(0.0).to_degrees()),
                "log the bearing of the servo with each range, and check that the servo turns; a sonar without a servo has `sonar.bearing` instead of `sonar.servo`".to_owned(),
            )
        })
    }
}

impl Contradiction {
    fn finding(&self) -> Finding {
        let Self { line, logged, stated, .. } = *self;
        let is_near = |other: f64| angle::wrap(logged - other).abs() < ACCURACY;
        let is_in_degrees = logged.abs() > PI && (logged - stated.to_degrees()).abs() < 3.0;
        let [at, by] = [logged, stated].map(f64::to_degrees);
        let message = format!(
            "the bearings of the log are {at:.0} deg, that of the fixed sonar in the robot file is {by:.0} deg"
        );
        if is_in_degrees {
            return Finding::at(line, BEARING_UNIT, IN_DEGREES.to_owned(), IN_RADIANS.to_owned());
        }
        let (cause, remedy) = if is_near(-stated) {
            ("bearing_mirrored", "counter-clockwise is positive, so that a sonar to the left has a bearing of 90 deg: correct the sign in the log or in `sonar.bearing`".to_owned())
        } else {
            (
                "bearing_offset",
                format!(
                    "add {:.0} deg to the bearings of the log, or to `sonar.bearing`",
                    -angle::wrap(logged - stated).to_degrees()
                ),
            )
        };
        Finding::at(line, cause, message, remedy)
    }
}
