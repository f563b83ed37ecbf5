//! The robots of the study: what the robot's file says of a robot that is otherwise.

use sonarfix_hal::config::RobotConfig;

/// A robot, whose software may be configured with a wrong robot file.
#[derive(Debug, Clone, Copy)]
pub struct Robot {
    /// Its name.
    pub name: &'static str,
    /// Changes the true robot file to that of the software.
    pub(super) believes: fn(&mut RobotConfig),
}

impl Robot {
    /// The robot as its file describes it.
    pub const NOMINAL: Self = Self { name: "nominal", believes: |_| {} };

    /// All of them.
    pub const ALL: [Self; 1] = [Self::NOMINAL];
}
