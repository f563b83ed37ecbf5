//! The messages that the node publishes.

use sonarfix_ros_messages::messages::{
    DiagnosticArray, MarkerArray, Odometry, ParticleCloud, PoseWithCovarianceStamped, Range,
    TFMessage, Twist,
};

/// A message of the node.
#[derive(Debug, Clone, PartialEq)]
pub enum Output {
    /// To `pose_topic`.
    Pose(Box<PoseWithCovarianceStamped>),
    /// To `/tf`.
    Transforms(TFMessage),
    /// To `/diagnostics`.
    Diagnostics(DiagnosticArray),
    /// To `~/markers`.
    Markers(MarkerArray),
    /// To `~/calibration`.
    Calibration(DiagnosticArray),
    /// To `particle_cloud`.
    Particles(ParticleCloud),
    /// To `odom`, of a robot behind the link.
    Odometry(Box<Odometry>),
    /// To `~/range`, of a robot behind the link.
    Range(Range),
    /// To `search_motion_topic`.
    Velocity(Twist),
}
