//! The walls that were measured in a scan, and the choice of the next one.

use sonarfix::aim::{Aim, Choice, Standing};
use sonarfix::geometry::units::{Duration, Radians};
use sonarfix::localizer::Localizer;
use sonarfix_sim::angle;

/// The pings that were taken of one scan.
#[derive(Debug)]
pub struct Measured {
    aims: Vec<Aim>,
    /// Half of the cone of the sonar.
    cone: Radians,
}

impl Measured {
    /// Begins with the first ping of a sonar with this half of its cone.
    pub fn new(first: Aim, cone: Radians) -> Self {
        Self { aims: vec![first], cone }
    }

    /// The best ping by the policy at a wall that was not measured yet; it counts as measured from then on. `None` if there
    /// is no further wall.
    pub fn next_aim(&mut self, localizer: &Localizer) -> Option<Aim> {
        let last = self.aims.last()?;
        // All pings of a scan are of one instant: the sonar need not wait for the echoes of the one before.
        let standing = Standing { bearing: Some(last.bearing), ready_in: Duration::from_ticks(0) };
        let mut choice = Choice::standing(last.ranger, standing);
        loop {
            // After a result, the choice goes on with the candidates behind it.
            let Some(chosen) = localizer.choose(&mut choice) else { continue };
            let aim = chosen.ok()?;
            if self.aims.iter().all(|measured| self.are_apart(measured, &aim)) {
                self.aims.push(aim);
                return Some(aim);
            }
        }
    }

    /// Whether two pings measure two walls. A return in the cones of both may be the nearest of both, whichever wall was meant:
    /// that of another segment of the same line, of a wall behind it, or of a corner between them.
    fn are_apart(&self, one: &Aim, other: &Aim) -> bool {
        let turn = angle::wrap(f64::from((one.bearing - other.bearing).0)).abs();
        one.wall != other.wall && turn > 2.0 * f64::from(self.cone.0)
    }
}

#[cfg(test)]
mod tests {
    use sonarfix::config::{Config, RangerId};
    use sonarfix::geometry::pose::{Point, Pose};
    use sonarfix::geometry::units::{Instant, Metres};
    use sonarfix::localizer::Start;
    use sonarfix::map::{Map, Wall, WallId};

    use super::*;

    /// The walls of all pings of a scan at (2, 1), and their bearings in degrees.
    fn measured(ends: &[[f32; 4]]) -> Vec<(WallId, f32)> {
        let walls = ends
            .iter()
            .map(|[ax, ay, bx, by]| Wall::new(Point::new(*ax, *ay), Point::new(*bx, *by)).unwrap());
        let walls: Vec<Wall> = walls.collect();
        let mut config = Config::for_track_width(Metres(0.16));
        config.rangers.first.servo = (Radians::from_degrees(-180.0), Radians::from_degrees(180.0));
        let start = Start {
            pose: Pose::new(2.0, 1.0, Radians(0.0)),
            position_deviation: Metres(0.02),
            heading_deviation: Radians(0.01),
        };
        let now = Instant::from_ticks(0);
        let localizer = Localizer::new(config, Map::new(&walls), start, now).unwrap();
        let first = localizer.aim().unwrap();
        assert_eq!(first.ranger, RangerId::FIRST);
        let mut scan = Measured::new(first, config.rangers.first.cone);
        while scan.next_aim(&localizer).is_some() {}
        scan.aims.iter().map(|aim| (aim.wall, aim.bearing.0.to_degrees().round())).collect()
    }

    const BOX: [[f32; 4]; 4] =
        [[0.0, 0.0, 4.0, 0.0], [4.0, 0.0, 4.0, 3.0], [4.0, 3.0, 0.0, 3.0], [0.0, 3.0, 0.0, 0.0]];

    #[test]
    fn each_wall_is_measured_once() {
        let mut found = measured(&BOX);
        found.sort_by_key(|(wall, _)| *wall);
        let bearings: Vec<f32> =
            found.iter().map(|(_, bearing)| bearing.rem_euclid(360.0)).collect();
        assert_eq!(bearings, [270.0, 0.0, 90.0, 180.0], "{found:?}");
    }

    /// The foot lies on both segments of the southern line; the return would be the same.
    #[test]
    fn of_two_segments_of_a_line_one_is_measured() {
        let [_, others @ ..] = BOX;
        let segments = [[0.0, 0.0, 2.5, 0.0], [1.5, 0.0, 4.0, 0.0]];
        let walls: Vec<[f32; 4]> = segments.into_iter().chain(others).collect();
        let found = measured(&walls);
        let southern = found.iter().filter(|(_, bearing)| (bearing + 90.0).abs() < 2.0);
        assert_eq!((southern.count(), found.len()), (1, 4), "{found:?}");
    }
}
