//! The travel of two wheels between two poses.

use sonarfix_sim::angle;
use sonarfix_sim::trace::Pose;

/// A step between two poses as an arc of two wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Travel of the right and the left wheel, metres.
    pub travel: [f64; 2],
    /// The turn, radians counter-clockwise.
    pub turn: f64,
    /// Displacement across the mean heading, metres to the left. Two wheels that roll have none.
    pub sideways: f64,
}

impl Arc {
    /// The arc between two poses, for wheels so many metres apart.
    #[must_use]
    pub fn between(from: &Pose, to: &Pose, track_width: f64) -> Self {
        let turn = angle::wrap(to.heading - from.heading);
        let (sin, cos) = (from.heading + turn / 2.0).sin_cos();
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        let advance = cos * dx + sin * dy;
        let half = turn * track_width / 2.0;
        Self { travel: [advance + half, advance - half], turn, sideways: cos * dy - sin * dx }
    }

    /// The pose at the end of the travel of two wheels.
    #[must_use]
    pub fn end(from: &Pose, [right, left]: [f64; 2], track_width: f64) -> Pose {
        let turn = (right - left) / track_width;
        let (sin, cos) = (from.heading + turn / 2.0).sin_cos();
        let advance = f64::midpoint(right, left);
        let heading = angle::wrap(from.heading + turn);
        Pose { x: from.x + cos * advance, y: from.y + sin * advance, heading }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_travel_leads_to_the_pose() {
        let from = Pose { x: 1.0, y: -2.0, heading: 3.0 };
        for travel in [[0.1, 0.1], [0.2, -0.1], [0.0, 0.0], [-0.3, 0.4]] {
            let to = Arc::end(&from, travel, 0.35);
            let arc = Arc::between(&from, &to, 0.35);
            let error = arc.travel[0] - travel[0] + arc.travel[1] - travel[1] + arc.sideways;
            assert!(error.abs() < 1e-12, "{travel:?}");
        }
    }
}
