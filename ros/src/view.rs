//! The estimate at one time, and the messages that are made of it.

use sonarfix::health::Verdict;
use sonarfix::localizer::{Localizer, Mode};
use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{
    Header, Odometry, Particle, ParticleCloud, PoseWithCovarianceStamped, Time, Transform,
    TransformStamped,
};
use sonarfix_search::search::Search;

use crate::motion::{Planar, between, moved};
use crate::parameters::Parameters;
use crate::problem::Nanoseconds;

/// The names of the frames.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Frames {
    /// The map.
    pub map: String,
    /// The odometry.
    pub odom: String,
    /// The robot.
    pub base: String,
}

impl Frames {
    /// The names that the parameters set.
    #[must_use]
    pub fn of(parameters: &Parameters) -> Self {
        let text = |name: &str| parameters.text(name).to_owned();
        Self {
            map: text("global_frame_id"),
            odom: text("odom_frame_id"),
            base: text("base_frame_id"),
        }
    }
}

/// The estimate at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Its time.
    pub at: Nanoseconds,
    /// The pose in the map: metres, metres, radians.
    pub pose: Planar,
    /// The covariance of the pose: m², m rad, rad².
    pub covariance: [[f64; 3]; 3],
    /// The pose in the odometry frame at the same time.
    pub odometry: Planar,
    /// What determines the pose.
    pub mode: Mode,
    /// The verdict.
    pub verdict: Verdict,
}

impl View {
    /// The estimate of a localizer.
    #[must_use]
    pub fn of(localizer: &Localizer, mode: Mode, at: Nanoseconds, odometry: Planar) -> Self {
        let pose = localizer.pose();
        let numbers = [pose.x.0, pose.y.0, pose.heading.radians().0].map(f64::from);
        let full = localizer.filter().covariance();
        let cell = |row: usize, column: usize| {
            f64::from(full.as_slice().get(7 * row + column).copied().unwrap_or(f32::NAN))
        };
        let covariance = [0, 1, 2].map(|row| [0, 1, 2].map(|column| cell(row, column)));
        let verdict = localizer.health().verdict;
        Self { at, pose: numbers, covariance, odometry, mode, verdict }
    }

    /// Whether the pose is known at all.
    #[must_use]
    pub fn has_pose(&self) -> bool {
        self.mode != Mode::Searching
    }

    /// The pose with its covariance in the map.
    #[must_use]
    pub fn pose_message(&self, frames: &Frames) -> PoseWithCovarianceStamped {
        let mut message = PoseWithCovarianceStamped {
            header: header(self.at, &frames.map),
            ..PoseWithCovarianceStamped::default()
        };
        message.pose.pose = geometry::pose(self.pose);
        message.pose.covariance = geometry::covariance(self.covariance);
        message
    }

    /// The transform from the map to the odometry frame, valid until `tolerance` after the estimate: its stamp is in the future, as
    /// AMCL's is, so that whoever asks for the pose of now need not wait.
    #[must_use]
    pub fn map_to_odom(&self, frames: &Frames, tolerance: Nanoseconds) -> TransformStamped {
        let odom = moved(self.pose, between(self.odometry, [0.0; 3]));
        transform(self.at + tolerance, [&frames.map, &frames.odom], odom)
    }

    /// The transform from the odometry frame to the robot.
    #[must_use]
    pub fn odom_to_base(&self, frames: &Frames) -> TransformStamped {
        transform(self.at, [&frames.odom, &frames.base], self.odometry)
    }

    /// The odometry, of a robot that publishes none itself.
    #[must_use]
    pub fn odometry_message(&self, frames: &Frames) -> Odometry {
        let mut message = Odometry {
            header: header(self.at, &frames.odom),
            child_frame_id: frames.base.clone(),
            ..Odometry::default()
        };
        message.pose.pose = geometry::pose(self.odometry);
        message
    }
}

/// A header.
#[must_use]
pub fn header(at: Nanoseconds, frame: &str) -> Header {
    Header { stamp: Time::of_nanoseconds(at), frame_id: frame.to_owned() }
}

/// The placement of a frame in its parent: metres, metres, radians.
#[must_use]
pub fn transform(
    at: Nanoseconds,
    [parent, child]: [&str; 2],
    [x, y, heading]: Planar,
) -> TransformStamped {
    TransformStamped {
        header: header(at, parent),
        child_frame_id: child.to_owned(),
        transform: Transform {
            translation: geometry::vector(x, y),
            rotation: geometry::quaternion(heading),
        },
    }
}

/// The hypotheses of a search, as AMCL publishes its particles; the weights are the shares of the echoes that they explain.
#[must_use]
pub fn particles(search: &Search, at: Nanoseconds, frames: &Frames) -> ParticleCloud {
    let particle = |pose: &sonarfix::geometry::pose::Pose, weight: f32| Particle {
        pose: geometry::pose([pose.x.0, pose.y.0, pose.heading.radians().0].map(f64::from)),
        weight: f64::from(weight),
    };
    let particles = search.hypotheses().map(|of| particle(&of.pose, of.explained)).collect();
    ParticleCloud { header: header(at, &frames.map), particles }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transforms_chain_to_the_pose() {
        let view = View {
            at: 5_000_000_000,
            pose: [3.0, -1.0, 2.5],
            covariance: [[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]],
            odometry: [0.5, 0.25, -3.0],
            mode: Mode::Tracking,
            verdict: Verdict::Tracking,
        };
        let [map, odom, base] = ["map", "odom", "base"].map(str::to_owned);
        let frames = Frames { map, odom, base };
        let place = |of: &TransformStamped| {
            let to = &of.transform;
            [to.translation.x, to.translation.y, geometry::heading(&to.rotation).unwrap()]
        };
        let correction = view.map_to_odom(&frames, 1_000_000_000);
        assert_eq!(correction.header.stamp, Time { sec: 6, nanosec: 0 });
        assert_eq!(correction.header.frame_id, "map");
        let chained = moved(place(&correction), place(&view.odom_to_base(&frames)));
        let off = between(view.pose, chained);
        assert!(off.iter().all(|error| error.abs() < 1e-9), "{off:?}");
        let covariance = view.pose_message(&frames).pose.covariance.0;
        assert_eq!(
            [covariance[0][5], covariance[5][5]].map(f64::to_bits),
            [3.0_f64, 6.0].map(f64::to_bits)
        );
    }
}
