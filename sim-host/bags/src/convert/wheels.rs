//! Odometry and joints as travel of two wheels.

use sonarfix_replay::convert::arc::Arc;
use sonarfix_replay::convert::carmen::TRACK_WIDTH;
use sonarfix_ros_messages::transforms::Nanoseconds;
use sonarfix_sim::trace::Pose;

use super::options::{Rosbag, choose, seconds};
use crate::recording::Recording;

/// The robot's frame where neither an option nor the odometry names it.
const BASE: &str = "base_link";
/// Share of the driven distance that odometry may move sideways, before it is reported.
const SIDEWAYS: f64 = 0.05;

/// The travel of the wheels.
#[derive(Debug, Clone, PartialEq)]
pub struct Wheels {
    /// Times, and travel of the right and the left wheel since the begin, metres.
    pub travels: Vec<(Nanoseconds, [f64; 2])>,
    /// Distance between the wheels, metres.
    pub track_width: f64,
    /// Where that is from.
    pub source: &'static str,
    /// The robot's frame.
    pub base: String,
    /// Messages left out because another has their time.
    pub repeated: u64,
    /// What the user should know.
    pub notes: Vec<String>,
}

impl Wheels {
    /// Those of a recording.
    ///
    /// # Errors
    /// What is missing, and the option that supplies it.
    pub fn of(options: &Rosbag, recording: &Recording) -> Result<Self, String> {
        match options.radius {
            Some(radius) => Self::of_joints(options, recording, radius),
            None => Self::of_odometry(options, recording),
        }
    }

    fn of_joints(options: &Rosbag, recording: &Recording, radius: f64) -> Result<Self, String> {
        let what = ("JointState with both wheels", "--odometry");
        let found = choose(&recording.joints, options.odometry, "/joint_states", what)?;
        let names = || match recording.joint_names.as_slice() {
            [] => "has no JointState, which --wheel-radius asks for".to_owned(),
            names => format!(
                "name the joints of the wheels with --joints RIGHT,LEFT, of: {}",
                names.join(", ")
            ),
        };
        let (_, joints) = found.ok_or_else(names)?;
        let track_width = options.track_width;
        let track_width = track_width
            .ok_or("joints do not tell how far apart the wheels are: add --track-width METRES")?;
        let mut joints = joints.clone();
        joints.sort_by_key(|(time, _)| *time);
        let count = joints.len();
        joints.dedup_by_key(|(time, _)| *time);
        let repeated = (count - joints.len()) as u64;
        let begin = joints.first().map_or([0.0; 2], |(_, begin)| *begin);
        let travel =
            |[right, left]: [f64; 2]| [radius * (right - begin[0]), radius * (left - begin[1])];
        let travels = joints.into_iter().map(|(time, angles)| (time, travel(angles))).collect();
        let base = options.base.unwrap_or(BASE).to_owned();
        Ok(Self { travels, track_width, source: "as given", base, repeated, notes: Vec::new() })
    }

    fn of_odometry(options: &Rosbag, recording: &Recording) -> Result<Self, String> {
        let found =
            choose(&recording.odometry, options.odometry, "/odom", ("Odometry", "--odometry"))?;
        let (_, track) = found.ok_or(
            "has no Odometry: for a JointState, add --wheel-radius METRES and --track-width METRES",
        )?;
        let mut poses: Vec<(Nanoseconds, Pose)> =
            track.poses.iter().map(|(time, pose, _)| (*time, *pose)).collect();
        poses.sort_by_key(|(time, _)| *time);
        let count = poses.len();
        poses.dedup_by_key(|(time, _)| *time);
        let source = if options.track_width.is_some() {
            "as given"
        } else {
            "assumed; any other gives the same poses of the odometry"
        };
        let track_width = options.track_width.unwrap_or(TRACK_WIDTH);
        let (mut sum, mut driven, mut sideways) = ([0.0; 2], 0.0, 0.0);
        let mut travels: Vec<_> = poses.first().map(|(time, _)| (*time, sum)).into_iter().collect();
        for pair in poses.windows(2) {
            let [(_, from), (time, to)] = pair else { continue };
            let arc = Arc::between(from, to, track_width);
            let [right, left] = arc.travel;
            driven += f64::midpoint(right, left).abs();
            sideways += arc.sideways.abs();
            sum = [sum[0] + right, sum[1] + left];
            travels.push((*time, sum));
        }
        let mut notes = Vec::new();
        if sideways > SIDEWAYS * driven + 0.01 {
            notes.push(format!(
                "the odometry moves sideways, {sideways:.2} m in {driven:.2} m, which two wheels cannot: is it of such a robot, and not \
                 corrected by a map?"
            ));
        }
        let named = (!track.child.is_empty()).then_some(track.child.as_str());
        let base = options.base.or(named).unwrap_or(BASE).to_owned();
        let repeated = (count - poses.len()) as u64;
        Ok(Self { travels, track_width, source, base, repeated, notes })
    }

    /// The usual time between two records, seconds.
    pub fn period(&self) -> f64 {
        let mut steps: Vec<Nanoseconds> = self
            .travels
            .windows(2)
            .filter_map(|pair| Some(pair.last()?.0 - pair.first()?.0))
            .collect();
        steps.sort_unstable();
        steps.get(steps.len() / 2).map_or(0.1, |step| seconds(*step))
    }
}
