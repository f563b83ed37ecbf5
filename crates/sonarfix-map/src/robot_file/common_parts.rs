//! The values of keys that a robot file need not have.

use sonarfix::config::Config;
use sonarfix::geometry::units::Metres;
use sonarfix_hal::config::RobotConfig;

/// A robot with common parts, whose keys of its own a file replaces.
pub(crate) fn usual() -> RobotConfig {
    RobotConfig::with_common_parts(Config::for_track_width(Metres(0.16)))
}
