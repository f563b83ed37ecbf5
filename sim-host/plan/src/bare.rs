//! The scenario of a map alone.

use std::path::Path;

use sonarfix_hal::config::RobotConfig;
use sonarfix_map::{FileError, Floor, Scenario, SonarModel, SonarName};

/// The tables of a scenario that describe a robot of the size that drives through doors.
pub const ROBOT: &str = include_str!("robot.toml");

/// What a scenario needs beside [`ROBOT`]; the caller replaces map and path.
const PLACE: &str = r#"
format = 1
name = "a map"
description = "A robot that drives through doors, on a map alone"
fidelity = "pins"

[map]
unit = "m"
wall = [{ name = "wall", from = [0, 0], to = [2, 0] }]

[path]
unit = "m"
start = [0, 1]
corners = [[2, 1]]
speed = "0.25 m/s"
turn_rate = "60 deg/s"
follow = "truth"

[truth]
track_width = "230 mm"
scale_right = 0.0
scale_left = 0.0
range_scale = "0 %"
wheel_noise = "2 mm/sqrt(m)"
scale_walk = "0 /sqrt(m)"
track_width_walk = "0 m/sqrt(m)"
range_noise = "3 mm"
range_noise_per_metre = "0 mm/m"
cone = "15 deg"

[world]
temperature = "20 degC"

"#;

/// The text of the scenario whose map and path are to be replaced.
#[must_use]
pub fn text() -> String {
    format!("{PLACE}{ROBOT}")
}

/// The robot of the floor plans on a map, on a path that is to be replaced.
///
/// # Errors
/// Never: the text is tested.
pub fn scenario(floor: Floor, name: String) -> Result<Scenario, FileError> {
    let whole = Scenario::parse(&text(), "the robot of a map", Path::new(""))?;
    Ok(Scenario { floor, name, ..whole })
}

/// Replaces the robot of a scenario: the simulated one has its track width, and the sonar that its driver is for; an ideal one if
/// none is simulated.
pub fn fit(scenario: &mut Scenario, robot: RobotConfig) {
    let kind = robot.rangers.first.kind;
    let is_this = |model: &SonarModel| model.ranger.is_some_and(|ranger| ranger.kind == kind);
    let model = SonarModel::ALL.into_iter().filter(is_this).find_map(|model| model.simulated);
    scenario.hardware.sonar = model.unwrap_or(SonarName::Ideal);
    scenario.truth.track_width = robot.localizer.drive.track_width.0.into();
    scenario.robot = robot;
}
