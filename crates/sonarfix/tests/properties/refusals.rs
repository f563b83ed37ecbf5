//! A refused or gated range changes no bit; an associated one changes the estimate within bounds.

use proptest::prelude::*;
use sonarfix::aim::Aim;
use sonarfix::filter::ekf::{Ekf, EkfError, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::{Heading, Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, PerRootMetre, Radians, SquareMetres};
use sonarfix::health::Verdict;
use sonarfix::localizer::{Fix, Localizer, OdometryError, Refusal};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::sensor::echo::EchoParameters;
use sonarfix::sensor::range::ExpectedRange;

use crate::strategies::{
    Room, any_ekf, any_mount, any_room, any_sight, bits, config_for_rooms, start_at,
};

const BAD: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

/// Everything that a refusal must not change.
fn estimate(localizer: &Localizer) -> (Vec<u32>, Instant) {
    (bits(localizer.filter()), localizer.time())
}

/// The walls of a room, and beyond the first of them, in line with it, one on which the foot never
/// lies: it begins 4 m past the corner.
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

/// A localizer after some travel and a fix, so that no number in it is round.
fn started<'m>(room: &Room, walls: &'m [Wall], mount: Point) -> Localizer<'m> {
    let mut config = config_for_rooms(mount);
    config.prior.mount = Metres(0.005);
    // The covariance of a lost robot stays.
    config.gating.inflation = Metres(0.0);
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
        // The next valid one is accepted.
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
        let cone = localizer.config().rangers.first.cone;
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
            (askew(cone + cone), good, Refusal::NotSquare),
            (askew(-cone - cone), good, Refusal::NotSquare),
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

    /// An echo that cannot be the wall's is gated and changes no bit; one of probability zero neither.
    #[test]
    fn an_echo_of_probability_zero_changes_no_bit(
        room in any_room(), mount in any_mount(), sigmas in 20.0_f32..60.0, far in any::<bool>(),
    ) {
        let walls = walls_and_one_aside(&room);
        let mut config = config_for_rooms(mount);
        config.prior.mount = Metres(0.005);
        config.echo = EchoParameters::HC_SR04;
        let localizer = Localizer::new(config, Map::new(&walls), room.start(), Instant::from_ticks(0)).unwrap();
        let aim = localizer.aim().unwrap();
        let ekf = localizer.filter();
        let expected = ExpectedRange::new(&walls[aim.wall.0 as usize], mount, &ekf.state());
        let noise = config.rangers.first.noise.variance(expected.range);
        let innovation = ekf.innovation(aim.range, &expected, noise);
        let off = sigmas * innovation.variance.0.sqrt() * if far { 1.0 } else { -1.0 };
        let range = aim.range + Metres(off);
        prop_assume!(range > config.rangers.first.min_range && range < config.rangers.first.max_range);
        let mut gated = localizer.clone();
        let fix = gated.fix(&aim, Some(range));
        prop_assert!(matches!(fix, Fix::Gated(_)), "{fix:?}");
        prop_assert_eq!(estimate(&gated), estimate(&localizer));

        let mut filter = *ekf;
        filter.update_associated(range, &expected, noise, 0.0).unwrap();
        prop_assert_eq!(bits(&filter), bits(ekf));
        for bad in [f32::NAN, -0.1, 1.001] {
            prop_assert_eq!(filter.update_associated(range, &expected, noise, bad), Err(EkfError::NotFinite));
            prop_assert_eq!(bits(&filter), bits(ekf));
        }
    }

    /// The covariance after an echo of any probability is not smaller than after a certain one, in any
    /// direction; the state moves by that share; and a certain echo has the bits of an update.
    #[test]
    fn an_uncertain_association_never_shrinks_the_covariance_more_than_a_certain_one(
        ekf in any_ekf(), sight in any_sight(), mount in any_mount(), association in 0.01_f32..0.999, off in -0.3_f32..0.3,
        direction in proptest::array::uniform7(-1.0_f64..1.0),
    ) {
        let state = ekf.state();
        let expected = ExpectedRange::new(&sight.wall(state.pose().position()), mount, &state);
        let (range, noise) = (expected.range + Metres(off), SquareMetres(1e-4));
        let (mut certain, mut same, mut uncertain) = (ekf, ekf, ekf);
        certain.update(range, &expected, noise).unwrap();
        same.update_associated(range, &expected, noise, 1.0).unwrap();
        prop_assert_eq!(bits(&certain), bits(&same));
        uncertain.update_associated(range, &expected, noise, association).unwrap();
        let (small, large) = (certain.covariance().map(f64::from), uncertain.covariance().map(f64::from));
        let scale = nalgebra::SVector::<f64, 7>::from_fn(|i, _| direction[i] / large[(i, i)].max(1e-30).sqrt());
        let along = |p: &nalgebra::SMatrix<f64, 7, 7>| (scale.transpose() * p * scale)[(0, 0)];
        prop_assert!(along(&large) >= along(&small) - 1e-4, "{} {}", along(&large), along(&small));
        let moved = |to: &Ekf| (to.state().x.0 - state.x.0, to.state().y.0 - state.y.0);
        let ((x, y), (cx, cy)) = (moved(&uncertain), moved(&certain));
        prop_assert!((x - association * cx).abs() < 1e-5 && (y - association * cy).abs() < 1e-5);
    }

    /// A lost robot inflates its covariance by the stated steps, with each ping that contradicts
    /// independently, up to the stated bound; a robot that is not lost does not.
    #[test]
    fn a_lost_robot_inflates_its_pose_covariance(room in any_room(), mount in any_mount(), inflation in 0.005_f32..0.03) {
        let walls = walls_and_one_aside(&room);
        let mut config = config_for_rooms(mount);
        config.prior.mount = Metres(0.005);
        config.gating.inflation = Metres(inflation);
        config.echo = EchoParameters::HC_SR04;
        let mut localizer = Localizer::new(config, Map::new(&walls), room.start(), Instant::from_ticks(0)).unwrap();
        let mut grown = 0_u16;
        for step in 1..=200_u64 {
            // Time passes, so that no wall stays occluded.
            let now = Instant::from_ticks(step * 60_000_000);
            localizer.odometry(now, WheelTravel::default()).unwrap();
            // Metres beyond the wall: clutter, however uncertain the pose. Two of the distances may be those of an echo over two walls.
            let beyond = Metres(3.0 + 0.4 * f32::from(u8::try_from(step % 5).unwrap()));
            let Ok(aim) = localizer.aim() else { break };
            let before = localizer.filter().covariance();
            let state = localizer.filter().state();
            let fix = localizer.fix(&aim, Some(aim.range + beyond));
            prop_assert!(matches!(fix, Fix::Gated(_)), "{fix:?}");
            let after = localizer.filter().covariance();
            prop_assert!(localizer.health().verdict == Verdict::Lost || before == after);
            let added = after - before;
            for i in [0, 1] {
                let is_step = (added[(i, i)] - inflation * inflation).abs() < 1e-5 * after[(i, i)] + 1e-9;
                prop_assert!(added[(i, i)] == 0.0 || is_step, "{added}");
            }
            grown += u16::from(before != after);
            prop_assert_eq!(localizer.filter().state(), state);
            prop_assert_eq!(localizer.health().inflations, grown);
        }
        prop_assert!(grown > 2, "{grown}");
        let health = localizer.health();
        prop_assert!(health.position_deviation.0 <= (inflation * 10.0).hypot(inflation).max(0.031) * 1.01, "{health:?}");
        prop_assert!(health.heading_deviation.0 <= 0.26 + inflation);
    }

    /// An invalid deviation is refused, and no bit changes; a valid one is added.
    #[test]
    fn inflate_pose_adds_the_given_variances(ekf in any_ekf(), position in 0.0_f32..1.0, heading in 0.0_f32..0.5) {
        let mut changed = ekf;
        for bad in BAD {
            prop_assert_eq!(changed.inflate_pose(Metres(bad), Radians(heading)), Err(EkfError::NotFinite));
            prop_assert_eq!(changed.inflate_pose(Metres(position), Radians(bad)), Err(EkfError::NotFinite));
        }
        prop_assert_eq!(changed.inflate_pose(Metres(-0.1), Radians(heading)), Err(EkfError::NegativeVariance));
        prop_assert_eq!(changed.inflate_pose(Metres(position), Radians(-0.1)), Err(EkfError::NegativeVariance));
        prop_assert_eq!(changed.inflate_pose(Metres(f32::MAX), Radians(heading)), Err(EkfError::VarianceTooLarge));
        prop_assert_eq!(bits(&changed), bits(&ekf));
        prop_assert_eq!(changed.inflate_pose(Metres(position), Radians(heading)), Ok(()));
        let (before, after) = (ekf.standard_deviations(), changed.standard_deviations());
        prop_assert!((after.x.0 - before.x.0.hypot(position)).abs() < 1e-5 * after.x.0);
        prop_assert!((after.y.0 - before.y.0.hypot(position)).abs() < 1e-5 * after.y.0);
        prop_assert!((after.heading.0 - before.heading.0.hypot(heading)).abs() < 1e-5 * after.heading.0);
        prop_assert_eq!(changed.state(), ekf.state());
    }

    /// The filter itself, with arguments that the localizer would refuse.
    #[test]
    fn a_filter_refuses_invalid_arguments(
        ekf in any_ekf(), sight in any_sight(), mount in any_mount(), which in 0_usize..5,
    ) {
        let mut changed = ekf;
        let state = ekf.state();
        let expected = ExpectedRange::new(&sight.wall(state.pose().position()), mount, &state);
        let (range, noise) = (expected.range, SquareMetres(1e-4));
        for bad in BAD {
            prop_assert_eq!(changed.update(Metres(bad), &expected, noise), Err(EkfError::NotFinite));
            prop_assert_eq!(changed.update(range, &expected, SquareMetres(bad)), Err(EkfError::NotFinite));
            let mut broken = expected;
            *[&mut broken.range.0, &mut broken.by_x, &mut broken.by_y, &mut broken.by_heading, &mut broken.by_range_scale][which] = bad;
            let error = if which == 0 { EkfError::NotFinite } else { EkfError::JacobianTooLarge };
            prop_assert_eq!(changed.update(range, &broken, noise), Err(error));
            prop_assert_eq!(changed.predict(WheelTravel::new(bad, 0.1)), Err(EkfError::NotFinite));
            prop_assert_eq!(changed.predict(WheelTravel::new(0.0, bad)), Err(EkfError::NotFinite));
        }
        prop_assert_eq!(changed.update(range, &expected, SquareMetres(-1e-9)), Err(EkfError::NegativeVariance));
        prop_assert_eq!(changed.update(range, &expected, SquareMetres(0.0)), Err(EkfError::ZeroNoise));
        prop_assert_eq!(changed.update(range, &expected, SquareMetres(-0.0)), Err(EkfError::ZeroNoise));
        prop_assert_eq!(changed.update(range, &expected, SquareMetres(1e7)), Err(EkfError::NoiseTooLarge));
        prop_assert_eq!(changed.update(Metres(1e7), &expected, noise), Err(EkfError::InnovationTooLarge));
        // A turn of more than 64 rad, or one that overflows.
        prop_assert_eq!(changed.predict(WheelTravel::new(100.0, -100.0)), Err(EkfError::TurnTooLarge));
        prop_assert_eq!(changed.predict(WheelTravel::new(f32::MAX, -f32::MAX)), Err(EkfError::TurnTooLarge));
        let steep = ExpectedRange { by_x: f32::MAX, direction: Heading::default(), ..expected };
        prop_assert_eq!(changed.update(range, &steep, noise), Err(EkfError::JacobianTooLarge));
        prop_assert_eq!(bits(&changed), bits(&ekf));
        prop_assert_eq!(changed.update(range, &expected, noise), Ok(()));
        prop_assert_ne!(bits(&changed), bits(&ekf));
    }
}

/// A variance that exceeds its limit is detected after it has been computed; the filter is
/// restored.
#[test]
fn a_filter_is_restored_if_a_variance_is_too_large() {
    let drive = Drive {
        track_width: Metres(0.2),
        wheel_noise: PerRootMetre(Metres(1e-3)),
        scale_walk: PerRootMetre(0.0),
        // So large that after 4 m of both wheels the variance of the track width exceeds 1e12 m².
        track_width_walk: PerRootMetre(Metres(1e6)),
    };
    let deviation = StandardDeviations {
        x: Metres(0.1),
        y: Metres(0.1),
        heading: Radians(1e5),
        ..StandardDeviations::default()
    };
    let before = Ekf::new(drive, StateEstimate::default(), deviation).unwrap();
    // 100 m along a heading uncertain by 1e5 rad: 1e14 m².
    let mut ekf = before;
    assert_eq!(ekf.predict(WheelTravel::new(100.0, 100.0)), Err(EkfError::VarianceTooLarge));
    assert_eq!(ekf, before);

    assert_eq!(ekf.predict(WheelTravel::new(2.0, 2.0)), Ok(()));
    let before = ekf;
    let wall = Wall::new(Point::new(5.0, -5.0), Point::new(5.0, 5.0)).unwrap();
    let expected = ExpectedRange::new(&wall, Point::default(), &ekf.state());
    let noise = SquareMetres(1e-4);
    assert_eq!(ekf.update(expected.range, &expected, noise), Err(EkfError::VarianceTooLarge));
    assert_eq!(ekf, before);
}

/// A refused travel changes neither distance nor time of the health.
#[test]
fn a_refused_travel_does_not_count_for_health() {
    let walls = [Wall::new(Point::new(2.0, -5.0), Point::new(2.0, 5.0)).unwrap()];
    let config = config_for_rooms(Point::default());
    let start = start_at(Pose::default());
    let zero = Instant::from_ticks(0);
    let mut localizer = Localizer::new(config, Map::new(&walls), start, zero).unwrap();
    let before = localizer.health();
    let too_fast = WheelTravel::new(50.0, 50.0);
    let refused = localizer.odometry(Instant::from_ticks(1_000_000), too_fast);
    assert_eq!(refused, Err(OdometryError::TooFast));
    assert_eq!(localizer.health(), before);
}

/// A noise whose square is infinite would result in NaN at zero distance.
#[test]
fn a_noise_too_large_to_square_is_refused() {
    let sound = config_for_rooms(Point::default()).drive;
    let started = |drive| Ekf::new(drive, StateEstimate::default(), StandardDeviations::default());
    assert!(started(sound).is_ok());
    for large in [1e19, f32::MAX] {
        let noise = PerRootMetre(Metres(large));
        for drive in [
            Drive { wheel_noise: noise, ..sound },
            Drive { scale_walk: PerRootMetre(large), ..sound },
            Drive { track_width_walk: noise, ..sound },
        ] {
            assert_eq!(started(drive).err(), Some(EkfError::VarianceTooLarge), "{drive:?}");
        }
    }
}
