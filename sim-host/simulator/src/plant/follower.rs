//! Follows a path from corner to corner by the estimate: turns on the spot, then drives.

use sonarfix_map::Path;

use crate::angle;
use crate::trace::Pose;
use crate::world::segment::{direction, distance};

/// A motion command, valid until the next.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Command {
    /// Forward speed, m/s.
    pub speed: f64,
    /// Turn rate to the left, rad/s.
    pub turn_rate: f64,
}

/// A corner is reached when the estimate is this near, metres: half of the travel between two
/// commands at 0.4 m/s.
const REACHED: f64 = 0.02;
/// Above this heading error the robot stops and turns, radians.
const TURN_FIRST: f64 = 0.2;
/// Turn rate per heading error, 1/s: half of an error is gone after 0.35 s.
const GAIN: f64 = 2.0;

/// A path follower.
#[derive(Debug, Clone)]
pub struct Follower {
    /// Remaining corners, in reverse order.
    corners: Vec<[f64; 2]>,
    speed: f64,
    turn_rate: f64,
    /// Command period, seconds: it does not overshoot a corner within it.
    period: f64,
}

impl Follower {
    /// A follower that gives a command every `period` seconds.
    #[must_use]
    pub fn new(path: &Path, period: f64) -> Self {
        let plan = path.plan();
        let laps = (0..plan.laps).flat_map(|_| plan.corners.iter().copied());
        let mut corners: Vec<[f64; 2]> = laps.collect();
        corners.reverse();
        Self { corners, speed: plan.speed, turn_rate: plan.turn_rate, period }
    }

    /// The command at an estimated pose; zero at the end of the path.
    pub fn command(&mut self, pose: &Pose) -> Command {
        let at = [pose.x, pose.y];
        let (corner, left) = loop {
            let Some(&corner) = self.corners.last() else {
                return Command::default();
            };
            let left = distance(at, corner);
            if left <= REACHED {
                self.corners.pop();
            } else {
                break (corner, left);
            }
        };
        let off = angle::wrap(direction(at, corner) - pose.heading);
        let turn_rate = (GAIN * off).clamp(-self.turn_rate, self.turn_rate);
        let is_turning = off.abs() > TURN_FIRST;
        let speed = if is_turning { 0.0 } else { self.speed.min(left / self.period) };
        Command { speed, turn_rate }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_map::PathPlan;

    #[test]
    fn the_follower_reaches_every_corner_and_stops() {
        let path = Path::new(PathPlan {
            start: [0.0, 0.0],
            corners: vec![[2.0, 0.0], [2.0, 1.0], [0.0, 0.0]],
            laps: 2,
            speed: 0.3,
            turn_rate: 1.0,
        })
        .unwrap();
        let mut follower = Follower::new(&path, 0.1);
        let mut pose = Pose::default();
        let mut farthest = [0.0_f64, 0.0];
        for _ in 0..1_000 {
            let command = follower.command(&pose);
            pose.heading = angle::wrap(pose.heading + 0.1 * command.turn_rate);
            pose.x += 0.1 * command.speed * pose.heading.cos();
            pose.y += 0.1 * command.speed * pose.heading.sin();
            assert!(command.speed <= 0.3 && command.turn_rate.abs() <= 1.0);
            farthest = [farthest[0].max(pose.x), farthest[1].max(pose.y)];
        }
        assert_eq!(follower.command(&pose), Command::default());
        assert!(distance([pose.x, pose.y], [0.0, 0.0]) <= REACHED, "{pose:?}");
        assert!((farthest[0] - 2.0).abs() < 0.03 && (farthest[1] - 1.0).abs() < 0.03);
    }
}
