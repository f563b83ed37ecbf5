//! The walls of a survey compared with a map in the same frame.

use nalgebra::Vector2;

use crate::survey::Motion;
use crate::walls::MappedWall;

/// Farthest wall of the map that counts as the same, metres.
const FAR: f64 = 0.3;

/// A wall of the survey and the wall of the map that it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Counterpart {
    /// Index of the wall of the map.
    pub index: usize,
    /// Distance of the middle of the common part from the wall of the map, metres.
    pub offset: f64,
    /// Angle between both, radians, from 0 to π/2.
    pub angle: f64,
}

/// The nearest wall of a map, each with its two ends in metres, that lies along a wall of the survey; `None` if none is
/// within 30 cm.
#[must_use]
pub fn counterpart(wall: &MappedWall, map: &[[Vector2<f64>; 2]]) -> Option<Counterpart> {
    let along = (wall.to - wall.from).normalize();
    let candidates = map.iter().enumerate().filter_map(|(index, &[from, to])| {
        // The ends of a wall of the map have no order.
        let is_reversed = along.dot(&(to - from)) < 0.0;
        let (from, to) = if is_reversed { (to, from) } else { (from, to) };
        let offset = wall.apart(&MappedWall { from, to, ..*wall })?;
        let angle = along.perp(&(to - from).normalize()).abs().asin();
        (offset < FAR).then_some(Counterpart { index, offset, angle })
    });
    candidates.min_by(|one, other| one.offset.total_cmp(&other.offset))
}

/// Rounds of the alignment: each moves the ends to the feet on the walls of the map, as far as they were.
const ROUNDS: usize = 200;

/// The rigid motion that brings the walls of a survey nearest to their counterparts: the frame of a survey is that of the start
/// pose, which has an error of its own.
#[must_use]
pub fn alignment(walls: &[MappedWall], map: &[[Vector2<f64>; 2]]) -> Motion {
    let onto = |wall: &MappedWall| {
        let found = counterpart(wall, map)?;
        let &[from, to] = map.get(found.index)?;
        Some(([wall.from, wall.to], from, (to - from).normalize()))
    };
    let lines: Vec<_> = walls.iter().filter_map(onto).collect();
    let mut motion = Motion { turn: 0.0, shift: Vector2::zeros() };
    for _ in 0..ROUNDS {
        let pairs = lines.iter().flat_map(|&(ends, from, along)| {
            ends.map(|end| (end, from + along * along.dot(&(motion.of(&end) - from))))
        });
        motion = Motion::fit(&pairs.collect::<Vec<_>>());
    }
    motion
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::{alignment, counterpart};
    use crate::survey::Motion;
    use crate::walls::MappedWall;

    fn wall(from: Vector2<f64>, to: Vector2<f64>) -> MappedWall {
        let (echoes, accuracy, corners) = (0, 0.0, [false; 2]);
        MappedWall { from, to, echoes, accuracy, corners, is_confirmed: true }
    }

    #[test]
    fn the_nearest_parallel_wall_is_the_counterpart() {
        let at = Vector2::new;
        let wall = wall(at(0.0, 0.0), at(4.0, 0.04));
        let across = [at(2.0, -1.0), at(2.0, 1.0)];
        let beside = [at(5.0, 0.0), at(9.0, 0.0)];
        let near = [at(4.0, 0.03), at(0.0, 0.03)];
        let farther = [at(0.0, -0.2), at(4.0, -0.2)];
        let found = counterpart(&wall, &[across, beside, farther, near]).unwrap();
        assert_eq!(found.index, 3);
        assert!((found.offset - 0.01).abs() < 1e-4, "{}", found.offset);
        assert!((found.angle - 0.01).abs() < 1e-4, "{}", found.angle);
        assert_eq!(counterpart(&wall, &[across, beside]), None);
        assert_eq!(counterpart(&wall, &[[at(0.0, 0.5), at(4.0, 0.5)]]), None);
    }

    #[test]
    fn a_moved_room_is_moved_back() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]].map(Vector2::from);
        let map: Vec<_> = (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]).collect();
        let moved = Motion { turn: 0.02, shift: Vector2::new(-0.05, 0.07) };
        // Parts of the walls, as a survey finds them.
        let part = |&[from, to]: &[Vector2<f64>; 2]| {
            let end = |share: f64| moved.of(&(from + (to - from) * share));
            wall(end(0.1), end(0.7))
        };
        let walls: Vec<_> = map.iter().map(part).collect();
        let back = alignment(&walls, &map);
        assert!((back.turn + moved.turn).abs() < 1e-6, "{back:?}");
        for corner in corners {
            assert!((back.of(&moved.of(&corner)) - corner).norm() < 1e-5, "{back:?}");
        }
    }
}
