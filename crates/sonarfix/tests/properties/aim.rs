//! Which wall is looked at, against the rules of `docs/model.md` ("Which walls count") in `f64`.

use proptest::prelude::*;
use sonarfix::aim::{Aim, NoAim, Policy};
use sonarfix::config::Config;
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::motion::WheelTravel;
use sonarfix::pose::{Point, Pose};
use sonarfix::range::ExpectedRange;
use sonarfix::units::{Instant, Metres, Radians};

use crate::oracle::{
    HEADING, Matrix, Row, Vector, View, corrected, covariance_of, state_of, turn_between,
};
use crate::strategies::{Sight, any_mount, any_room, any_sight, config_for_rooms};

/// The rules in `f64`. Every condition is a margin: positive if it holds, in metres or radians;
/// so a case that hangs on a rounding can be told.
struct Rules {
    config: Config,
    state: Vector,
    p: Matrix,
    views: Vec<View>,
}

impl Rules {
    fn new(localizer: &Localizer, ends: &[(Point, Point)]) -> Self {
        let config = *localizer.config();
        Self {
            config,
            state: state_of(localizer.filter()),
            p: covariance_of(localizer.filter()),
            views: ends.iter().map(|e| View::new(e.0, e.1, config.sonar.mount)).collect(),
        }
    }

    fn confidence(&self) -> f64 {
        self.config.trust.confidence.into()
    }

    fn heading_doubt(&self) -> f64 {
        self.confidence() * self.heading_deviation()
    }

    fn heading_deviation(&self) -> f64 {
        self.p[(HEADING, HEADING)].sqrt()
    }

    /// What of the cone is left for a beam to be square in; negative if it is not to look.
    fn clear_cone(&self) -> f64 {
        let cone = f64::from(self.config.sonar.cone.0);
        let clear = cone - self.heading_doubt();
        // However much confidence is asked for, two standard deviations must do.
        if 2.0 * self.heading_deviation() < cone { clear.max(0.25 * cone) } else { clear }
    }

    fn sonar(&self) -> (f64, f64) {
        self.views[0].sonar(&self.state)
    }

    fn deviation_along(&self, x: f64, y: f64) -> f64 {
        let p = &self.p;
        (p[(0, 0)] * x * x + 2.0 * p[(0, 1)] * x * y + p[(1, 1)] * y * y).sqrt()
    }

    /// From the sonar to the foot: distance and direction in the map.
    fn foot(&self, wall: usize) -> (f64, f64) {
        let view = &self.views[wall];
        let signed = view.distance(self.sonar());
        let (tx, ty, _) = view.tangent();
        let (a, b) = (-ty * -signed.signum(), tx * -signed.signum());
        (signed.abs(), b.atan2(a))
    }

    /// The bearing at which the wall is met squarely.
    fn bearing(&self, wall: usize) -> f64 {
        turn_between(self.foot(wall).1, self.state[HEADING])
    }

    /// Foot on the wall and range within the sonar's, by the pose's uncertainty.
    fn measurable(&self, wall: usize) -> f64 {
        let view = &self.views[wall];
        let (tx, ty, length) = view.tangent();
        let along = view.along(self.sonar());
        let to_end = along.min(length - along) - self.confidence() * self.deviation_along(tx, ty);
        let range = view.heard(&self.state);
        let limits =
            (f64::from(self.config.sonar.min_range.0), f64::from(self.config.sonar.max_range.0));
        let to_limit = (range - limits.0).min(limits.1 - range)
            - self.confidence() * self.deviation_along(-ty, tx);
        to_end.min(to_limit)
    }

    /// Within the servo's reach.
    fn reached(&self, wall: usize) -> f64 {
        let (right, left) = self.config.sonar.servo;
        let bearing = self.bearing(wall);
        (bearing - f64::from(right.0)).min(f64::from(left.0) - bearing)
    }

    /// Nothing before the foot, nothing nearer in the cone.
    fn clear(&self, wall: usize) -> f64 {
        let others = (0..self.views.len()).filter(|&other| other != wall);
        -others.map(|other| self.hides(other, wall)).fold(f64::NEG_INFINITY, f64::max)
    }

    fn hides(&self, other: usize, wall: usize) -> f64 {
        let (distance, axis) = self.foot(wall);
        let cone =
            (f64::from(self.config.sonar.cone.0) + self.heading_doubt()).min(75_f64.to_radians());
        let sonar = self.sonar();
        // Polar: distance from the sonar and angle off the beam.
        let polar = |p: (f64, f64)| {
            let (dx, dy) = (p.0 - sonar.0, p.1 - sonar.1);
            (dx.hypot(dy), turn_between(dy.atan2(dx), axis))
        };
        let answers = |p: (f64, f64)| {
            let (r, off) = polar(p);
            (distance - r).min(cone - off.abs())
        };
        let view = &self.views[other];
        let ends = answers(view.from).max(answers(view.to));
        let (tx, ty, length) = view.tangent();
        let along = view.along(sonar);
        let foot = (view.from.0 + tx * along, view.from.1 + ty * along);
        let nearest = along.min(length - along).min(answers(foot));
        // The beam from the sonar to the foot of `wall` against the other wall, by the sides on
        // which the ends of each lie of the line of the other.
        let target = (sonar.0 + distance * axis.cos(), sonar.1 + distance * axis.sin());
        let side_of_beam = |p: (f64, f64)| {
            let (r, off) = polar(p);
            r * off.sin()
        };
        let parts = |a: f64, b: f64| a.max(b).min(-a.min(b));
        let cuts = parts(side_of_beam(view.from), side_of_beam(view.to))
            .min(parts(view.distance(sonar), view.distance(target)));
        ends.max(nearest).max(cuts)
    }

    fn jacobian(&self, wall: usize) -> Row {
        self.views[wall].by_state(&self.state)
    }

    /// The drop of the position's variance, by trying the correction.
    fn gain(&self, wall: usize) -> f64 {
        let range = self.views[wall].heard(&self.state);
        let noise = &self.config.sonar.noise;
        let r = f64::from(noise.floor.0).powi(2) + (f64::from(noise.per_metre) * range).powi(2);
        let (_, after) = corrected(&self.p, &self.jacobian(wall), r);
        self.p[(0, 0)] + self.p[(1, 1)] - after[(0, 0)] - after[(1, 1)]
    }

    fn score(&self, wall: usize) -> f64 {
        match self.config.policy {
            Policy::Nearest => -self.views[wall].heard(&self.state),
            Policy::Informative => self.gain(wall),
        }
    }

    /// The walls that count by these margins; `None` if one hangs on a rounding.
    fn count(&self, margin: impl Fn(usize) -> f64) -> Option<Vec<usize>> {
        let margins: Vec<_> = (0..self.views.len()).map(&margin).collect();
        // The servo's ±π is the same direction twice; a wall there hangs on a rounding, too.
        margins
            .iter()
            .all(|m| m.abs() > 1e-3)
            .then(|| (0..margins.len()).filter(|&wall| margins[wall] > 0.0).collect())
    }

    fn countable(&self, wall: usize) -> f64 {
        self.measurable(wall).min(self.clear(wall))
    }
}

/// The aim is one of those that count, and none of them has a better score.
fn is_best(
    rules: &Rules,
    counting: &[usize],
    score: impl Fn(usize) -> f64,
    aim: Result<Aim, NoAim>,
) -> Result<(), TestCaseError> {
    let Ok(aim) = aim else {
        prop_assert_eq!(aim, Err(NoAim::NoWall));
        prop_assert!(counting.is_empty(), "{counting:?} count");
        return Ok(());
    };
    let wall = aim.wall.0 as usize;
    prop_assert!(counting.contains(&wall), "{wall} is none of {counting:?}");
    let best = counting.iter().map(|&wall| score(wall)).fold(f64::NEG_INFINITY, f64::max);
    prop_assert!(score(wall) >= best - 1e-3 * best.abs(), "{} is less than {best}", score(wall));
    let range = rules.views[wall].heard(&rules.state);
    prop_assert!((f64::from(aim.range.0) - range).abs() < 1e-5);
    Ok(())
}

/// A robot at the origin, and what a drive leaves of its covariance.
fn started(
    config: Config,
    walls: &[Wall],
    pose: Pose,
    deviation: f32,
    drive: (f32, f32, u8),
) -> Localizer<'_> {
    let start =
        Start { pose, position_deviation: Metres(deviation), heading_deviation: Radians(0.01) };
    let mut localizer =
        Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap();
    for step in 1..=u64::from(drive.2) {
        let travel = WheelTravel::new(drive.0, drive.1);
        localizer.odometry(Instant::from_ticks(100_000 * step), travel).unwrap();
    }
    localizer
}

#[expect(clippy::cast_possible_truncation, reason = "rounded to a nearby bearing")]
fn single(angle: f64) -> f32 {
    angle as f32
}

fn any_policy() -> impl Strategy<Value = Policy> {
    prop_oneof![Just(Policy::Nearest), Just(Policy::Informative)]
}

prop_compose! {
    /// A config with another mount, servo, cone, range and policy.
    fn any_config()(
        mount in any_mount(), policy in any_policy(), cone in 0.1_f32..0.5, max in 3.0_f32..9.0,
        right in -3.1_f32..-0.5, left in 0.5_f32..3.1, confidence in 0.5_f32..4.0,
    ) -> Config {
        let mut config = config_for_rooms(mount);
        config.policy = policy;
        config.sonar.cone = Radians(cone);
        config.sonar.max_range = Metres(max);
        config.sonar.servo = (Radians(right), Radians(left));
        config.trust.confidence = confidence;
        config
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1024, max_global_rejects: 8192, ..ProptestConfig::default() })]

    /// Among random walls the aim is the best of those that count, or there is none.
    #[test]
    fn the_best_wall_that_counts_is_chosen(
        config in any_config(), sights in proptest::collection::vec(any_sight(), 1..7), heading in -3.1_f32..3.1,
        deviation in 0.005_f32..0.3, drive in (-0.05_f32..0.05, -0.05_f32..0.05, 0_u8..20), askew in -3.1_f32..3.1,
        fixes in 0_u8..4,
    ) {
        let ends: Vec<_> = sights.iter().map(|s| s.ends(Point::default())).collect();
        let walls: Vec<_> = ends.iter().map(|e| Wall::new(e.0, e.1).unwrap()).collect();
        let pose = Pose::new(0.0, 0.0, Radians(heading));
        let mut localizer = started(config, &walls, pose, deviation, drive);
        // Fixes make the position sharp along one line and leave it blunt along the other.
        for _ in 0..fixes {
            if let Ok(aim) = localizer.aim() {
                prop_assert!(matches!(localizer.fix(&aim, Some(aim.range)), Fix::Accepted(_)));
            }
        }
        let localizer = localizer;
        let rules = Rules::new(&localizer, &ends);
        let sure = rules.clear_cone();
        prop_assume!(sure.abs() > 1e-4);
        if sure < 0.0 {
            prop_assert_eq!(localizer.aim(), Err(NoAim::HeadingUncertain));
            prop_assert_eq!(localizer.aim_at(Radians(askew)), Err(NoAim::HeadingUncertain));
            return Ok(());
        }
        let counting = rules.count(|wall| rules.countable(wall).min(rules.reached(wall)));
        prop_assume!(counting.is_some());
        let counting = counting.unwrap();
        let aim = localizer.aim();
        is_best(&rules, &counting, |wall| rules.score(wall), aim)?;
        if let Ok(aim) = aim {
            // Square to within the rounding of two angles.
            let off = turn_between(aim.bearing.0.into(), rules.bearing(aim.wall.0 as usize));
            prop_assert!(off.abs() < 2e-6, "off by {off}");
        }

        // At a bearing of somebody else's choice: towards a wall or anywhere.
        for bearing in counting.iter().map(|&w| rules.bearing(w) + 0.1).chain([f64::from(askew)]) {
            let square = |wall| sure - turn_between(rules.bearing(wall), bearing).abs();
            let counting = rules.count(|wall| rules.countable(wall).min(square(wall)));
            prop_assume!(counting.is_some());
            let bearing = Radians(single(bearing));
            let aim = localizer.aim_at(bearing);
            is_best(&rules, &counting.unwrap(), |wall| -rules.views[wall].heard(&rules.state), aim)?;
            prop_assert!(aim.is_err() || aim.unwrap().bearing == bearing);
        }
    }
}

proptest! {
    /// In a room every wall counts, so the policy alone decides.
    #[test]
    fn in_a_room_the_policy_decides(
        room in any_room(), mount in any_mount(), policy in any_policy(), deviation in 0.005_f32..0.05,
        drive in (-0.04_f32..0.04, -0.04_f32..0.04, 0_u8..10), fixes in 0_u8..3,
    ) {
        let mut config = config_for_rooms(mount);
        config.policy = policy;
        // Turning on the spot must not make the heading less certain than the cone is wide.
        config.prior.track_width = Metres(0.002);
        let walls = room.walls();
        let mut localizer = started(config, &walls, room.robot, deviation, drive);
        for _ in 0..fixes {
            let aim = localizer.aim().unwrap();
            prop_assert!(matches!(localizer.fix(&aim, Some(aim.range)), Fix::Accepted(_)));
        }
        let ends: Vec<_> = walls.iter().map(|w| (w.from(), w.to())).collect();
        let rules = Rules::new(&localizer, &ends);
        is_best(&rules, &[0, 1, 2, 3], |wall| rules.score(wall), localizer.aim())?;
    }

    /// A wall with a shorter one before it is not chosen, near as it may be; without that one, it
    /// is.
    #[test]
    fn a_hidden_wall_is_never_chosen(room in any_room(), share in 0.2_f32..0.8, half in 0.2_f32..0.5, aslant in -0.4_f32..0.4) {
        let mut config = config_for_rooms(Point::default());
        config.policy = Policy::Nearest;
        let mut walls = room.walls().to_vec();
        let open = started(config, &walls, room.robot, 0.01, (0.0, 0.0, 0));
        let target = open.aim().unwrap();
        // A board across the beam. Slanted by more than its ends are long, its own foot is off it.
        let beam = room.robot.heading.turned(target.bearing).radians().0;
        let middle = target.range.0 * share;
        let across = beam + core::f32::consts::FRAC_PI_2 + aslant;
        let end = |s: f32| Point::new(
            room.robot.x.0 + middle * beam.cos() + s * across.cos(),
            room.robot.y.0 + middle * beam.sin() + s * across.sin(),
        );
        walls.push(Wall::new(end(-half), end(half)).unwrap());
        let closed = started(config, &walls, room.robot, 0.01, (0.0, 0.0, 0));
        let aim = closed.aim().unwrap();
        prop_assert_ne!(aim.wall, target.wall);
        // Nor by its bearing.
        let at = closed.aim_at(target.bearing);
        prop_assert!(at.is_err() || at.unwrap().wall != target.wall);
    }

    /// A post nearer than the wall and inside the cone masks it; outside the cone it does not.
    #[test]
    fn an_edge_in_the_cone_masks_a_wall(room in any_room(), share in 0.3_f32..0.8, left in any::<bool>(), inside in any::<bool>()) {
        let mut config = config_for_rooms(Point::default());
        config.policy = Policy::Nearest;
        let mut walls = room.walls().to_vec();
        let target = started(config, &walls, room.robot, 0.01, (0.0, 0.0, 0)).aim().unwrap();
        let beam = room.robot.heading.turned(target.bearing).radians().0;
        // The cone is 15°, and 3 · 0.01 rad more for the heading: 16.7°.
        let off = if inside { 16.0_f32 } else { 18.0 }.to_radians();
        let side = if left { 1.0 } else { -1.0 };
        // The edge of a board that leads away behind it, pointing at the robot: its foot is off it.
        let end = |r: f32| Point::new(
            room.robot.x.0 + r * (beam + side * off).cos(),
            room.robot.y.0 + r * (beam + side * off).sin(),
        );
        let near = target.range.0 * share;
        walls.push(Wall::new(end(near), end(near + 0.05)).unwrap());
        let aim = started(config, &walls, room.robot, 0.01, (0.0, 0.0, 0)).aim().unwrap();
        prop_assert_eq!(aim.wall != target.wall, inside);
    }

    /// A wall whose foot is beside it does not count, however near; nor one that is nearly beside.
    #[test]
    fn a_foot_beside_its_wall_is_never_chosen(direction in -3.1_f32..3.1, distance in 0.5_f32..4.0, inward in -1.0_f32..0.5) {
        let config = config_for_rooms(Point::default());
        let deviation = 0.02_f32;
        // The end is `inward` metres past the foot; 3 · 2 cm are needed.
        prop_assume!((inward - 0.06).abs() > 1e-3);
        let sight = Sight { direction, distance, foot: inward / 4.0, length: 4.0, flipped: false };
        let walls = [sight.wall(Point::default())];
        let localizer = started(config, &walls, Pose::default(), deviation, (0.0, 0.0, 0));
        let aim = localizer.aim();
        prop_assert_eq!(aim.is_ok(), inward > 0.06, "{:?}", aim);
        prop_assert!(aim.is_ok() || aim == Err(NoAim::NoWall));
    }

    /// The uncertainty that counts is that along the wall for its ends, across it for its range.
    /// After a fix of a slanted wall it is millimetres across that, and as before along it.
    #[test]
    fn the_uncertainty_along_and_across_a_wall_is_told_apart(direction in -3.1_f32..3.1, inward in 0.01_f32..0.6, deviation in 0.1_f32..0.15) {
        let config = config_for_rooms(Point::default());
        let sight = |direction, foot| Sight { direction, distance: 2.0, foot, length: 4.0, flipped: false };
        // The second wall stands square to the first, which makes sharp what is along the second;
        // the foot on it is `inward` metres from its end.
        let square = direction + core::f32::consts::FRAC_PI_2;
        let walls = [sight(direction, 0.5), sight(square, inward / 4.0)].map(|s| s.wall(Point::default()));
        let blunt = started(config, &walls, Pose::default(), deviation, (0.0, 0.0, 0));
        let mut sharp = blunt.clone();
        let aim = sharp.aim_at(Radians(direction)).unwrap();
        prop_assert_eq!(aim.wall, WallId(0));
        prop_assert!(matches!(sharp.fix(&aim, Some(aim.range)), Fix::Accepted(_)));
        // 3 σ: of the start, and of the noise of a range of 2 m (6 mm, and 1 % for its scale).
        prop_assume!((inward - 3.0 * deviation).abs() > 1e-3 && (inward - 0.065).abs() > 0.01);
        let bearing = Radians(square);
        prop_assert_eq!(blunt.aim_at(bearing).is_ok(), inward > 3.0 * deviation);
        prop_assert_eq!(sharp.aim_at(bearing).is_ok(), inward > 0.065);
        // Along the first nothing was learnt.
        let deviations = sharp.filter().covariance();
        let trace = deviations[(0, 0)] + deviations[(1, 1)];
        prop_assert!((trace - deviation * deviation) < 0.1 * deviation * deviation);
    }

    /// Out of range, with the uncertainty of the distance.
    #[test]
    fn a_wall_out_of_range_is_never_chosen(direction in -3.1_f32..3.1, distance in 0.06_f32..6.0, min in 0.05_f32..1.0, max in 2.0_f32..5.0) {
        let mut config = config_for_rooms(Point::default());
        config.sonar.min_range = Metres(min);
        config.sonar.max_range = Metres(max);
        let sight = Sight { direction, distance, foot: 0.5, length: 4.0, flipped: false };
        let walls = [sight.wall(Point::default())];
        let localizer = started(config, &walls, Pose::default(), 0.02, (0.0, 0.0, 0));
        let slack = (distance - min).min(max - distance) - 0.06;
        prop_assume!(slack.abs() > 1e-3);
        prop_assert_eq!(localizer.aim().is_ok(), slack > 0.0);
    }

    /// A servo that does not turn all the way; a given bearing is not the servo's affair.
    #[test]
    fn the_servo_is_never_asked_beyond_its_reach(direction in -3.1_f32..3.1, right in -3.0_f32..0.0, reach in 0.1_f32..3.0) {
        let mut config = config_for_rooms(Point::default());
        let left = right + reach;
        config.sonar.servo = (Radians(right), Radians(left));
        let sight = Sight { direction, distance: 2.0, foot: 0.5, length: 4.0, flipped: false };
        let walls = [sight.wall(Point::default())];
        let localizer = started(config, &walls, Pose::default(), 0.02, (0.0, 0.0, 0));
        let slack = (direction - right).min(left - direction);
        prop_assume!(slack.abs() > 1e-4);
        prop_assert_eq!(localizer.aim().is_ok(), slack > 0.0);
        prop_assert_eq!(localizer.aim_at(Radians(direction)).map(|a| a.wall), Ok(WallId(0)));
    }

    /// When the heading may be wrong by more than the cone, nothing is square for certain.
    #[test]
    fn an_uncertain_heading_has_no_aim(room in any_room(), deviation in 0.01_f32..0.3) {
        let config = config_for_rooms(Point::default());
        let walls = room.walls();
        let start = Start { heading_deviation: Radians(deviation), ..room.start() };
        let mut localizer = Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(0)).unwrap();
        // However much confidence is asked for (here 3), two standard deviations must do.
        let sure = config.sonar.cone.0 - 2.0 * deviation;
        prop_assume!(sure.abs() > 1e-4);
        let aim = localizer.aim();
        prop_assert_eq!(aim.is_ok(), sure > 0.0);
        if sure < 0.0 {
            prop_assert_eq!(aim, Err(NoAim::HeadingUncertain));
            let bearing = Radians(0.0);
            prop_assert_eq!(localizer.aim_at(bearing), Err(NoAim::HeadingUncertain));
            let blind = Aim { wall: WallId(0), bearing, range: Metres(1.0) };
            prop_assert!(matches!(localizer.fix(&blind, Some(Metres(1.0))), Fix::Refused(_)));
        }
    }

    /// What the localizer aims at, it takes a range of.
    #[test]
    fn an_aim_can_be_fixed(room in any_room(), mount in any_mount(), policy in any_policy()) {
        let mut config = config_for_rooms(mount);
        config.policy = policy;
        let walls = room.walls();
        let mut localizer = started(config, &walls, room.robot, 0.03, (0.02, 0.01, 3));
        for _ in 0..20 {
            let aim = localizer.aim().unwrap();
            let expected = ExpectedRange::new(&walls[aim.wall.0 as usize], mount, &localizer.filter().state());
            prop_assert_eq!(aim.range, expected.range);
            prop_assert!(matches!(localizer.fix(&aim, Some(aim.range)), Fix::Accepted(_)));
        }
    }
}

#[test]
fn an_empty_map_has_no_aim() {
    let localizer =
        started(config_for_rooms(Point::default()), &[], Pose::default(), 0.01, (0.0, 0.0, 0));
    assert_eq!(localizer.aim(), Err(NoAim::NoWall));
    assert_eq!(localizer.aim_at(Radians(0.0)), Err(NoAim::NoWall));
}
