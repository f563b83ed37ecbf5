//! What can be wrong with the inputs of the node: each kind has a name, a count and an advice, which the diagnostics publish.

use sonarfix_ros_messages::messages::KeyValue;

/// Nanoseconds of a clock of ROS.
pub type Nanoseconds = i64;

macro_rules! problems {
    ($($(#[$doc:meta])* $name:ident $text:literal, $is_warned:literal, $advice:literal;)*) => {
        /// A kind of problem.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Problem { $($(#[$doc])* $name),* }

        impl Problem {
            /// All of them, in the order of their numbers.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// Its name in the diagnostics.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$name => $text),* }
            }

            /// What to do about it.
            #[must_use]
            pub fn advice(self) -> &'static str {
                match self { $(Self::$name => $advice),* }
            }

            /// Whether it raises the level of the diagnostics; otherwise it is only counted, because networks cause it
            /// without harm.
            #[must_use]
            pub fn is_warned(self) -> bool {
                match self { $(Self::$name => $is_warned),* }
            }
        }
    };
}

problems! {
    /// A number of an odometry message is NaN or infinite, or its orientation is no rotation.
    OdometryNotFinite "odometry_not_finite", true, "check the program that publishes the odometry";
    /// The frames of an odometry message are not those of the parameters.
    OdometryFrame "odometry_frame", true, "set odom_frame_id and base_frame_id as the odometry has them";
    /// The stamp of an odometry message is ahead of the node's clock.
    OdometryFuture "odometry_future", true, "synchronize the clocks, or set use_sim_time on both sides";
    /// An odometry message has the stamp of the one before.
    OdometryRepeated "odometry_repeated", false, "look for a second publisher of the topic";
    /// An odometry message is older than the one before; it is not needed, because poses are cumulative.
    OdometryReordered "odometry_reordered", false, "look for a second publisher of the topic";
    /// Between two odometry messages there was more time than `odometry_timeout`.
    OdometryGap "odometry_gap", true, "check the connection of the robot's base";
    /// The odometry moved farther than the wheels can: it was reset, and the travel since is unknown.
    OdometryReset "odometry_reset", true, "check why the robot's base has restarted";
    /// The stamps of the odometry were set back.
    OdometryClockReset "odometry_clock_reset", true, "check the clock of the robot's base";
    /// The localizer refused a travel.
    OdometryRefused "odometry_refused", true, "compare the robot file with the robot: track width, largest wheel speed";
    /// The joints of the wheels are not in a message.
    JointMissing "joint_missing", true, "set wheel_joints to the names of the right and the left joint";
    /// No odometry has arrived for longer than `odometry_timeout`.
    NoOdometry "no_odometry", true, "check odom_topic, and that its publisher runs";
    /// A range is NaN, which REP 117 defines as an invalid measurement.
    RangeNotFinite "range_not_finite", true, "check the driver of the ranger";
    /// The stamp of a range is ahead of the node's clock.
    RangeFuture "range_future", true, "synchronize the clocks, or set use_sim_time on both sides";
    /// A range is older than the history of the node.
    RangeLate "range_late", true, "raise the parameter history, or look for the delay";
    /// A range was received twice.
    RangeRepeated "range_repeated", false, "look for a second publisher of the topic";
    /// No transform leads from the frame of a range to the base.
    RangeFrame "range_frame", true, "publish the frame of the ranger on /tf_static, or set range_bearings";
    /// A transform leads from the frame of a range to the base, but not at the time of the range.
    RangeTransform "range_transform", true, "check the publisher of the ranger's joint";
    /// A range was measured before the first odometry, or before the pose was set.
    RangeBeforeStart "range_before_start", false, "nothing: it happens at each start";
    /// A range was measured in a gap of the odometry: the pose then is unknown.
    RangeUnplaced "range_unplaced", true, "check the connection of the robot's base";
    /// More ranges wait for odometry or transforms than fit.
    RangeQueue "range_queue", true, "check that odometry and transforms arrive";
    /// A scan has no beam at the chosen bearings, or its angles are not numbers.
    ScanAngles "scan_angles", true, "set scan_bearings within the scan";
    /// A number of an IMU message is NaN or infinite.
    ImuNotFinite "imu_not_finite", true, "check the driver of the IMU";
    /// The IMU does not cover the time of a step of the odometry: the wheels alone count.
    ImuGap "imu_gap", true, "check the rate of the IMU";
    /// A transform has a number that is not finite, or no rotation.
    TransformNotFinite "transform_not_finite", true, "check the program that publishes the transform";
    /// An initial pose has a number that is not finite, or a negative variance.
    PoseNotFinite "pose_not_finite", true, "give a pose with a finite covariance";
    /// An initial pose is in another frame than `global_frame_id`.
    PoseFrame "pose_frame", true, "give the pose in the frame global_frame_id";
    /// The localizer refused a pose or the configuration.
    PoseRefused "pose_refused", true, "give a pose within the map with smaller deviations";
    /// No walls are found in the map.
    MapInvalid "map_invalid", true, "give a map file of walls: docs/floor-plans.md";
    /// The walls were found in an occupancy grid, which is less exact than a map of walls.
    MapFromGrid "map_from_grid", false, "measure the walls and give them as a map file: docs/floor-plans.md";
    /// There is no map yet.
    NoMap "no_map", true, "set map_file, or start a map server";
    /// The clock was set back, as when a simulation restarts.
    ClockBack "clock_back", true, "nothing, if a simulation was restarted";
    /// The clock jumped ahead.
    ClockAhead "clock_ahead", true, "nothing, if a simulation was stopped or a bag was moved on";
    /// A message could not be decoded.
    Undecodable "undecodable", true, "check the types of the topics";
    /// The robot at the port is silent, or the port cannot be used.
    LinkSilent "link_silent", true, "check port, baud rate and power of the robot";
    /// The robot did not execute a command.
    CommandFailed "command_failed", true, "see the message, and docs/link.md";
}

/// A count of each kind of problem, with the time of the last one.
#[derive(Debug, Clone)]
pub struct Problems {
    counts: Vec<(u64, Nanoseconds)>,
}

impl Default for Problems {
    fn default() -> Self {
        Self { counts: vec![(0, 0); Problem::ALL.len()] }
    }
}

impl Problems {
    /// Counts a problem.
    pub fn add(&mut self, problem: Problem, now: Nanoseconds) {
        if let Some((count, last)) = self.counts.get_mut(problem as usize) {
            *count += 1;
            *last = now;
        }
    }

    /// How often it has occurred.
    #[must_use]
    pub fn count(&self, problem: Problem) -> u64 {
        self.counts.get(problem as usize).map_or(0, |(count, _)| *count)
    }

    /// Those that have occurred.
    pub fn occurred(&self) -> impl Iterator<Item = Problem> {
        Problem::ALL.iter().copied().filter(|problem| self.count(*problem) > 0)
    }

    /// Those that raise the level and have occurred within this time, nanoseconds.
    pub fn recent(&self, now: Nanoseconds, within: Nanoseconds) -> impl Iterator<Item = Problem> {
        let is_recent = move |problem: &Problem| {
            let (count, last) = self.counts.get(*problem as usize).copied().unwrap_or_default();
            count > 0 && problem.is_warned() && now.saturating_sub(last) < within
        };
        Problem::ALL.iter().copied().filter(is_recent)
    }

    /// The counts for the diagnostics.
    #[must_use]
    pub fn values(&self) -> Vec<KeyValue> {
        let value = |problem: Problem| KeyValue {
            key: problem.name().to_owned(),
            value: format!("{} ({})", self.count(problem), problem.advice()),
        };
        self.occurred().map(value).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn problems_are_counted_by_name() {
        let mut problems = Problems::default();
        for _ in 0..3 {
            problems.add(Problem::RangeLate, 5_000_000_000);
        }
        problems.add(Problem::OdometryRepeated, 5_000_000_000);
        assert_eq!(problems.count(Problem::RangeLate), 3);
        let keys: Vec<String> = problems.values().into_iter().map(|value| value.key).collect();
        assert_eq!(keys, ["odometry_repeated", "range_late"]);
        let recent = |now| problems.recent(now, 1_000_000_000).collect::<Vec<_>>();
        assert_eq!(recent(5_500_000_000), [Problem::RangeLate]);
        assert_eq!(recent(6_500_000_000), []);
        let mut names: Vec<&str> = Problem::ALL.iter().map(|problem| problem.name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Problem::ALL.len());
    }
}
