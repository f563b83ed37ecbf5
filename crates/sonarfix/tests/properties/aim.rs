//! The choice of the wall, against the rules of `docs/model.md` ("Which walls can be measured") in
//! `f64`.

use proptest::prelude::*;
use sonarfix::aim::{Aim, NoAim, Policy};
use sonarfix::config::{Config, PingSchedule, PingTiming, ServoTiming};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::sensor::echo::EchoParameters;
use sonarfix::sensor::range::ExpectedRange;

use crate::oracle::{
    HEADING, Matrix, Row, Vector, View, corrected, covariance_of, state_of, turn_between,
};
use crate::strategies::{Sight, any_mount, any_room, any_sight, bits, config_for_rooms, in_slices};

/// What a wall must withstand to be measured.
#[derive(Clone, Copy)]
struct Margins {
    /// Least probability of foot and range.
    least: f64,
    /// Standard deviations of the position.
    confidence: f64,
    /// The cone in which other walls answer.
    cone: f64,
}

impl Margins {
    fn safe(config: &Config, localizer: &Localizer) -> Self {
        let confidence = f64::from(config.gating.confidence);
        let heading = f64::from(localizer.filter().standard_deviations().heading.0);
        let cone = f64::from(config.rangers.first.cone.0) + (confidence * heading).min(0.3);
        Self { least: 0.7, confidence, cone }
    }

    /// When no wall is safe.
    fn none(config: &Config) -> Self {
        Self { least: 0.2, confidence: 0.0, cone: 0.7 * f64::from(config.rangers.first.cone.0) }
    }
}

/// Probability that a normal variable lies between two numbers of standard deviations.
fn between(from: f64, to: f64) -> f64 {
    let half_erf = |x: f64| 0.5 * libm::erf(x * core::f64::consts::FRAC_1_SQRT_2);
    half_erf(to) - half_erf(from)
}

/// The rules in `f64`. Every condition is a margin in metres or radians, positive if it holds, so
/// that cases decided by rounding can be recognised.
struct Rules {
    margins: Margins,
    config: Config,
    state: Vector,
    p: Matrix,
    views: Vec<View>,
}

impl Rules {
    fn new(localizer: &Localizer, ends: &[(Point, Point)]) -> Self {
        let config = *localizer.config();
        Self {
            margins: Margins::safe(&config, localizer),
            config,
            state: state_of(localizer.filter()),
            p: covariance_of(localizer.filter()),
            views: ends.iter().map(|e| View::new(e.0, e.1, config.rangers.first.mount)).collect(),
        }
    }

    fn confidence(&self) -> f64 {
        self.margins.confidence
    }

    fn heading_deviation(&self) -> f64 {
        self.p[(HEADING, HEADING)].sqrt()
    }

    fn sonar(&self) -> (f64, f64) {
        self.views[0].sonar(&self.state)
    }

    fn deviation_along(&self, x: f64, y: f64) -> f64 {
        let p = &self.p;
        (p[(0, 0)] * x * x + 2.0 * p[(0, 1)] * x * y + p[(1, 1)] * y * y).sqrt()
    }

    /// Distance and direction (map) from the sonar to the foot.
    fn foot(&self, wall: usize) -> (f64, f64) {
        let view = &self.views[wall];
        let signed = view.distance(self.sonar());
        let (tx, ty, _) = view.tangent();
        let (a, b) = (-ty * -signed.signum(), tx * -signed.signum());
        (signed.abs(), b.atan2(a))
    }

    /// The bearing that is square to the wall.
    fn bearing(&self, wall: usize) -> f64 {
        turn_between(self.foot(wall).1, self.state[HEADING])
    }

    /// Probabilities that the foot is on the wall and that the range is within the sonar's.
    fn foot_and_range(&self, wall: usize) -> (f64, f64) {
        let view = &self.views[wall];
        let (tx, ty, length) = view.tangent();
        let along = view.along(self.sonar());
        let sigma = self.deviation_along(tx, ty).hypot(0.02);
        let foot = between(-along / sigma, (length - along) / sigma);
        let range = view.expected_range(&self.state);
        let sonar = &self.config.rangers.first;
        let sigma = self.deviation_along(-ty, tx).hypot(0.001);
        let (nearest, farthest) = (f64::from(sonar.min_range.0), f64::from(sonar.max_range.0));
        (foot, between((nearest - range) / sigma, (farthest - range) / sigma))
    }

    /// Foot on the wall and range within the sonar's, by the pose's uncertainty.
    fn measurable(&self, wall: usize) -> f64 {
        let (foot, range) = self.foot_and_range(wall);
        foot.min(range) - self.margins.least
    }

    /// Distance of the square bearing from the travel of the servo.
    fn beyond_the_servo(&self, wall: usize) -> f64 {
        let (right, left) = self.config.rangers.first.servo;
        let (right, left) = (f64::from(right.0), f64::from(left.0));
        let bearing = self.bearing(wall);
        if (right..=left).contains(&bearing) {
            return 0.0;
        }
        turn_between(bearing, right).abs().min(turn_between(bearing, left).abs())
    }

    /// Within the servo's reach, or so near that the foot is in the cone.
    fn reachable(&self, wall: usize) -> f64 {
        f64::from(self.config.rangers.first.cone.0) - self.beyond_the_servo(wall)
    }

    /// No occlusion.
    fn unoccluded(&self, wall: usize) -> f64 {
        let others = (0..self.views.len()).filter(|&other| other != wall);
        -others.map(|other| self.occludes(other, wall)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Whether `other` occludes `wall`, for the worst error of the position in each condition.
    fn occludes(&self, other: usize, wall: usize) -> f64 {
        let (distance, axis) = self.foot(wall);
        let cone = self.margins.cone.min(75_f64.to_radians());
        let sonar = self.sonar();
        let uncertainty_ahead = self.confidence() * self.deviation_along(axis.cos(), axis.sin());
        let uncertainty_aside = self.confidence() * self.deviation_along(-axis.sin(), axis.cos());
        // Along the beam and across it.
        let place = |p: (f64, f64)| {
            let (dx, dy) = (p.0 - sonar.0, p.1 - sonar.1);
            let (r, off) = (dx.hypot(dy), turn_between(dy.atan2(dx), axis));
            (r * off.cos(), r * off.sin())
        };
        let answers = |p: (f64, f64)| {
            let (ahead, aside) = place(p);
            let inside = cone.tan() * (ahead + uncertainty_ahead) + uncertainty_aside - aside.abs();
            let nearest_aside = (aside.abs() - uncertainty_aside).max(0.0);
            let nearer = (distance - ahead) * (distance + ahead + 2.0 * uncertainty_ahead)
                - nearest_aside.powi(2);
            inside.min(nearer).min(ahead + uncertainty_ahead).min(distance - ahead)
        };
        let view = &self.views[other];
        let ends = answers(view.from).max(answers(view.to));
        let (tx, ty, length) = view.tangent();
        let along = view.along(sonar);
        let foot = (view.from.0 + tx * along, view.from.1 + ty * along);
        let nearest = along.min(length - along).min(answers(foot));
        ends.max(nearest).max(self.crosses(place(view.from), place(view.to), wall))
    }

    /// Whether the wall between two points crosses a beam that starts within the uncertainty aside:
    /// the part of it in that band, sampled at a thousand points.
    fn crosses(&self, from: (f64, f64), to: (f64, f64), wall: usize) -> f64 {
        let (distance, axis) = self.foot(wall);
        let band = self.confidence() * self.deviation_along(-axis.sin(), axis.cos());
        let uncertainty_ahead = self.confidence() * self.deviation_along(axis.cos(), axis.sin());
        let overlap = (band - from.1.min(to.1)).min(from.1.max(to.1) + band);
        if overlap <= 0.0 {
            return overlap;
        }
        let at = |aside: f64| {
            let share = ((aside - from.1) / (to.1 - from.1)).clamp(0.0, 1.0);
            from.0 + share * (to.0 - from.0)
        };
        let (one, other) = (at(-band), at(band));
        overlap.min(distance - one.min(other)).min(one.max(other) + uncertainty_ahead)
    }

    fn jacobian(&self, wall: usize) -> Row {
        self.views[wall].by_state(&self.state)
    }

    /// The decrease of the weighted sum of variances, by an actual correction.
    fn gain(&self, wall: usize) -> f64 {
        let range = self.views[wall].expected_range(&self.state);
        let noise = &self.config.rangers.first.noise;
        let r = f64::from(noise.floor.0).powi(2) + (f64::from(noise.per_metre) * range).powi(2);
        let (_, after) = corrected(&self.p, &self.jacobian(wall), r);
        let drop = |state: usize| self.p[(state, state)] - after[(state, state)];
        let weights = &self.config.weights;
        let (lever, distance) = (f64::from(weights.heading.0), f64::from(weights.wheels.0));
        drop(0)
            + drop(1)
            + lever * lever * drop(HEADING)
            + distance * distance * 0.5 * (drop(HEADING + 1) + drop(HEADING + 2))
    }

    /// Probability of foot, range and squareness.
    fn success(&self, wall: usize, off: f64) -> f64 {
        let cone = f64::from(self.config.rangers.first.cone.0);
        let sigma = self.heading_deviation().hypot(0.01);
        let (foot, range) = self.foot_and_range(wall);
        foot * range * between((-cone - off) / sigma, (cone - off) / sigma)
    }

    /// Every ping takes one second.
    fn score(&self, wall: usize) -> f64 {
        let worth = match self.config.policy {
            Policy::Nearest => 1.0 / self.views[wall].expected_range(&self.state),
            Policy::Informative => self.gain(wall),
        };
        worth * self.success(wall, self.beyond_the_servo(wall))
    }

    /// The walls that can be measured by these margins; `None` if one is decided by rounding.
    fn count(&self, margin: impl Fn(usize) -> f64) -> Option<Vec<usize>> {
        let margins: Vec<_> = (0..self.views.len()).map(&margin).collect();
        // ±π of the servo are the same direction; a wall there is decided by rounding.
        margins
            .iter()
            .all(|m| m.abs() > 2e-3)
            .then(|| (0..margins.len()).filter(|&wall| margins[wall] > 0.0).collect())
    }

    fn eligible(&self, wall: usize) -> f64 {
        self.measurable(wall).min(self.unoccluded(wall))
    }
}

/// The aim is one of the measurable walls, and none of them has a better score.
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
    prop_assert!(counting.contains(&wall), "{wall} is not among {counting:?}");
    let best = counting.iter().map(|&wall| score(wall)).fold(f64::NEG_INFINITY, f64::max);
    // The last wall has a bonus of 2 %.
    prop_assert!(score(wall) >= best - 2.2e-2 * best.abs(), "{} is less than {best}", score(wall));
    let range = rules.views[wall].expected_range(&rules.state);
    prop_assert!((f64::from(aim.range.0) - range).abs() < 1e-5);
    Ok(())
}

/// A robot at the origin, with the covariance after a drive.
fn started<'w>(
    config: &Config,
    walls: &'w [Wall],
    pose: Pose,
    deviation: f32,
    drive: (f32, f32, u8),
) -> Localizer<'w> {
    let start =
        Start { pose, position_deviation: Metres(deviation), heading_deviation: Radians(0.01) };
    let mut localizer =
        Localizer::new(*config, Map::new(walls), start, Instant::from_ticks(0)).unwrap();
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
    /// A configuration with another mount, servo, cone, range and policy.
    fn any_config()(
        mount in any_mount(), policy in any_policy(), cone in 0.1_f32..0.5, max in 3.0_f32..9.0,
        right in -3.1_f32..-0.5, left in 0.5_f32..3.1, confidence in 0.5_f32..4.0,
        heading in prop_oneof![Just(0.0_f32), 0.0_f32..1.0], wheels in prop_oneof![Just(0.0_f32), 0.0_f32..10.0],
    ) -> Config {
        let mut config = config_for_rooms(mount);
        config.policy = policy;
        config.rangers.first.cone = Radians(cone);
        config.rangers.first.max_range = Metres(max);
        config.rangers.first.servo = (Radians(right), Radians(left));
        config.gating.confidence = confidence;
        config.weights.heading = Metres(heading);
        config.weights.wheels = Metres(wheels);
        config
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1024, max_global_rejects: 8192, ..ProptestConfig::default() })]

    /// Among random walls the aim is the best of the measurable ones, or there is none.
    #[test]
    fn the_best_measurable_wall_is_chosen(
        config in any_config(), sights in proptest::collection::vec(any_sight(), 1..7), heading in -3.1_f32..3.1,
        deviation in 0.005_f32..0.3, drive in (-0.05_f32..0.05, -0.05_f32..0.05, 0_u8..20), askew in -3.1_f32..3.1,
        fixes in 0_u8..4,
    ) {
        let ends: Vec<_> = sights.iter().map(|s| s.ends(Point::default())).collect();
        let walls: Vec<_> = ends.iter().map(|e| Wall::new(e.0, e.1).unwrap()).collect();
        let pose = Pose::new(0.0, 0.0, Radians(heading));
        let mut localizer = started(&config, &walls, pose, deviation, drive);
        // Fixes reduce the variance of the position along one line, not along the other.
        for _ in 0..fixes {
            if let Ok(aim) = localizer.aim() {
                let _ = localizer.fix(&aim, Some(aim.range));
            }
        }
        let localizer = localizer;
        let mut rules = Rules::new(&localizer, &ends);
        let mut counting = rules.count(|wall| rules.eligible(wall).min(rules.reachable(wall)));
        if counting.as_ref().is_some_and(Vec::is_empty) {
            rules.margins = Margins::none(&config);
            counting = rules.count(|wall| rules.eligible(wall).min(rules.reachable(wall)));
        }
        prop_assume!(counting.is_some());
        let counting = counting.unwrap();
        let aim = localizer.aim();
        is_best(&rules, &counting, |wall| rules.score(wall), aim)?;
        // A slice lists three of them, the last one tests one; the wall is the same.
        let (sliced, slices) = in_slices(&localizer);
        prop_assert_eq!(sliced, aim);
        prop_assert!(slices as usize > counting.len().div_ceil(3), "{slices} slices");
        if let Ok(aim) = aim {
            // Square to within the rounding of two angles, or as near as the servo reaches.
            let wall = aim.wall.0 as usize;
            let off = turn_between(aim.bearing.0.into(), rules.bearing(wall)).abs();
            prop_assert!((off - rules.beyond_the_servo(wall)).abs() < 2e-6, "off by {off}");
            let gain = rules.gain(wall);
            prop_assert!((f64::from(aim.why.gain.0) - gain).abs() < 2e-2 * gain, "{gain}");
            let success = rules.success(wall, rules.beyond_the_servo(wall));
            prop_assert!((f64::from(aim.why.success) - success).abs() < 2e-3);
        }

        // At a given bearing: towards a wall or anywhere.
        let bearings: Vec<_> =
            counting.iter().map(|&w| rules.bearing(w) + 0.1).chain([f64::from(askew)]).collect();
        for bearing in bearings {
            let cone = f64::from(config.rangers.first.cone.0);
            let square = |rules: &Rules, wall| {
                let off = turn_between(rules.bearing(wall), bearing).abs();
                rules.eligible(wall).min(cone - off)
            };
            rules.margins = Margins::safe(&config, &localizer);
            let mut counting = rules.count(|wall| square(&rules, wall));
            if counting.as_ref().is_some_and(Vec::is_empty) {
                rules.margins = Margins::none(&config);
                counting = rules.count(|wall| square(&rules, wall));
            }
            prop_assume!(counting.is_some());
            let bearing = Radians(single(bearing));
            let aim = localizer.aim_at(bearing);
            is_best(&rules, &counting.unwrap(), |wall| 1.0 / rules.views[wall].expected_range(&rules.state), aim)?;
            prop_assert!(aim.is_err() || aim.unwrap().bearing == bearing);
        }
    }
}

proptest! {
    /// In a room every wall can be measured, so the policy alone decides.
    #[test]
    fn in_a_room_the_policy_decides(
        room in any_room(), mount in any_mount(), policy in any_policy(), deviation in 0.005_f32..0.05,
        drive in (-0.04_f32..0.04, -0.04_f32..0.04, 0_u8..10), fixes in 0_u8..3,
    ) {
        let mut config = config_for_rooms(mount);
        config.policy = policy;
        // The turn on the spot must not raise the uncertainty of the heading above the cone.
        config.prior.track_width = Metres(0.002);
        let walls = room.walls();
        let mut localizer = started(&config, &walls, room.robot, deviation, drive);
        for _ in 0..fixes {
            let aim = localizer.aim().unwrap();
            prop_assert!(matches!(localizer.fix(&aim, Some(aim.range)), Fix::Accepted(_)));
        }
        let ends: Vec<_> = walls.iter().map(|w| (w.from(), w.to())).collect();
        let rules = Rules::new(&localizer, &ends);
        is_best(&rules, &[0, 1, 2, 3], |wall| rules.score(wall), localizer.aim())?;
    }

    /// A wall with a shorter one in front of it is not chosen, however near; without that one, it
    /// is.
    #[test]
    fn an_occluded_wall_is_never_chosen(room in any_room(), share in 0.2_f32..0.8, half in 0.2_f32..0.5, aslant in -0.4_f32..0.4) {
        let mut config = config_for_rooms(Point::default());
        config.policy = Policy::Nearest;
        let mut walls = room.walls().to_vec();
        let open = started(&config, &walls, room.robot, 0.01, (0.0, 0.0, 0));
        let target = open.aim().unwrap();
        // A board across the beam. Slanted by more than the length of its ends, its own foot is off
        // it.
        let beam = room.robot.heading.turned(target.bearing).radians().0;
        let middle = target.range.0 * share;
        let across = beam + core::f32::consts::FRAC_PI_2 + aslant;
        let end = |s: f32| Point::new(
            room.robot.x.0 + middle * beam.cos() + s * across.cos(),
            room.robot.y.0 + middle * beam.sin() + s * across.sin(),
        );
        walls.push(Wall::new(end(-half), end(half)).unwrap());
        let closed = started(&config, &walls, room.robot, 0.01, (0.0, 0.0, 0));
        let aim = closed.aim().unwrap();
        prop_assert_ne!(aim.wall, target.wall);
        // Nor by its bearing.
        let at = closed.aim_at(target.bearing);
        prop_assert!(at.is_err() || at.unwrap().wall != target.wall);
    }

    /// A post nearer than the wall and inside the cone occludes it; outside the cone it does not,
    /// within the uncertainty of the position.
    #[test]
    fn an_edge_in_the_cone_occludes_a_wall(room in any_room(), share in 0.3_f32..0.8, left in any::<bool>(), off in 16.0_f32..18.0, metres in 1e-4_f32..0.02) {
        let mut config = config_for_rooms(Point::default());
        config.policy = Policy::Nearest;
        let mut walls = room.walls().to_vec();
        let target = started(&config, &walls, room.robot, metres, (0.0, 0.0, 0)).aim().unwrap();
        let beam = room.robot.heading.turned(target.bearing).radians().0;
        let side = if left { 1.0 } else { -1.0 };
        // The edge of a board that points at the robot and extends away from it: its foot is off
        // it.
        let angle = off.to_radians();
        let end = |r: f32| Point::new(
            room.robot.x.0 + r * (beam + side * angle).cos(),
            room.robot.y.0 + r * (beam + side * angle).sin(),
        );
        let near = target.range.0 * share;
        walls.push(Wall::new(end(near), end(near + 0.05)).unwrap());
        let aim = started(&config, &walls, room.robot, metres, (0.0, 0.0, 0)).aim().unwrap();
        // The cone is 15°, and 0.01 rad more for the heading; the apex may be one deviation nearer
        // and aside.
        let tangent = (config.rangers.first.cone.0 + 0.01).tan();
        let inside = tangent * (near * angle.cos() + metres) + metres - near * angle.sin();
        prop_assume!(inside.abs() > 1e-3);
        prop_assert_eq!(aim.wall != target.wall, inside > 0.0);
    }

    /// A wall whose foot is beside it cannot be measured, however near; nor one whose foot is
    /// nearly beside it.
    #[test]
    fn a_foot_beside_its_wall_is_never_chosen(direction in -3.1_f32..3.1, distance in 0.5_f32..4.0, inward in -1.0_f32..0.5) {
        let config = config_for_rooms(Point::default());
        let deviation = 0.02_f32;
        // The end is `inward` metres past the foot, which is uncertain by 2 cm of the position and 2 cm
        // of the wall's end: in one of five cases it is on the wall at −0.84 standard deviations.
        let least = -0.8416 * deviation.hypot(0.02);
        prop_assume!((inward - least).abs() > 1e-3);
        let sight = Sight { direction, distance, foot: inward / 4.0, length: 4.0, flipped: false };
        let walls = [sight.wall(Point::default())];
        let localizer = started(&config, &walls, Pose::default(), deviation, (0.0, 0.0, 0));
        let aim = localizer.aim();
        prop_assert_eq!(aim.is_ok(), inward > least, "{:?}", aim);
        prop_assert!(aim.is_ok() || aim == Err(NoAim::NoWall));
    }

    /// The uncertainty along the wall applies to its ends, the one across it to its range. After a
    /// fix of a slanted wall it is millimetres across the wall, and unchanged along it.
    #[test]
    fn uncertainty_along_and_across_a_wall_are_separate(direction in -3.1_f32..3.1, inward in 0.01_f32..0.6, deviation in 0.1_f32..0.15) {
        let config = config_for_rooms(Point::default());
        let sight = |direction, foot| Sight { direction, distance: 2.0, foot, length: 4.0, flipped: false };
        // The second wall is perpendicular to the first, so its range determines the position along
        // the first; its foot is `inward` metres from its end.
        let square = direction + core::f32::consts::FRAC_PI_2;
        let walls = [sight(direction, 0.5), sight(square, inward / 4.0)].map(|s| s.wall(Point::default()));
        let blunt = started(&config, &walls, Pose::default(), deviation, (0.0, 0.0, 0));
        let mut sharp = blunt.clone();
        let aim = sharp.aim_at(Radians(direction)).unwrap();
        prop_assert_eq!(aim.wall, WallId(0));
        prop_assert!(matches!(sharp.fix(&aim, Some(aim.range)), Fix::Accepted(_)));
        // Whether the foot is on the wall is about certain of the second wall after the fix.
        let bearing = Radians(square);
        let success = |localizer: &Localizer| localizer.aim_at(bearing).map(|aim| aim.why.success);
        let foot = |sigma: f32| between(f64::from(-inward / sigma.hypot(0.02)), 9.0);
        prop_assert!((f64::from(success(&blunt).unwrap()) - foot(deviation)).abs() < 3e-3);
        // The noise of a range of 2 m is 6 mm, and 1 % for its scale.
        prop_assert!((f64::from(success(&sharp).unwrap()) - foot(0.0215)).abs() < 2e-2);
        // Along the first nothing was learnt.
        let deviations = sharp.filter().covariance();
        let trace = deviations[(0, 0)] + deviations[(1, 1)];
        prop_assert!((trace - deviation * deviation) < 0.1 * deviation * deviation);
    }

    /// Out of range, given the uncertainty of the distance.
    #[test]
    fn a_wall_out_of_range_is_never_chosen(direction in -3.1_f32..3.1, distance in 0.06_f32..6.0, min in 0.05_f32..1.0, max in 2.0_f32..5.0) {
        let mut config = config_for_rooms(Point::default());
        config.rangers.first.min_range = Metres(min);
        config.rangers.first.max_range = Metres(max);
        let sight = Sight { direction, distance, foot: 0.5, length: 4.0, flipped: false };
        let walls = [sight.wall(Point::default())];
        let localizer = started(&config, &walls, Pose::default(), 0.02, (0.0, 0.0, 0));
        // 20 % are in range at −0.84 standard deviations: 2 cm, and 1 mm for the limit itself.
        let slack = (distance - min).min(max - distance) + 0.8416 * 0.021;
        prop_assume!(slack.abs() > 1e-3);
        prop_assert_eq!(localizer.aim().is_ok(), slack > 0.0);
    }

    /// A servo with limited travel; a given bearing does not depend on the servo.
    #[test]
    fn the_bearing_is_within_the_travel_of_the_servo(direction in -3.1_f32..3.1, right in -3.0_f32..0.0, reach in 0.1_f32..3.0) {
        let mut config = config_for_rooms(Point::default());
        let left = right + reach;
        config.rangers.first.servo = (Radians(right), Radians(left));
        let sight = Sight { direction, distance: 2.0, foot: 0.5, length: 4.0, flipped: false };
        let walls = [sight.wall(Point::default())];
        let localizer = started(&config, &walls, Pose::default(), 0.02, (0.0, 0.0, 0));
        let beyond = |limit: f32| turn_between(direction.into(), limit.into()).abs();
        let off = if (right..=left).contains(&direction) { 0.0 } else { beyond(right).min(beyond(left)) };
        let slack = f64::from(config.rangers.first.cone.0) - off;
        prop_assume!(slack.abs() > 1e-4);
        let aim = localizer.aim();
        prop_assert_eq!(aim.is_ok(), slack > 0.0);
        prop_assert!(aim.is_err() || (right..=left).contains(&aim.unwrap().bearing.0));
        prop_assert_eq!(localizer.aim_at(Radians(direction)).map(|a| a.wall), Ok(WallId(0)));
    }

    /// Without a servo a wall is measured if it is in the cone at the fixed bearing, which is that of the ping.
    #[test]
    fn a_fixed_sonar_measures_what_is_in_its_cone(direction in -3.1_f32..3.1, fixed in -3.1_f32..3.1) {
        let mut config = config_for_rooms(Point::default());
        config.rangers.first.servo = (Radians(fixed), Radians(fixed));
        let sight = Sight { direction, distance: 2.0, foot: 0.5, length: 4.0, flipped: false };
        let walls = [sight.wall(Point::default())];
        let localizer = started(&config, &walls, Pose::default(), 0.02, (0.0, 0.0, 0));
        let off = turn_between(direction.into(), fixed.into()).abs();
        let slack = f64::from(config.rangers.first.cone.0) - off;
        prop_assume!(slack.abs() > 1e-4);
        let aim = localizer.aim();
        prop_assert_eq!(aim.is_ok(), slack > 0.0);
        prop_assert!(aim.is_err() || aim.unwrap().bearing.0.to_bits() == fixed.to_bits());
    }

    /// However uncertain the heading: there is a wall to measure, and the uncertainty lowers the
    /// probability of success.
    #[test]
    fn an_uncertain_heading_lowers_the_probability_of_success(room in any_room(), deviation in 0.01_f32..3.0) {
        let config = config_for_rooms(Point::default());
        let walls = room.walls();
        let start = Start { heading_deviation: Radians(deviation), ..room.start() };
        let localizer = Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(0)).unwrap();
        let aim = localizer.aim().unwrap();
        let sigma = f64::from(deviation).hypot(0.01);
        let cone = f64::from(config.rangers.first.cone.0);
        let square = between(-cone / sigma, cone / sigma);
        prop_assert!((f64::from(aim.why.success) - square).abs() < 2e-2 * square, "{aim:?}");
    }

    /// The order of the walls in the map changes no bit.
    #[test]
    fn permuting_the_walls_changes_no_bit(room in any_room(), policy in any_policy(), turn in 1_usize..4, noise in 0.0_f32..0.05) {
        let mut config = config_for_rooms(Point::new(0.05, 0.01));
        config.policy = policy;
        config.echo = EchoParameters::HC_SR04;
        let walls = room.walls();
        let mut turned = walls.to_vec();
        turned.rotate_left(turn);
        let mut one = started(&config, &walls, room.robot, 0.03, (0.02, 0.01, 3));
        let mut other = started(&config, &turned, room.robot, 0.03, (0.02, 0.01, 3));
        for ping in 0..30_u8 {
            let (a, b) = (one.aim().unwrap(), other.aim().unwrap());
            // Of two walls with the same score the first in the map is measured.
            prop_assume!(walls[a.wall.0 as usize] == turned[b.wall.0 as usize]);
            let off = if ping % 3 == 0 { -0.3 } else { noise };
            let range = (ping % 7 != 0).then_some(a.range + Metres(off));
            prop_assert_eq!(one.fix(&a, range), other.fix(&b, range));
            prop_assert_eq!(bits(one.filter()), bits(other.filter()));
            prop_assert_eq!(one.health(), other.health());
        }
    }

    /// A range along the chosen bearing is comparable.
    #[test]
    fn a_range_along_an_aim_is_comparable(room in any_room(), mount in any_mount(), policy in any_policy()) {
        let mut config = config_for_rooms(mount);
        config.policy = policy;
        let walls = room.walls();
        let mut localizer = started(&config, &walls, room.robot, 0.03, (0.02, 0.01, 3));
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
        started(&config_for_rooms(Point::default()), &[], Pose::default(), 0.01, (0.0, 0.0, 0));
    assert_eq!(localizer.aim(), Err(NoAim::NoWall));
    assert_eq!(localizer.aim_at(Radians(0.0)), Err(NoAim::NoWall));
}

/// Two walls, to the right and to the left of a robot that faces along them.
fn corridor(right: f32, left: f32) -> [Wall; 2] {
    [-right, left].map(|y| Wall::new(Point::new(-20.0, y), Point::new(20.0, y)).unwrap())
}

/// A large hobby servo.
const SLOW_SERVO: ServoTiming =
    ServoTiming { sixty_degrees: Duration::from_ticks(170_000), ..ServoTiming::SG90 };

/// A sonar that pings without pause, on a servo.
fn with_servo(servo: ServoTiming) -> Config {
    let mut config = config_for_rooms(Point::default());
    let cycle = Duration::from_ticks(60_000);
    config.rangers.first.timing =
        PingTiming { schedule: PingSchedule::AsFastAsPossible, servo, cycle };
    config
}

proptest! {
    /// The last wall is left only for one that is nearer by more than 2 %.
    #[test]
    fn the_servo_does_not_alternate_between_equal_walls(near in 1.0_f32..3.0, share in 0.0_f32..0.05, first_is_right in any::<bool>()) {
        prop_assume!((share - 0.02).abs() > 1e-3);
        let mut config = config_for_rooms(Point::default());
        config.policy = Policy::Nearest;
        let far = near * (1.0 + share);
        let walls = if first_is_right { corridor(far, near) } else { corridor(near, far) };
        let mut localizer = started(&config, &walls, Pose::default(), 0.001, (0.0, 0.0, 0));
        let nearer = localizer.aim().unwrap().wall;
        // The previous ping was at the farther one.
        let bearing = if first_is_right { -1.0 } else { 1.0 } * core::f32::consts::FRAC_PI_2;
        let other = localizer.aim_at(Radians(bearing)).unwrap();
        prop_assert_ne!(nearer, other.wall);
        prop_assert!(matches!(localizer.fix(&other, Some(other.range)), Fix::Accepted(_)));
        prop_assert_eq!(localizer.aim().unwrap().wall == other.wall, share < 0.02);
    }

    /// The bearing of a turning robot is square when the servo has settled, not now.
    #[test]
    fn the_bearing_leads_a_turning_robot(rate in -0.8_f32..0.8, steps in 10_u8..40) {
        let mut config = with_servo(SLOW_SERVO);
        config.prior.track_width = Metres(0.002);
        let walls = [Wall::new(Point::new(2.0, -9.0), Point::new(2.0, 9.0)).unwrap()];
        // A turn on the spot in steps of 0.1 s, until the wall is one radian to the left.
        let arc = 0.1 * rate * 0.5 * config.drive.track_width.0;
        let start = Pose::new(0.0, 0.0, Radians(-1.0 - 0.1 * rate * f32::from(steps)));
        let localizer = started(&config, &walls, start, 0.001, (arc, -arc, steps));
        let aim = localizer.aim().unwrap();
        // 0.17 s for 60°, and 80 ms for a frame and settling; the servo starts ahead.
        let square = turn_between(0.0, localizer.pose().heading.radians().0.into());
        let until_ping = 0.08 + 0.17 * square.abs() / 60_f64.to_radians();
        let led = square - f64::from(rate) * until_ping;
        prop_assert!((f64::from(aim.bearing.0) - led).abs() < 2e-3, "{:?} is not {led}", aim.bearing);
    }
}

/// The walls of a square room of 4 m, rotated by an angle, about the origin.
fn rotated_square(angle: f32) -> Vec<Wall> {
    let (sin, cos) = angle.sin_cos();
    let corner = |u: f32, v: f32| Point::new(cos * u - sin * v, sin * u + cos * v);
    let corners = [(2.0, -2.0), (2.0, 2.0), (-2.0, 2.0), (-2.0, -2.0), (2.0, -2.0)];
    let wall = |ends: &[(f32, f32)]| {
        Wall::new(corner(ends[0].0, ends[0].1), corner(ends[1].0, ends[1].1)).unwrap()
    };
    corners.windows(2).map(wall).collect()
}

/// The expected gain of a range along a direction, m², with noise variance `r`: eq. (21) in `f64`;
/// and the variance along it.
fn gain_along(p: &Matrix, (x, y): (f64, f64), r: f64) -> (f64, f64) {
    let with = (p[(0, 0)] * x + p[(0, 1)] * y, p[(0, 1)] * x + p[(1, 1)] * y);
    let variance = x * with.0 + y * with.1;
    ((with.0 * with.0 + with.1 * with.1) / (variance + r), variance)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// However long a robot that hardly moves measures one pair of walls: the expected gain of the
    /// other pair is less than the cost of the turn, and the variance in the unobserved direction
    /// is larger by no more than that.
    #[test]
    fn no_bearing_is_starved(angle in 0.01_f32..1.56, wheel in 0.0_f32..0.01) {
        let walls = rotated_square(angle);
        let mut config = with_servo(SLOW_SERVO);
        // The mount limits what repeated ranges of one wall can tell.
        config.prior.mount = Metres(0.005);
        // Ranges contain information on the position only.
        config.prior.range_scale = 0.0;
        let noise = config.rangers.first.noise;
        let r = f64::from(noise.floor.0).powi(2) + f64::from(2.0 * noise.per_metre).powi(2);
        // A ping without a turn takes the cycle of the sonar; one after a turn by 90° a frame,
        // settling, 0.17 s/60°, and the flight of the sound.
        let times_longer = (0.08 + 0.17 * 1.5 + 4.0 / 343.4) / 0.06;
        let mut localizer = started(&config, &walls, Pose::default(), 0.01, (0.0, 0.0, 0));
        let (sin, cos) = f64::from(angle).sin_cos();
        let (mut pair, mut row, mut longest, mut turns) = (None, 0, 0, 0);
        for ping in 1..=600 {
            // Forwards and backwards.
            let travel = if ping % 2 == 0 { wheel } else { -wheel };
            localizer.odometry(Instant::from_ticks(100_000 * ping), WheelTravel::new(travel, travel)).unwrap();
            let aim = localizer.aim().unwrap();
            let seen = aim.wall.0 % 2;
            if pair.replace(seen) == Some(seen) {
                row += 1;
                let p = covariance_of(localizer.filter());
                let (ahead, aside) = ((cos, sin), (-sin, cos));
                let (this, other) = if seen == 0 { (ahead, aside) } else { (aside, ahead) };
                let (this, other) = (gain_along(&p, this, r), gain_along(&p, other, r));
                // The last wall has a bonus of 2 %; the robot is at most 1 cm off the middle.
                let most = 1.02 * 1.02 * times_longer;
                prop_assert!(other.0 <= most * this.0, "ping {ping}: {other:?} against {this:?}");
                prop_assert!(other.1 <= most * this.1, "ping {ping}: {other:?} against {this:?}");
            } else {
                (row, turns) = (1, turns + 1);
            }
            longest = longest.max(row);
            prop_assert!(matches!(localizer.fix(&aim, Some(aim.range)), Fix::Accepted(_)));
        }
        prop_assert!(longest >= 30 && turns >= 4, "{longest} in a row, {turns} turns");
    }
}

/// A robot with a fixed sonar that waits until a wall is in its cone: once a second it counts as a ping without an accepted
/// range, however often the loop asks; with a servo each time counts, unless the bearing was not planned.
#[test]
fn waiting_for_a_wall_counts_once_a_second() {
    let walls = [Wall::new(Point::new(2.0, -2.0), Point::new(2.0, 2.0)).unwrap()];
    let mut config = config_for_rooms(Point::default());
    let silent = |config: Config, skip: &dyn Fn(&mut Localizer)| {
        let mut localizer = started(&config, &walls, Pose::default(), 0.02, (0.0, 0.0, 0));
        let begin = localizer.time();
        for tick in 1..=50 {
            let now = begin.checked_add_duration(Duration::from_ticks(tick * 100_000)).unwrap();
            localizer.odometry(now, WheelTravel::new(0.0, 0.0)).unwrap();
            assert_eq!(localizer.aim(), Err(NoAim::NoWall));
            skip(&mut localizer);
        }
        localizer.health().silent_in_a_row
    };
    let back = core::f32::consts::PI;
    config.rangers.first.servo = (Radians(back), Radians(back));
    assert_eq!(silent(config, &|it| it.skip()), 5);
    config.rangers.first.servo = (Radians(back - 0.1), Radians(back));
    assert_eq!(silent(config, &|it| it.skip()), 50);
    assert_eq!(silent(config, &|it| it.skip_unplanned()), 5);
}
