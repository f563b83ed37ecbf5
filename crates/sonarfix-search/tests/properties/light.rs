//! The search with a time-of-flight ranger.

use sonarfix::config::{LightBeam, RangerParameters, Ranging};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::{Map, Wall};
use sonarfix_search::search::{Answer, Search, SearchParameters};

use crate::search::{EVALUATIONS, Room, sonar, start};

/// The distance along a beam to a wall, metres, in `f64`; `None` if it does not meet it. The point from + r u is on the line
/// p + s (q − p); both unknowns by Cramer's rule.
fn crossing(wall: &Wall, from: (f64, f64), u: (f64, f64)) -> Option<f64> {
    let wide = |at: Point| (f64::from(at.x.0), f64::from(at.y.0));
    let (p, q) = (wide(wall.from()), wide(wall.to()));
    let (w, v) = ((p.0 - from.0, p.1 - from.1), (q.0 - p.0, q.1 - p.1));
    let determinant = u.1 * v.0 - u.0 * v.1;
    let along = (w.1 * v.0 - w.0 * v.1) / determinant;
    let share = (u.0 * w.1 - u.1 * w.0) / determinant;
    (along > 0.0 && (0.0..=1.0).contains(&share)).then_some(along)
}

/// The range along a beam in a room, `None` beyond the reach.
fn range_in(
    walls: &[Wall],
    sonar: &RangerParameters,
    pose: Pose,
    bearing: Radians,
) -> Option<Metres> {
    let mount = pose.to_map(sonar.mount);
    let angle = f64::from(pose.heading.radians().0) + f64::from(bearing.0);
    let from = (f64::from(mount.x.0), f64::from(mount.y.0));
    let beam = (angle.cos(), angle.sin());
    let nearest =
        walls.iter().filter_map(|wall| crossing(wall, from, beam)).min_by(f64::total_cmp)?;
    #[expect(clippy::cast_possible_truncation, reason = "a few metres")]
    let range = Metres(nearest as f32);
    (range <= sonar.max_range).then_some(range)
}

fn light() -> Ranging {
    Ranging::Light(LightBeam::VL53L1X)
}

/// The search finds the pose of a robot that measures with light: from several starts, with ranges that are rounded to 1 cm.
#[test]
fn a_robot_with_light_is_found_once_it_has_driven() {
    let room = Room::irregular();
    let mut ranger = sonar();
    ranger.ranging = light();
    ranger.cone = Radians::from_degrees(40.0);
    for mut pose in [
        start(2.6, 2.0, 90.0),
        start(1.6, 3.0, 180.0),
        start(1.6, 1.0, 0.0),
        start(0.7, 1.6, -85.0),
        start(2.4, 1.4, 60.0),
    ] {
        let map = Map::new(&room.walls);
        let mut search: Search = Search::new(&ranger, map, SearchParameters::default());
        for _ in 0..160 {
            let (step, turn) = (0.03, Radians(0.03));
            let middle = pose.heading.turned(turn * 0.5);
            let ahead = Pose { heading: middle, ..pose }.to_map(Point::new(step, 0.0));
            pose = Pose { x: ahead.x, y: ahead.y, heading: pose.heading.turned(turn) };
            search.odometry(Metres(step), turn).unwrap();
            let bearing = search.aim();
            let range = range_in(&room.walls, &ranger, pose, bearing);
            let rounded = range.map(|range| Metres((range.0 * 100.0).round() / 100.0));
            search.ping(bearing, rounded).unwrap();
            search.poll(EVALUATIONS);
        }
        let Answer::Unique(found) = search.answer() else {
            panic!("{pose:?}: {:?}", search.answer());
        };
        let off = ((found.pose.x - pose.x).0, (found.pose.y - pose.y).0);
        let turn = found.pose.heading.from(pose.heading).abs();
        assert!(off.0.hypot(off.1) < 0.05 && turn < Radians(0.03), "{found:?}, but {pose:?}");
    }
}
