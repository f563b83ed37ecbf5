//! Which wall is looked at, against the rules of `docs/model.md` ("Which walls count") in `f64`.

use proptest::prelude::*;
use sonarfix::aim::{Aim, NoAim, Policy, Reason};
use sonarfix::config::{Config, Pace, Rhythm, Timing, Weights};
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::motion::WheelTravel;
use sonarfix::pose::{Point, Pose};
use sonarfix::range::ExpectedRange;
use sonarfix::units::{Duration, Instant, Metres, Radians, SquareMetres};

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

    /// How far the servo must stay off the square bearing.
    fn beyond_the_servo(&self, wall: usize) -> f64 {
        let (right, left) = self.config.sonar.servo;
        let (right, left) = (f64::from(right.0), f64::from(left.0));
        let bearing = self.bearing(wall);
        if (right..=left).contains(&bearing) {
            return 0.0;
        }
        turn_between(bearing, right).abs().min(turn_between(bearing, left).abs())
    }

    /// Within the servo's reach, or so near that the foot is surely in the cone.
    fn reached(&self, wall: usize) -> f64 {
        self.clear_cone() - self.beyond_the_servo(wall)
    }

    /// Nothing before the foot, nothing nearer in the cone.
    fn clear(&self, wall: usize) -> f64 {
        let others = (0..self.views.len()).filter(|&other| other != wall);
        -others.map(|other| self.hides(other, wall)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Whether `other` disturbs the echo of `wall`, for the worst error of the position in each
    /// condition.
    fn hides(&self, other: usize, wall: usize) -> f64 {
        let (distance, axis) = self.foot(wall);
        let cone =
            (f64::from(self.config.sonar.cone.0) + self.heading_doubt()).min(75_f64.to_radians());
        let sonar = self.sonar();
        let doubt_ahead = self.confidence() * self.deviation_along(axis.cos(), axis.sin());
        let doubt_aside = self.confidence() * self.deviation_along(-axis.sin(), axis.cos());
        // Along the beam and across it.
        let place = |p: (f64, f64)| {
            let (dx, dy) = (p.0 - sonar.0, p.1 - sonar.1);
            let (r, off) = (dx.hypot(dy), turn_between(dy.atan2(dx), axis));
            (r * off.cos(), r * off.sin())
        };
        let answers = |p: (f64, f64)| {
            let (ahead, aside) = place(p);
            let inside = cone.tan() * (ahead + doubt_ahead) + doubt_aside - aside.abs();
            let nearest_aside = (aside.abs() - doubt_aside).max(0.0);
            let nearer =
                (distance - ahead) * (distance + ahead + 2.0 * doubt_ahead) - nearest_aside.powi(2);
            inside.min(nearer).min(ahead + doubt_ahead).min(distance - ahead)
        };
        let view = &self.views[other];
        let ends = answers(view.from).max(answers(view.to));
        let (tx, ty, length) = view.tangent();
        let along = view.along(sonar);
        let foot = (view.from.0 + tx * along, view.from.1 + ty * along);
        let nearest = along.min(length - along).min(answers(foot));
        ends.max(nearest).max(self.cuts(place(view.from), place(view.to), wall))
    }

    /// Whether the wall between two places cuts a beam that starts within the doubt aside: the part
    /// of it that lies in that band, by a thousand points.
    fn cuts(&self, from: (f64, f64), to: (f64, f64), wall: usize) -> f64 {
        let (distance, axis) = self.foot(wall);
        let band = self.confidence() * self.deviation_along(-axis.sin(), axis.cos());
        let doubt_ahead = self.confidence() * self.deviation_along(axis.cos(), axis.sin());
        let overlap = (band - from.1.min(to.1)).min(from.1.max(to.1) + band);
        if overlap <= 0.0 {
            return overlap;
        }
        let at = |aside: f64| {
            let share = ((aside - from.1) / (to.1 - from.1)).clamp(0.0, 1.0);
            from.0 + share * (to.0 - from.0)
        };
        let (one, other) = (at(-band), at(band));
        overlap.min(distance - one.min(other)).min(one.max(other) + doubt_ahead)
    }

    fn jacobian(&self, wall: usize) -> Row {
        self.views[wall].by_state(&self.state)
    }

    /// The drop of the weighted sum of variances, by trying the correction.
    fn gain(&self, wall: usize) -> f64 {
        let range = self.views[wall].heard(&self.state);
        let noise = &self.config.sonar.noise;
        let r = f64::from(noise.floor.0).powi(2) + (f64::from(noise.per_metre) * range).powi(2);
        let (_, after) = corrected(&self.p, &self.jacobian(wall), r);
        let drop = |state: usize| self.p[(state, state)] - after[(state, state)];
        let weights = &self.config.weights;
        let (lever, way) = (f64::from(weights.heading.0), f64::from(weights.wheels.0));
        drop(0)
            + drop(1)
            + lever * lever * drop(HEADING)
            + way * way * 0.5 * (drop(HEADING + 1) + drop(HEADING + 2))
    }

    /// How likely the foot is inside the cone.
    fn success(&self, wall: usize) -> f64 {
        let slack = f64::from(self.config.sonar.cone.0) - self.beyond_the_servo(wall);
        libm::erf(slack / self.heading_deviation() * core::f64::consts::FRAC_1_SQRT_2)
    }

    /// Every look takes the same time: a second.
    fn score(&self, wall: usize) -> f64 {
        let worth = match self.config.policy {
            Policy::Nearest => 1.0 / self.views[wall].heard(&self.state),
            Policy::Informative => self.gain(wall),
        };
        worth * self.success(wall)
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
    // The last wall looked at is preferred by 2 %.
    prop_assert!(score(wall) >= best - 2.2e-2 * best.abs(), "{} is less than {best}", score(wall));
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
        heading in prop_oneof![Just(0.0_f32), 0.0_f32..1.0], wheels in prop_oneof![Just(0.0_f32), 0.0_f32..10.0],
    ) -> Config {
        let mut config = config_for_rooms(mount);
        config.policy = policy;
        config.sonar.cone = Radians(cone);
        config.sonar.max_range = Metres(max);
        config.sonar.servo = (Radians(right), Radians(left));
        config.trust.confidence = confidence;
        config.weights = Weights { heading: Metres(heading), wheels: Metres(wheels) };
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
            // Square to within the rounding of two angles, or as near as the servo goes.
            let wall = aim.wall.0 as usize;
            let off = turn_between(aim.bearing.0.into(), rules.bearing(wall)).abs();
            prop_assert!((off - rules.beyond_the_servo(wall)).abs() < 2e-6, "off by {off}");
            let gain = rules.gain(wall);
            prop_assert!((f64::from(aim.why.gain.0) - gain).abs() < 2e-2 * gain, "{gain}");
            prop_assert!((f64::from(aim.why.success) - rules.success(wall)).abs() < 1e-3);
        }

        // At a bearing of somebody else's choice: towards a wall or anywhere.
        for bearing in counting.iter().map(|&w| rules.bearing(w) + 0.1).chain([f64::from(askew)]) {
            let square = |wall| sure - turn_between(rules.bearing(wall), bearing).abs();
            let counting = rules.count(|wall| rules.countable(wall).min(square(wall)));
            prop_assume!(counting.is_some());
            let bearing = Radians(single(bearing));
            let aim = localizer.aim_at(bearing);
            is_best(&rules, &counting.unwrap(), |wall| 1.0 / rules.views[wall].heard(&rules.state), aim)?;
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

    /// A post nearer than the wall and inside the cone masks it; outside the cone it does not,
    /// unless the robot may stand where it does.
    #[test]
    fn an_edge_in_the_cone_masks_a_wall(room in any_room(), share in 0.3_f32..0.8, left in any::<bool>(), off in 16.0_f32..18.0, metres in 1e-4_f32..0.02) {
        let mut config = config_for_rooms(Point::default());
        config.policy = Policy::Nearest;
        let mut walls = room.walls().to_vec();
        let target = started(config, &walls, room.robot, metres, (0.0, 0.0, 0)).aim().unwrap();
        let beam = room.robot.heading.turned(target.bearing).radians().0;
        let side = if left { 1.0 } else { -1.0 };
        // The edge of a board that leads away behind it, pointing at the robot: its foot is off it.
        let angle = off.to_radians();
        let end = |r: f32| Point::new(
            room.robot.x.0 + r * (beam + side * angle).cos(),
            room.robot.y.0 + r * (beam + side * angle).sin(),
        );
        let near = target.range.0 * share;
        walls.push(Wall::new(end(near), end(near + 0.05)).unwrap());
        let aim = started(config, &walls, room.robot, metres, (0.0, 0.0, 0)).aim().unwrap();
        // The cone is 15°, and 3 · 0.01 rad more for the heading; the apex may be 3 · metres nearer
        // and aside.
        let tangent = (config.sonar.cone.0 + 0.03).tan();
        let inside = tangent * (near * angle.cos() + 3.0 * metres) + 3.0 * metres - near * angle.sin();
        prop_assume!(inside.abs() > 1e-3);
        prop_assert_eq!(aim.wall != target.wall, inside > 0.0);
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
        let beyond = |limit: f32| turn_between(direction.into(), limit.into()).abs();
        let off = if (right..=left).contains(&direction) { 0.0 } else { beyond(right).min(beyond(left)) };
        // The cone, less what the heading may be wrong by.
        let slack = f64::from(config.sonar.cone.0) - 0.03 - off;
        prop_assume!(slack.abs() > 1e-4);
        let aim = localizer.aim();
        prop_assert_eq!(aim.is_ok(), slack > 0.0);
        prop_assert!(aim.is_err() || (right..=left).contains(&aim.unwrap().bearing.0));
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
            let why = Reason { gain: SquareMetres(0.0), success: 1.0, time: Duration::from_ticks(0), candidates: 1 };
            prop_assert_eq!(localizer.aim_at(bearing), Err(NoAim::HeadingUncertain));
            let blind = Aim { wall: WallId(0), bearing, range: Metres(1.0), why };
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

/// Two walls, to the right and to the left of a robot that looks along them.
fn corridor(right: f32, left: f32) -> [Wall; 2] {
    [-right, left].map(|y| Wall::new(Point::new(-20.0, y), Point::new(20.0, y)).unwrap())
}

/// A sonar that looks without pause, on a servo.
fn with_servo(servo: Pace) -> Config {
    let mut config = config_for_rooms(Point::default());
    let cycle = Duration::from_ticks(60_000);
    config.sonar.timing = Timing { rhythm: Rhythm::AsFastAsPossible, servo, cycle };
    config
}

proptest! {
    /// The wall looked at last is left only for one that is nearer by more than 2 %.
    #[test]
    fn the_servo_does_not_hunt(near in 1.0_f32..3.0, share in 0.0_f32..0.05, first_is_right in any::<bool>()) {
        prop_assume!((share - 0.02).abs() > 1e-3);
        let mut config = config_for_rooms(Point::default());
        config.policy = Policy::Nearest;
        let far = near * (1.0 + share);
        let walls = if first_is_right { corridor(far, near) } else { corridor(near, far) };
        let mut localizer = started(config, &walls, Pose::default(), 0.001, (0.0, 0.0, 0));
        let nearer = localizer.aim().unwrap().wall;
        // It looks at the farther one, whoever told it to.
        let bearing = if first_is_right { -1.0 } else { 1.0 } * core::f32::consts::FRAC_PI_2;
        let other = localizer.aim_at(Radians(bearing)).unwrap();
        prop_assert_ne!(nearer, other.wall);
        prop_assert!(matches!(localizer.fix(&other, Some(other.range)), Fix::Accepted(_)));
        prop_assert_eq!(localizer.aim().unwrap().wall == other.wall, share < 0.02);
    }

    /// The bearing of a turning robot is square when the servo has come to rest, not now.
    #[test]
    fn a_turning_robot_is_led(rate in -0.8_f32..0.8, steps in 10_u8..40) {
        let mut config = with_servo(Pace::MG996R);
        config.prior.track_width = Metres(0.002);
        let walls = [Wall::new(Point::new(2.0, -9.0), Point::new(2.0, 9.0)).unwrap()];
        // A tenth of a second a step, on the spot, until the wall is a radian to the left.
        let arc = 0.1 * rate * 0.5 * config.drive.track_width.0;
        let start = Pose::new(0.0, 0.0, Radians(-1.0 - 0.1 * rate * f32::from(steps)));
        let localizer = started(config, &walls, start, 0.001, (arc, -arc, steps));
        let aim = localizer.aim().unwrap();
        // 0.17 s for 60°, and 80 ms for a frame and to settle; the servo looks ahead at first.
        let square = turn_between(0.0, localizer.pose().heading.radians().0.into());
        let until_ping = 0.08 + 0.17 * square.abs() / 60_f64.to_radians();
        let led = square - f64::from(rate) * until_ping;
        prop_assert!((f64::from(aim.bearing.0) - led).abs() < 2e-3, "{:?} is not {led}", aim.bearing);
    }
}

/// The walls of a square room of 4 m, turned by an angle, about the origin.
fn turned_square(angle: f32) -> Vec<Wall> {
    let (sin, cos) = angle.sin_cos();
    let corner = |u: f32, v: f32| Point::new(cos * u - sin * v, sin * u + cos * v);
    let corners = [(2.0, -2.0), (2.0, 2.0), (-2.0, 2.0), (-2.0, -2.0), (2.0, -2.0)];
    let wall = |ends: &[(f32, f32)]| {
        Wall::new(corner(ends[0].0, ends[0].1), corner(ends[1].0, ends[1].1)).unwrap()
    };
    corners.windows(2).map(wall).collect()
}

/// What a range along a direction is worth, m², with noise variance `r`: eq. 16 in `f64`; and the
/// variance along it.
fn worth_along(p: &Matrix, (x, y): (f64, f64), r: f64) -> (f64, f64) {
    let with = (p[(0, 0)] * x + p[(0, 1)] * y, p[(0, 1)] * x + p[(1, 1)] * y);
    let variance = x * with.0 + y * with.1;
    ((with.0 * with.0 + with.1 * with.1) / (variance + r), variance)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// However long a robot that hardly moves looks at one pair of walls: what it could learn from
    /// the other is less than what the turn costs, and the direction that it does not see is known
    /// worse by no more than that.
    #[test]
    fn no_bearing_is_starved(angle in 0.01_f32..1.56, wheel in 0.0_f32..0.01) {
        let walls = turned_square(angle);
        let mut config = with_servo(Pace::MG996R);
        // Ranges tell of the position alone.
        config.prior.range_scale = 0.0;
        let noise = config.sonar.noise;
        let r = f64::from(noise.floor.0).powi(2) + f64::from(2.0 * noise.per_metre).powi(2);
        // A look without a turn takes the sonar's cycle; one after a turn by 90° a frame, settling and
        // 0.17 s/60°, and the sound's way there and back.
        let times_longer = (0.08 + 0.17 * 1.5 + 4.0 / 343.4) / 0.06;
        let mut localizer = started(config, &walls, Pose::default(), 0.01, (0.0, 0.0, 0));
        let (sin, cos) = f64::from(angle).sin_cos();
        let (mut pair, mut row, mut longest, mut turns) = (None, 0, 0, 0);
        for look in 1..=600 {
            // To and fro.
            let way = if look % 2 == 0 { wheel } else { -wheel };
            localizer.odometry(Instant::from_ticks(100_000 * look), WheelTravel::new(way, way)).unwrap();
            let aim = localizer.aim().unwrap();
            let seen = aim.wall.0 % 2;
            if pair.replace(seen) == Some(seen) {
                row += 1;
                let p = covariance_of(localizer.filter());
                let (ahead, aside) = ((cos, sin), (-sin, cos));
                let (this, other) = if seen == 0 { (ahead, aside) } else { (aside, ahead) };
                let (this, other) = (worth_along(&p, this, r), worth_along(&p, other, r));
                // The last wall is preferred by 2 %; the robot is off the middle by 1 cm at most.
                let most = 1.02 * 1.02 * times_longer;
                prop_assert!(other.0 <= most * this.0, "look {look}: {other:?} against {this:?}");
                prop_assert!(other.1 <= most * this.1, "look {look}: {other:?} against {this:?}");
            } else {
                (row, turns) = (1, turns + 1);
            }
            longest = longest.max(row);
            prop_assert!(matches!(localizer.fix(&aim, Some(aim.range)), Fix::Accepted(_)));
        }
        prop_assert!(longest >= 30 && turns >= 4, "{longest} in a row, {turns} turns");
    }
}
