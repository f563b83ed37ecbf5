//! What the caller of a conversion chooses.

use std::collections::BTreeMap;
use std::path::Path;

use sonarfix_ros_messages::transforms::Nanoseconds;
use sonarfix_sim::trace::Pose;

use crate::recording::Joints;

/// A conversion. Topics that are not named are found, if there is only one of their kind.
#[derive(Debug, Clone, Default)]
pub struct Rosbag<'a> {
    /// The topic with the odometry: `Odometry`, or `JointState` with a radius of the wheels.
    pub odometry: Option<&'a str>,
    /// The joints of the wheels.
    pub joints: Option<Joints>,
    /// The radius of the wheels, metres: takes the joints in place of the odometry.
    pub radius: Option<f64>,
    /// The distance between the wheels, metres.
    pub track_width: Option<f64>,
    /// The topics with ranges; all if it is empty.
    pub ranges: &'a [String],
    /// The topic with scans, in place of ranges.
    pub scan: Option<&'a str>,
    /// The bearings of the beams that are taken of a scan, radians from the heading; the whole scan if it is empty.
    pub beams: &'a [f64],
    /// The robot's frame.
    pub base: Option<&'a str>,
    /// Places of rangers: topic, and metres ahead, metres to the left and bearing in radians.
    pub mounts: &'a [(String, [f64; 3])],
    /// The pose at the begin.
    pub start: Option<Pose>,
    /// The topic with the true poses.
    pub reference: Option<&'a str>,
    /// The walls as CSV.
    pub walls: Option<&'a Path>,
}

/// A topic by its name; else the only one, or the one with the usual name.
pub fn choose<'t, T>(
    topics: &'t BTreeMap<String, T>,
    named: Option<&str>,
    usual: &str,
    (what, option): (&str, &str),
) -> Result<Option<(&'t str, &'t T)>, String> {
    let names = || topics.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
    let with_name = |(name, topic): (&'t String, &'t T)| (name.as_str(), topic);
    if let Some(name) = named {
        let found = topics.get_key_value(name).map(with_name);
        let why = || {
            if topics.is_empty() {
                return format!("has no {what}, thus none on {name} ({option})");
            }
            format!("has no {what} on {name} ({option}), but on: {}", names())
        };
        return found.ok_or_else(why).map(Some);
    }
    if topics.len() > 1 {
        let found = topics.get_key_value(usual).map(with_name);
        let why = || format!("has {what} on several topics: choose one with {option}: {}", names());
        return found.ok_or_else(why).map(Some);
    }
    Ok(topics.iter().next().map(with_name))
}

/// Nanoseconds as seconds of the log.
#[expect(clippy::cast_precision_loss, reason = "exact to a microsecond for 285 years")]
pub fn seconds(time: Nanoseconds) -> f64 {
    time as f64 * 1e-9
}
