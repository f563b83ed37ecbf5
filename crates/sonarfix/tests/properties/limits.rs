//! Values at the limits of what is accepted, and small conversions.

use proptest::prelude::*;
use sonarfix::aim::Aim;
use sonarfix::config::Config;
use sonarfix::filter::ekf::{Ekf, EkfError, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{
    Duration, Instant, Metres, MetresPerSecond, PerRootMetre, PerRootSecond, Radians,
    RadiansPerSecond, SquareMetres,
};
use sonarfix::health::Verdict;
use sonarfix::localizer::{Fix, Localizer, OdometryError, Refusal, Start};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::sensor::gyro::GyroParameters;

use crate::strategies::{any_deviation, any_drive, any_state, bits, config_for_rooms};

fn config() -> Config {
    let mut config = config_for_rooms(Point::new(0.03, 0.01));
    config.prior.mount = Metres(0.005);
    config
}

/// A wall 1 m ahead of a robot at the origin.
fn wall_ahead() -> Wall {
    Wall::new(Point::new(1.0, -1.0), Point::new(1.0, 1.0)).unwrap()
}

fn at_the_origin() -> Start {
    Start {
        pose: Pose::default(),
        position_deviation: Metres(0.05),
        heading_deviation: Radians(0.01),
    }
}

/// Each rule of a configuration: a value that it permits, and the nearest kind that it does not.
#[test]
fn a_configuration_is_refused_at_its_limits() {
    type Change = fn(&mut Config);
    let rules: [(Change, Change); 13] = [
        (
            |it| (it.prior.scale_right, it.prior.scale_left) = (0.0, 0.0),
            |it| (it.prior.scale_right, it.prior.scale_left) = (0.0, 0.01),
        ),
        (
            |it| (it.prior.scale_right, it.prior.scale_left) = (0.01, 0.02),
            |it| (it.prior.scale_right, it.prior.scale_left) = (0.01, 0.0),
        ),
        (|it| it.prior.scale_difference = Some(1e-3), |it| it.prior.scale_difference = Some(0.0)),
        (
            |it| it.prior.scale_difference = None,
            |it| it.prior.scale_difference = Some(f32::INFINITY),
        ),
        (
            |it| it.prior.track_width.0 = 0.499 * it.drive.track_width.0,
            |it| it.prior.track_width.0 = 0.5 * it.drive.track_width.0,
        ),
        (
            |it| (it.echo.missed, it.echo.short, it.echo.long) = (0.5, 0.25, 0.125),
            |it| (it.echo.missed, it.echo.short, it.echo.long) = (0.5, 0.25, 0.25),
        ),
        (
            |it| (it.echo.missed, it.echo.short, it.echo.long) = (0.0, 0.0, 0.5),
            |it| (it.echo.missed, it.echo.short, it.echo.long) = (0.4, 0.3, 0.5),
        ),
        (
            |it| it.rangers.first.servo = (Radians(0.3), Radians(0.3)),
            |it| it.rangers.first.servo = (Radians(0.3), Radians(0.299_999_98)),
        ),
        (
            |it| it.rangers.first.servo = (Radians(3.0), Radians(3.0)),
            |it| it.rangers.first.servo = (Radians(3.2), Radians(3.2)),
        ),
        (
            |it| it.rangers.first.servo = (Radians(-3.0), Radians(-3.0)),
            |it| it.rangers.first.servo = (Radians(f32::NAN), Radians(f32::NAN)),
        ),
        (|it| it.rangers.first.cone = Radians(1e-3), |it| it.rangers.first.cone = Radians(0.0)),
        (
            |it| it.rangers.first.cone = Radians(1.57),
            |it| it.rangers.first.cone = Radians(core::f32::consts::FRAC_PI_2),
        ),
        (
            |it| it.rangers.first.max_range.0 = it.rangers.first.min_range.0 + 0.1,
            |it| it.rangers.first.max_range = it.rangers.first.min_range,
        ),
    ];
    for (number, (permitted, refused)) in rules.into_iter().enumerate() {
        let with = |change: Change| {
            let mut config = config();
            change(&mut config);
            config.check()
        };
        assert_eq!(with(permitted), Ok(()), "{number}");
        assert!(with(refused).is_err(), "{number}");
    }
}

/// Each parameter of a gyro: the values that are permitted, and those that are not.
#[test]
fn the_parameters_of_a_gyro_are_refused_at_their_limits() {
    type Set = fn(&mut GyroParameters, f32);
    let rules: [(&str, Set, &[f32], &[f32]); 5] = [
        ("range", |it, to| it.range = RadiansPerSecond(to), &[1e-3, 40.0], &[0.0, -1.0, f32::NAN]),
        ("noise", |it, to| it.noise = PerRootSecond(Radians(to)), &[1e-9], &[0.0, -1e-3, f32::NAN]),
        ("bias", |it, to| it.bias = RadiansPerSecond(to), &[1e-9], &[0.0, -1e-3, f32::INFINITY]),
        (
            "bias_walk",
            |it, to| it.bias_walk = PerRootSecond(RadiansPerSecond(to)),
            &[0.0, 1e-3],
            &[-1e-9, f32::NAN],
        ),
        ("scale", |it, to| it.scale = to, &[0.0, 0.5], &[-1e-6, 0.500_01, f32::NAN]),
    ];
    for (name, set, permitted, refused) in rules {
        let with = |value: f32| {
            let mut gyro = GyroParameters::MPU_6050;
            set(&mut gyro, value);
            let mut config = config();
            config.gyro = Some(gyro);
            config.check()
        };
        assert!(permitted.iter().all(|value| with(*value).is_ok()), "{name}");
        for value in refused {
            let error = with(*value).unwrap_err();
            assert_eq!(error.field, format!("gyro.{name}"), "{value}");
        }
    }
    for (ticks, is_permitted) in [(999, false), (1_000, true), (50_000, true), (50_001, false)] {
        let period = Duration::from_ticks(ticks);
        let mut config = config();
        config.gyro = Some(GyroParameters { period, ..GyroParameters::MPU_6050 });
        assert_eq!(config.check().is_ok(), is_permitted, "{ticks}");
    }
}

/// A wheel at exactly the maximum speed is accepted.
#[test]
fn a_wheel_at_the_maximum_speed_is_accepted() {
    let mut config = config();
    config.max_wheel_speed = MetresPerSecond(0.5);
    let start = Start {
        pose: Pose::default(),
        position_deviation: Metres(0.02),
        heading_deviation: Radians(0.02),
    };
    let odometry = |travel| {
        let began = Instant::from_ticks(0);
        let mut localizer = Localizer::new(config, Map::new(&[]), start, began).unwrap();
        localizer.odometry(Instant::from_ticks(500_000), travel)
    };
    assert_eq!(odometry(WheelTravel::new(0.25, -0.25)), Ok(()));
    let faster = 0.25_f32.next_up();
    assert_eq!(odometry(WheelTravel::new(faster, 0.0)), Err(OdometryError::TooFast));
    assert_eq!(odometry(WheelTravel::new(0.0, -faster)), Err(OdometryError::TooFast));
}

#[test]
fn a_parameter_of_the_drive_that_is_not_finite_is_found() {
    let drive = config().drive;
    assert!(drive.is_finite());
    let noise = PerRootMetre(Metres(f32::NAN));
    assert!(!Drive { track_width: Metres(f32::INFINITY), ..drive }.is_finite());
    assert!(!Drive { wheel_noise: noise, ..drive }.is_finite());
    assert!(!Drive { scale_walk: PerRootMetre(f32::NAN), ..drive }.is_finite());
    assert!(!Drive { track_width_walk: noise, ..drive }.is_finite());
}

/// A range without any uncertainty of the state changes nothing, and is no error.
#[test]
fn a_certain_state_accepts_a_range() {
    let drive = config().drive;
    let certain = StandardDeviations::default();
    let ekf = Ekf::new(drive, StateEstimate::default(), certain).unwrap();
    let wall = wall_ahead();
    let expected =
        sonarfix::sensor::range::ExpectedRange::new(&wall, Point::default(), &ekf.state());
    let mut after = ekf;
    after.update(Metres(1.1), &expected, SquareMetres(1e-6)).unwrap();
    assert_eq!(after.state(), ekf.state());
}

/// A new pose in a gap of the odometry begins the growth again; so does a range that is used.
#[test]
fn a_range_used_without_odometry_begins_the_growth_again() {
    let walls = [wall_ahead()];
    let began = Instant::from_ticks(0);
    let mut config = config();
    config.max_wheel_speed = MetresPerSecond(0.1);
    let mut localizer = Localizer::new(config, Map::new(&walls), at_the_origin(), began).unwrap();
    let at = |tick: u64| Instant::from_ticks(tick * 100_000);
    localizer.odometry_missing(at(1));
    let aim = localizer.aim().unwrap();
    let fix = localizer.fix(&aim, Some(aim.range));
    assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
    assert!(fix.innovation_used().is_some_and(|innovation| innovation.value.0.abs() < 1e-6));
    assert!(localizer.association() > 0.8, "{}", localizer.association());
    let corrected = localizer.filter().standard_deviations().x.0;
    assert!(corrected < 0.02, "{corrected}");
    // Had the growth continued from before the range, the correction would be lost.
    localizer.odometry_missing(at(2));
    let grown = localizer.filter().standard_deviations().x.0;
    assert!((grown - corrected.hypot(0.01)).abs() < 1e-4, "{grown}, {corrected}");
    let silent = localizer.fix(&aim, None);
    assert_eq!(silent.innovation_used(), None);
    assert_eq!(localizer.association().to_bits(), 0.0_f32.to_bits());
}

/// A ping without information on the pose inflates nothing, also when the robot is lost.
#[test]
fn a_refused_ping_of_a_lost_robot_changes_no_bit() {
    let walls = [wall_ahead()];
    let began = Instant::from_ticks(0);
    let mut localizer = Localizer::new(config(), Map::new(&walls), at_the_origin(), began).unwrap();
    let aim = localizer.aim().unwrap();
    localizer.odometry_missing(Instant::from_ticks(4_000_000));
    localizer.odometry(Instant::from_ticks(4_100_000), WheelTravel::default()).unwrap();
    assert_eq!(localizer.health().verdict, Verdict::Lost);
    let before = bits(localizer.filter());
    let unknown = Aim { wall: WallId(9), ..aim };
    for (aim, range, refusal) in [
        (aim, Some(Metres(f32::NAN)), Refusal::NotFinite),
        (unknown, Some(aim.range), Refusal::UnknownWall),
    ] {
        assert_eq!(localizer.fix(&aim, range), Fix::Refused(refusal));
        assert_eq!(bits(localizer.filter()), before, "{refusal:?}");
        assert_eq!(localizer.health().inflations, 0);
    }
}

/// A restart has state and deviations of its arguments, or changes nothing.
#[test]
fn a_restart_replaces_state_and_deviations() {
    let mut localizer =
        Localizer::new(config(), Map::new(&[]), at_the_origin(), Instant::from_ticks(0)).unwrap();
    let state = StateEstimate::from_array([1.0, 2.0, 0.3, 0.01, -0.01, 0.002, 0.005]);
    let deviation = StandardDeviations::from_array([0.1, 0.2, 0.3, 0.01, 0.01, 0.003, 0.004]);
    let negative = StandardDeviations { x: Metres(-0.1), ..deviation };
    let before = bits(localizer.filter());
    assert_eq!(localizer.restart(state, negative), Err(EkfError::NegativeVariance));
    assert_eq!(bits(localizer.filter()), before);
    localizer.restart(state, deviation).unwrap();
    let is = localizer.filter().state().to_array();
    assert!(is.iter().zip(state.to_array()).all(|(is, of)| (is - of).abs() < 1e-6), "{is:?}");
    let is = localizer.filter().standard_deviations().to_array();
    assert!(is.iter().zip(deviation.to_array()).all(|(is, of)| (is - of).abs() < 1e-6), "{is:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// One number that is not finite, or one negative deviation, changes no bit; zero is valid.
    #[test]
    fn a_pose_is_refused_for_any_of_its_numbers(
        drive in any_drive(), state in any_state(), deviation in any_deviation(), which in 0_usize..5,
        value in prop::sample::select(vec![f32::NAN, f32::INFINITY, -1e-3, 1e20, 0.0]),
    ) {
        let mut ekf = Ekf::new(drive, state, deviation).unwrap();
        let before = bits(&ekf);
        let mut numbers = [1.0, 2.0, 0.5, 0.1, 0.2];
        numbers[which] = value;
        let [x, y, heading, position, turn] = numbers;
        let result = ekf.set_pose(Pose::new(x, y, Radians(heading)), Metres(position), Radians(turn));
        let is_deviation = which >= 3;
        if !value.is_finite() {
            prop_assert_eq!(result, Err(EkfError::NotFinite));
        } else if is_deviation && value < 0.0 {
            prop_assert_eq!(result, Err(EkfError::NegativeVariance));
        } else if is_deviation && value > 1.0 {
            prop_assert_eq!(result, Err(EkfError::VarianceTooLarge));
        } else {
            prop_assert_eq!(result, Ok(()));
            let after = ekf.standard_deviations();
            prop_assert!((after.x.0 - position).abs() <= 1e-6 && (after.y.0 - position).abs() <= 1e-6);
            prop_assert!((after.heading.0 - turn).abs() <= 1e-6);
            return Ok(());
        }
        prop_assert_eq!(bits(&ekf), before);
    }

    /// A new pose is independent of the calibration, also after ranges and travels have related them.
    #[test]
    fn a_new_pose_is_independent_of_the_calibration(
        drive in any_drive(), deviation in any_deviation(), steps in 3_u8..20,
    ) {
        let mut ekf = Ekf::new(drive, StateEstimate::default(), deviation).unwrap();
        let wall = Wall::new(Point::new(3.0, -9.0), Point::new(2.5, 9.0)).unwrap();
        for _ in 0..steps {
            ekf.predict(WheelTravel::new(0.04, 0.035)).unwrap();
            let mount = Point::new(0.1, 0.05);
            let expected = sonarfix::sensor::range::ExpectedRange::new(&wall, mount, &ekf.state());
            ekf.update(expected.range, &expected, SquareMetres(1e-4)).unwrap();
        }
        let before = ekf.covariance();
        let is_related = |row: usize, column: usize| before[(row, column)].abs() > 0.0;
        prop_assert!((0..3).all(|row| is_related(row, 6)), "{before}");
        ekf.set_pose(Pose::new(1.0, 2.0, Radians(0.3)), Metres(0.1), Radians(0.2)).unwrap();
        let after = ekf.covariance();
        for (row, column) in (0..3).flat_map(|row| (3..7).map(move |column| (row, column))) {
            prop_assert_eq!(after[(row, column)].to_bits() << 1, 0, "{} {}", row, column);
        }
    }

    /// Every deviation has a limit, and none is negative.
    #[test]
    fn a_filter_is_refused_for_any_of_its_deviations(
        drive in any_drive(), state in any_state(), deviation in any_deviation(), which in 0_usize..7,
    ) {
        let with = |value: f32| {
            let mut deviations = deviation.to_array();
            deviations[which] = value;
            Ekf::new(drive, state, StandardDeviations::from_array(deviations)).err()
        };
        prop_assert_eq!(with(1e18), Some(EkfError::VarianceTooLarge));
        prop_assert_eq!(with(-1e-3), Some(EkfError::NegativeVariance));
        prop_assert_eq!(with(f32::NAN), Some(EkfError::NotFinite));
        let mut ekf = Ekf::new(drive, state, deviation).unwrap();
        prop_assert_eq!(ekf.inflate_pose(Metres(0.0), Radians(0.1)), Ok(()));
        prop_assert_eq!(ekf.inflate_pose(Metres(0.1), Radians(0.0)), Ok(()));
        let below = -1e-6;
        prop_assert_eq!(ekf.inflate_pose(Metres(below), Radians(0.1)), Err(EkfError::NegativeVariance));
        prop_assert_eq!(ekf.inflate_pose(Metres(0.1), Radians(below)), Err(EkfError::NegativeVariance));
    }

    /// A point of the robot frame in the map frame, against `f64`.
    #[test]
    fn a_point_is_placed_by_the_pose(
        x in -20.0_f32..20.0, y in -20.0_f32..20.0, heading in -3.1_f32..3.1,
        ahead in -1.0_f32..1.0, aside in -1.0_f32..1.0,
    ) {
        let pose = Pose::new(x, y, Radians(heading));
        let placed = pose.to_map(Point::new(ahead, aside));
        let (sin, cos) = f64::from(heading).sin_cos();
        let (ahead, aside) = (f64::from(ahead), f64::from(aside));
        let expected = [f64::from(x) + cos * ahead - sin * aside, f64::from(y) + sin * ahead + cos * aside];
        for (is, expected) in [placed.x, placed.y].into_iter().zip(expected) {
            prop_assert!((f64::from(is.0) - expected).abs() < 4e-6, "{is:?} {expected}");
        }
        prop_assert_eq!(pose.position(), Point::new(x, y));
        prop_assert!(pose.is_finite());
        prop_assert!(!Pose::new(f32::NAN, y, Radians(heading)).is_finite());
        prop_assert!(!Pose::new(x, f32::INFINITY, Radians(heading)).is_finite());
        prop_assert!(!Pose::new(x, y, Radians(f32::NAN)).is_finite());
        prop_assert!((Radians(heading).to_degrees() - heading * 57.295_78).abs() < 1e-4);
        prop_assert!((RadiansPerSecond(heading).to_degrees() - heading * 57.295_78).abs() < 1e-4);
    }
}
