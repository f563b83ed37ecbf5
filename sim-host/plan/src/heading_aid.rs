//! Sensors of the heading beside wheels and sonar.

use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_map::{AbsoluteSensors, HeadingSensor, Scenario};

/// What measures the heading beside wheels and sonar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum HeadingAid {
    /// Nothing.
    None,
    /// The gyro of the robot file; an MPU-6050 for a robot without one.
    Gyro,
    /// The compass of the scenario; [`HeadingSensor::COMPASS`] for a scenario without one.
    Compass,
}

impl HeadingAid {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::None, Self::Gyro, Self::Compass];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Gyro => "gyro",
            Self::Compass => "compass",
        }
    }

    /// Leaves a scenario with this sensor beside wheels and sonar, and without any other.
    pub fn fit(self, scenario: &mut Scenario) {
        let gyro = scenario.robot.localizer.gyro.unwrap_or(GyroParameters::MPU_6050);
        let compass = scenario.absolute.heading.unwrap_or(HeadingSensor::COMPASS);
        scenario.robot.localizer.gyro = (self == Self::Gyro).then_some(gyro);
        scenario.absolute =
            AbsoluteSensors { heading: (self == Self::Compass).then_some(compass), position: None };
    }
}
