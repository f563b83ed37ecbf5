//! The world as the paper's ideal sonar meets it: smooth walls that answer from the foot of the
//! perpendicular, the nearest one inside the cone first.

use sonarfix_map::Floor;

use crate::angle;

/// What a ping met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// Index of the wall in the floor.
    pub wall: usize,
    /// True distance of the sonar from the wall, metres.
    pub distance: f64,
}

/// Where a ping is sent from and how far it reaches; metres and radians, map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ping {
    /// Position of the sonar.
    pub from: [f64; 2],
    /// Direction of the beam's axis.
    pub direction: f64,
    /// Half of the cone.
    pub cone: f64,
    /// Shortest and longest range the sonar reports.
    pub reach: (f64, f64),
}

/// A wall as the world computes with it: its ends, unit tangent and length.
#[derive(Debug, Clone, Copy)]
struct Segment {
    from: [f64; 2],
    tangent: [f64; 2],
    length: f64,
}

/// The walls that are really there.
#[derive(Debug, Clone)]
pub struct World {
    segments: Vec<Segment>,
}

impl World {
    /// A world of a floor's walls, in the same order.
    #[must_use]
    pub fn new(floor: &Floor) -> Self {
        let segments = floor.named_walls().iter().map(|w| Segment::new(w.from(), w.to())).collect();
        Self { segments }
    }

    /// The first echo of a ping, if any wall answers.
    #[must_use]
    pub fn first_echo(&self, ping: &Ping) -> Option<Echo> {
        let mut first: Option<Echo> = None;
        for (wall, segment) in self.segments.iter().enumerate() {
            let Some((foot, distance)) = segment.foot(ping.from) else {
                continue;
            };
            let (nearest, farthest) = ping.reach;
            let in_reach = distance >= nearest && distance <= farthest;
            if !in_reach || first.is_some_and(|echo| echo.distance <= distance) {
                continue;
            }
            let towards = (foot[1] - ping.from[1]).atan2(foot[0] - ping.from[0]);
            let in_cone = angle::wrap(towards - ping.direction).abs() <= ping.cone;
            if in_cone && !self.is_blocked(wall, ping.from, foot) {
                first = Some(Echo { wall, distance });
            }
        }
        first
    }

    fn is_blocked(&self, target: usize, from: [f64; 2], to: [f64; 2]) -> bool {
        let mut others = self.segments.iter().enumerate().filter(|(wall, _)| *wall != target);
        others.any(|(_, segment)| segment.crosses(from, to))
    }
}

impl Segment {
    fn new(from: [f64; 2], to: [f64; 2]) -> Self {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = dx.hypot(dy);
        Self { from, tangent: [dx / length, dy / length], length }
    }

    /// Along the wall from its start, and signed distance from its line (left is positive).
    fn place(&self, point: [f64; 2]) -> (f64, f64) {
        let (dx, dy) = (point[0] - self.from[0], point[1] - self.from[1]);
        let [tx, ty] = self.tangent;
        (tx * dx + ty * dy, tx * dy - ty * dx)
    }

    /// Foot of the perpendicular from a point and its distance, if the foot lies on the wall.
    fn foot(&self, point: [f64; 2]) -> Option<([f64; 2], f64)> {
        let (along, off) = self.place(point);
        let on_wall = (0.0..=self.length).contains(&along);
        let [tx, ty] = self.tangent;
        on_wall.then(|| ([self.from[0] + along * tx, self.from[1] + along * ty], off.abs()))
    }

    /// Whether the straight way between two points passes through the wall.
    fn crosses(&self, from: [f64; 2], to: [f64; 2]) -> bool {
        let ((along_a, off_a), (along_b, off_b)) = (self.place(from), self.place(to));
        if (off_a > 0.0) == (off_b > 0.0) {
            return false;
        }
        let at = along_a + (along_b - along_a) * off_a / (off_a - off_b);
        (0.0..=self.length).contains(&at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room(walls: &[([f64; 2], [f64; 2])]) -> World {
        let segments = walls.iter().map(|&(from, to)| Segment::new(from, to)).collect();
        World { segments }
    }

    fn ping(direction: f64) -> Ping {
        Ping { from: [0.0, 0.0], direction, cone: 0.26, reach: (0.05, 10.0) }
    }

    #[test]
    fn an_oblique_beam_hears_the_perpendicular() {
        let world = room(&[([2.0, -5.0], [2.0, 5.0])]);
        for direction in [-0.25, 0.0, 0.25] {
            assert_eq!(world.first_echo(&ping(direction)), Some(Echo { wall: 0, distance: 2.0 }));
        }
        assert_eq!(world.first_echo(&ping(0.27)), None);
    }

    #[test]
    fn the_nearest_in_the_cone_answers() {
        let world = room(&[([2.0, -5.0], [2.0, 5.0]), ([1.0, -0.5], [1.0, 0.5])]);
        assert_eq!(world.first_echo(&ping(0.0)), Some(Echo { wall: 1, distance: 1.0 }));
    }

    #[test]
    fn a_wall_across_the_way_silences_the_one_behind() {
        // The diagonal stands before the far wall, and reflects away.
        let world = room(&[([2.0, -5.0], [2.0, 5.0]), ([1.0, -0.5], [1.6, 0.5])]);
        assert_eq!(world.first_echo(&ping(0.0)), None);
    }

    #[test]
    fn no_echo_without_a_foot_or_out_of_reach() {
        let beside = room(&[([2.0, 0.1], [2.0, 5.0])]);
        assert_eq!(beside.first_echo(&ping(0.0)), None);
        let far = room(&[([10.5, -5.0], [10.5, 5.0])]);
        assert_eq!(far.first_echo(&ping(0.0)), None);
    }
}
