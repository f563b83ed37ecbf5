//! What is refused or gated changes no bit; the gate is where it is said to be.

use proptest::prelude::*;
use sonarfix::aim::Aim;
use sonarfix::ekf::{Ekf, EkfError, State};
use sonarfix::health::Verdict;
use sonarfix::localizer::{Fix, Localizer, OdometryError, Refusal, Start};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::motion::{Drive, WheelTravel};
use sonarfix::pose::{Heading, Point, Pose};
use sonarfix::range::ExpectedRange;
use sonarfix::units::{Instant, Metres, PerRootMetre, Radians, SquareMetres};

use crate::strategies::{Room, any_ekf, any_mount, any_room, any_sight, bits, config_for_rooms};

const BAD: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

/// Everything that a refusal must leave alone.
fn estimate(localizer: &Localizer) -> (Vec<u32>, Instant) {
    (bits(localizer.filter()), localizer.time())
}

/// A room's walls, and beyond the first of them, in line with it, one whose foot the robot never
/// has: it begins 4 m past the corner.
fn walls_and_one_aside(room: &Room) -> Vec<Wall> {
    let mut walls = room.walls().to_vec();
    let (wall, length) = (walls[0], walls[0].length().0);
    let along = |s: f32| {
        let (tx, ty) = (wall.b(), -wall.a());
        Point::new(wall.from().x.0 + tx * s, wall.from().y.0 + ty * s)
    };
    walls.push(Wall::new(along(length + 4.0), along(length + 8.0)).unwrap());
    walls
}

/// A localizer that has driven a little and taken a fix, so that no number in it is round.
fn started<'m>(room: &Room, walls: &'m [Wall], mount: Point) -> Localizer<'m> {
    let config = config_for_rooms(mount);
    let start = Instant::from_ticks(1_000_000);
    let mut localizer = Localizer::new(config, Map::new(walls), room.start(), start).unwrap();
    localizer.odometry(Instant::from_ticks(1_500_000), WheelTravel::new(0.021, 0.017)).unwrap();
    let aim = localizer.aim().unwrap();
    let fix = localizer.fix(&aim, Some(aim.range + Metres(0.003)));
    assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
    localizer
}

proptest! {
    /// Wheel travels.
    #[test]
    fn a_refused_travel_changes_no_bit(room in any_room(), mount in any_mount(), good in -0.05_f32..0.05) {
        let walls = walls_and_one_aside(&room);
        let mut localizer = started(&room, &walls, mount);
        let before = estimate(&localizer);
        let (earlier, now, later) =
            (Instant::from_ticks(1_499_999), Instant::from_ticks(1_500_000), Instant::from_ticks(1_600_000));
        let still = WheelTravel::default();
        let moved = WheelTravel::new(0.001, 0.0);
        // 0.1 s at 2 m/s is 0.2 m.
        let mut cases = vec![
            (earlier, still, OdometryError::TimeRanBackwards),
            (earlier, moved, OdometryError::TimeRanBackwards),
            (Instant::from_ticks(0), WheelTravel::new(good, good), OdometryError::TimeRanBackwards),
            (now, moved, OdometryError::NoTimePassed),
            (now, WheelTravel::new(0.0, -0.001), OdometryError::NoTimePassed),
            (later, WheelTravel::new(0.201, good), OdometryError::TooFast),
            (later, WheelTravel::new(good, -0.201), OdometryError::TooFast),
            (later, WheelTravel::new(f32::MAX, f32::MAX), OdometryError::TooFast),
        ];
        for bad in BAD {
            let error = OdometryError::Filter(EkfError::NotFinite);
            cases.push((later, WheelTravel::new(bad, good), error));
            cases.push((later, WheelTravel::new(good, bad), error));
        }
        for (time, travel, error) in cases {
            prop_assert_eq!(localizer.odometry(time, travel), Err(error), "{:?}", travel);
            prop_assert_eq!(estimate(&localizer), before.clone(), "{:?}", travel);
        }
        // The next good one is taken as if nothing had been.
        prop_assert_eq!(localizer.odometry(now, still), Ok(()));
        prop_assert_eq!(localizer.odometry(later, WheelTravel::new(0.199, good)), Ok(()));
        prop_assert_ne!(estimate(&localizer), before);
    }

    /// Ranges.
    #[test]
    fn a_refused_range_changes_no_bit(room in any_room(), mount in any_mount(), short in 0.0_f32..0.0499, long in 12.001_f32..1e6) {
        let walls = walls_and_one_aside(&room);
        let mut localizer = started(&room, &walls, mount);
        let before = estimate(&localizer);
        let aim = localizer.aim().unwrap();
        let cone = localizer.config().sonar.cone;
        let askew = |by: Radians| Aim { bearing: aim.bearing + by, ..aim };
        let good = Some(aim.range);
        let mut cases = vec![
            (aim, None, Refusal::NoEcho),
            (aim, Some(Metres(short)), Refusal::OutOfRange),
            (aim, Some(Metres(-aim.range.0)), Refusal::OutOfRange),
            (aim, Some(Metres(long)), Refusal::OutOfRange),
            (Aim { wall: WallId(5), ..aim }, good, Refusal::UnknownWall),
            (Aim { wall: WallId(u32::MAX), ..aim }, good, Refusal::UnknownWall),
            (Aim { wall: WallId(4), ..aim }, good, Refusal::FootOffWall),
            (askew(cone), good, Refusal::NotSquare),
            (askew(-cone), good, Refusal::NotSquare),
            (askew(Radians(f32::NAN)), good, Refusal::NotSquare),
        ];
        cases.extend(BAD.map(|bad| (aim, Some(Metres(bad)), Refusal::NotFinite)));
        for (aim, range, refusal) in cases {
            prop_assert_eq!(localizer.fix(&aim, range), Fix::Refused(refusal));
            prop_assert_eq!(estimate(&localizer), before.clone(), "{:?} {:?}", aim, range);
        }
        prop_assert!(matches!(localizer.fix(&aim, good), Fix::Accepted(_)));
        prop_assert_ne!(estimate(&localizer), before);
    }

    /// The gate is at `gate` standard deviations of the innovation: a thousandth inside, accepted;
    /// a thousandth outside, gated, and no bit changed. (Ranges have 6 digits at the least.)
    #[test]
    fn the_gate_is_where_it_is_said_to_be(
        room in any_room(), mount in any_mount(), gate in 1.0_f32..6.0, far in any::<bool>(), beyond in 1.001_f32..1.5,
    ) {
        let walls = walls_and_one_aside(&room);
        let mut config = config_for_rooms(mount);
        config.trust.gate = gate;
        config.trust.short = 0.0;
        let localizer = Localizer::new(config, Map::new(&walls), room.start(), Instant::from_ticks(0)).unwrap();
        let aim = localizer.aim().unwrap();
        let ekf = localizer.filter();
        let expected = ExpectedRange::new(&walls[aim.wall.0 as usize], mount, &ekf.state());
        let innovation = ekf.innovation(aim.range, &expected, config.sonar.noise.variance(expected.range));
        let sigma = innovation.variance.0.sqrt() * if far { 1.0 } else { -1.0 };

        let mut inside = localizer.clone();
        let fix = inside.fix(&aim, Some(aim.range + Metres(gate * 0.999 * sigma)));
        prop_assert!(matches!(fix, Fix::Accepted(i) if i.nis() <= gate * gate), "{fix:?}");
        prop_assert_ne!(estimate(&inside), estimate(&localizer));

        let mut outside = localizer.clone();
        let fix = outside.fix(&aim, Some(aim.range + Metres(gate * beyond * sigma)));
        prop_assert!(matches!(fix, Fix::Gated(i) if i.nis() > gate * gate), "{fix:?}");
        prop_assert_eq!(estimate(&outside), estimate(&localizer));
    }

    /// Beyond the gate and inside the outer one a range is taken with the noise that brings it to the
    /// gate; beyond the outer one it is gated, and no bit changes.
    #[test]
    fn beyond_the_gate_a_range_is_weakened_if_asked_for(
        room in any_room(), mount in any_mount(), gate in 1.0_f32..4.0, times in 1.1_f32..3.0, inside in 0.1_f32..0.95,
    ) {
        let walls = walls_and_one_aside(&room);
        let mut config = config_for_rooms(mount);
        config.trust.gate = gate;
        config.trust.outer_gate = gate * times;
        config.trust.short = 0.0;
        let localizer = Localizer::new(config, Map::new(&walls), room.start(), Instant::from_ticks(0)).unwrap();
        let aim = localizer.aim().unwrap();
        let ekf = localizer.filter();
        let expected = ExpectedRange::new(&walls[aim.wall.0 as usize], mount, &ekf.state());
        let noise = config.sonar.noise.variance(expected.range);
        let innovation = ekf.innovation(aim.range, &expected, noise);
        let sigma = innovation.variance.0.sqrt();
        let sigmas = gate * (1.0 + inside * (times - 1.0));

        let mut weakened = localizer.clone();
        let fix = weakened.fix(&aim, Some(aim.range + Metres(sigmas * sigma)));
        let Fix::Weakened(taken) = fix else { return Err(TestCaseError::fail(format!("{fix:?}"))) };
        prop_assert!((taken.nis() / (gate * gate) - 1.0).abs() < 1e-3, "{taken:?}");
        // The same as a filter that is told of that noise.
        let mut told = *ekf;
        let raised = noise.0 + taken.variance.0 - innovation.variance.0;
        told.update(aim.range + Metres(sigmas * sigma), &expected, SquareMetres(raised)).unwrap();
        let (ours, theirs) = (weakened.filter().deviation().x, told.deviation().x);
        prop_assert!((ours - theirs).abs() <= 1e-3 * theirs, "{ours} {theirs}");

        let mut beyond = localizer.clone();
        let fix = beyond.fix(&aim, Some(aim.range + Metres(gate * times * 1.001 * sigma)));
        prop_assert!(matches!(fix, Fix::Gated(_)), "{fix:?}");
        prop_assert_eq!(estimate(&beyond), estimate(&localizer));
    }

    /// A short range is believed less than a long one that is as far off, and moves the filter less.
    #[test]
    fn a_short_range_is_believed_less(
        room in any_room(), mount in any_mount(), short in 1.0_f32..3.0, off in 1.05_f32..3.0,
    ) {
        let walls = walls_and_one_aside(&room);
        let mut config = config_for_rooms(mount);
        config.trust.short = short;
        // So that it is inside the gate.
        config.trust.gate = 50.0;
        let localizer = Localizer::new(config, Map::new(&walls), room.start(), Instant::from_ticks(0)).unwrap();
        let aim = localizer.aim().unwrap();
        let ekf = localizer.filter();
        let expected = ExpectedRange::new(&walls[aim.wall.0 as usize], mount, &ekf.state());
        let by = short * off * config.sonar.noise.variance(expected.range).0.sqrt();
        let (mut longer, mut shorter) = (localizer.clone(), localizer.clone());
        let long = longer.fix(&aim, Some(expected.range + Metres(by)));
        let short_fix = shorter.fix(&aim, Some(expected.range - Metres(by)));
        prop_assert!(matches!(long, Fix::Accepted(_)), "{long:?}");
        prop_assert!(matches!(short_fix, Fix::Weakened(_)), "{short_fix:?}");
        let moved = |l: &Localizer| {
            let (now, was) = (l.filter().state(), ekf.state());
            (now.x - was.x).hypot(now.y - was.y)
        };
        prop_assert!(moved(&shorter) < moved(&longer));
        let spread = |l: &Localizer| l.filter().deviation().x.hypot(l.filter().deviation().y);
        prop_assert!(spread(&shorter) > spread(&longer));
    }

    /// A robot that is lost lets its doubt grow by the stated rule with each range beyond the gate that
    /// is not of the same wall again, up to the stated bound, and says so; one that is not lost does
    /// not.
    #[test]
    fn the_gate_of_a_lost_robot_reopens(room in any_room(), mount in any_mount(), reopen in 0.005_f32..0.03) {
        let walls = walls_and_one_aside(&room);
        let mut config = config_for_rooms(mount);
        config.trust.reopen = Metres(reopen);
        let mut localizer = Localizer::new(config, Map::new(&walls), room.start(), Instant::from_ticks(0)).unwrap();
        let mut grown = 0_u16;
        let mut looked_at = None;
        for _ in 0..200 {
            // 3 m beyond the wall: outside of the gate, however wide it grows.
            let Ok(aim) = localizer.aim() else { break };
            let was = *localizer.filter();
            let fix = localizer.fix(&aim, Some(aim.range + Metres(3.0)));
            prop_assert!(matches!(fix, Fix::Gated(_)), "{fix:?}");
            let (before, after) = (was.covariance(), localizer.filter().covariance());
            let is_lost = localizer.health().verdict == Verdict::Lost;
            let again = looked_at.replace(aim.wall) == Some(aim.wall);
            prop_assert!((is_lost && !again) || before == after);
            let added = after - before;
            let step = reopen * reopen;
            for i in [0, 1] {
                let is_step = (added[(i, i)] - step).abs() < 1e-5 * after[(i, i)] + 1e-9;
                prop_assert!(added[(i, i)] == 0.0 || is_step, "{added}");
            }
            grown += u16::from(before != after);
            prop_assert_eq!(localizer.filter().state(), was.state());
            prop_assert_eq!(localizer.health().reopened, grown);
        }
        prop_assert!(grown > 2, "{grown}");
        let doubt = localizer.health();
        prop_assert!(doubt.position_deviation.0 <= (reopen * 10.0).hypot(reopen).max(0.031) * 1.01, "{doubt:?}");
        prop_assert!(doubt.heading_deviation <= (config.sonar.cone * 0.25) + Radians(reopen));
    }

    /// What is no deviation is refused, and no bit changes; what is one is added.
    #[test]
    fn loosening_adds_what_it_says(ekf in any_ekf(), position in 0.0_f32..1.0, heading in 0.0_f32..0.5) {
        let mut changed = ekf;
        for bad in BAD {
            prop_assert_eq!(changed.loosen(Metres(bad), Radians(heading)), Err(EkfError::NotFinite));
            prop_assert_eq!(changed.loosen(Metres(position), Radians(bad)), Err(EkfError::NotFinite));
        }
        prop_assert_eq!(changed.loosen(Metres(-0.1), Radians(heading)), Err(EkfError::Negative));
        prop_assert_eq!(changed.loosen(Metres(position), Radians(-0.1)), Err(EkfError::Negative));
        prop_assert_eq!(changed.loosen(Metres(f32::MAX), Radians(heading)), Err(EkfError::NotFinite));
        prop_assert_eq!(bits(&changed), bits(&ekf));
        prop_assert_eq!(changed.loosen(Metres(position), Radians(heading)), Ok(()));
        let (before, after) = (ekf.deviation(), changed.deviation());
        prop_assert!((after.x - before.x.hypot(position)).abs() < 1e-5 * after.x);
        prop_assert!((after.y - before.y.hypot(position)).abs() < 1e-5 * after.y);
        prop_assert!((after.heading - before.heading.hypot(heading)).abs() < 1e-5 * after.heading);
        prop_assert_eq!(changed.state(), ekf.state());
    }

    /// The filter itself, given what the localizer would have stopped.
    #[test]
    fn a_filter_refuses_what_it_cannot_compute_with(
        ekf in any_ekf(), sight in any_sight(), mount in any_mount(), which in 0_usize..5,
    ) {
        let mut changed = ekf;
        let state = ekf.state();
        let expected = ExpectedRange::new(&sight.wall(Point::new(state.x, state.y)), mount, &state);
        let (range, noise) = (expected.range, SquareMetres(1e-4));
        for bad in BAD {
            prop_assert_eq!(changed.update(Metres(bad), &expected, noise), Err(EkfError::NotFinite));
            prop_assert_eq!(changed.update(range, &expected, SquareMetres(bad)), Err(EkfError::NotFinite));
            let mut broken = expected;
            *[&mut broken.range.0, &mut broken.by_x, &mut broken.by_y, &mut broken.by_heading, &mut broken.by_range_scale][which] = bad;
            prop_assert_eq!(changed.update(range, &broken, noise), Err(EkfError::NotFinite));
            prop_assert_eq!(changed.predict(WheelTravel::new(bad, 0.1)), Err(EkfError::NotFinite));
            prop_assert_eq!(changed.predict(WheelTravel::new(0.0, bad)), Err(EkfError::NotFinite));
        }
        prop_assert_eq!(changed.update(range, &expected, SquareMetres(-1e-9)), Err(EkfError::Negative));
        prop_assert_eq!(changed.update(range, &expected, SquareMetres(0.0)), Err(EkfError::Noiseless));
        prop_assert_eq!(changed.update(range, &expected, SquareMetres(-0.0)), Err(EkfError::Noiseless));
        // Finite, but its square is not.
        prop_assert_eq!(changed.predict(WheelTravel::new(f32::MAX, f32::MAX)), Err(EkfError::NotFinite));
        let steep = ExpectedRange { by_x: f32::MAX, direction: Heading::default(), ..expected };
        prop_assert_eq!(changed.update(range, &steep, noise), Err(EkfError::NotFinite));
        prop_assert_eq!(bits(&changed), bits(&ekf));
        prop_assert_eq!(changed.update(range, &expected, noise), Ok(()));
        prop_assert_ne!(bits(&changed), bits(&ekf));
    }
}

/// A variance that grows beyond what is computed with is found when it has been computed: then the
/// filter is put back.
#[test]
fn what_grows_too_large_is_put_back() {
    let drive = Drive {
        track_width: Metres(0.2),
        wheel_noise: PerRootMetre(Metres(1e-3)),
        scale_walk: PerRootMetre(0.0),
        // So wide that after 4 m of both wheels the track width's variance is beyond 1e12 m².
        track_width_walk: PerRootMetre(Metres(1e6)),
    };
    let deviation = State { x: 0.1, y: 0.1, heading: 1e5, ..State::default() };
    let before = Ekf::new(drive, State::default(), deviation).unwrap();
    // 100 m along a heading uncertain by 1e5 rad: 1e14 m².
    let mut ekf = before;
    assert_eq!(ekf.predict(WheelTravel::new(100.0, 100.0)), Err(EkfError::NotFinite));
    assert_eq!(ekf, before);

    assert_eq!(ekf.predict(WheelTravel::new(2.0, 2.0)), Ok(()));
    let before = ekf;
    let wall = Wall::new(Point::new(5.0, -5.0), Point::new(5.0, 5.0)).unwrap();
    let expected = ExpectedRange::new(&wall, Point::default(), &ekf.state());
    let noise = SquareMetres(1e-4);
    assert_eq!(ekf.update(expected.range, &expected, noise), Err(EkfError::NotFinite));
    assert_eq!(ekf, before);
}

/// A travel that is refused is no way rolled and no time passed.
#[test]
fn a_refused_travel_does_not_count_for_health() {
    let walls = [Wall::new(Point::new(2.0, -5.0), Point::new(2.0, 5.0)).unwrap()];
    let config = config_for_rooms(Point::default());
    let start = Start {
        pose: Pose::default(),
        position_deviation: Metres(0.03),
        heading_deviation: Radians(0.01),
    };
    let zero = Instant::from_ticks(0);
    let mut localizer = Localizer::new(config, Map::new(&walls), start, zero).unwrap();
    let before = localizer.health();
    let too_fast = WheelTravel::new(50.0, 50.0);
    let refused = localizer.odometry(Instant::from_ticks(1_000_000), too_fast);
    assert_eq!(refused, Err(OdometryError::TooFast));
    assert_eq!(localizer.health(), before);
}

/// A noise whose square is not finite would make NaN of no way at all.
#[test]
fn a_noise_too_large_to_square_is_refused() {
    let sound = config_for_rooms(Point::default()).drive;
    let started = |drive| Ekf::new(drive, State::default(), State::default());
    assert!(started(sound).is_ok());
    for large in [1e19, f32::MAX] {
        let noise = PerRootMetre(Metres(large));
        for drive in [
            Drive { wheel_noise: noise, ..sound },
            Drive { scale_walk: PerRootMetre(large), ..sound },
            Drive { track_width_walk: noise, ..sound },
        ] {
            assert_eq!(started(drive).err(), Some(EkfError::NotFinite), "{drive:?}");
        }
    }
}
