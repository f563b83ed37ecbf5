//! The reference scenario has the values of the paper.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI};

use sonarfix::aim::Policy;
use sonarfix::config::{Config, PingSchedule, PingTiming};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond, PerRootMetre, Radians};
use sonarfix::sensor::echo::EchoParameters;
use sonarfix::sensor::range::RangeNoise;
use sonarfix_map::devices::INSTANT_SERVO;
use sonarfix_map::{FileError, GyroTruth, Movement, PAPER, PathPose, Run, Scenario, Start, Truth};

fn paper() -> Result<Scenario, FileError> {
    Scenario::parse(PAPER, "paper.toml", std::path::Path::new(""))
}

#[test]
fn the_path_is_four_laps_in_1248_seconds() {
    let path = paper().unwrap().path;
    assert!((path.duration() - 1248.0).abs() < 1e-9, "{}", path.duration());
    assert!((path.length() - 480.0).abs() < 1e-9);
    assert!(path.is_closed());

    let start = PathPose { x: 0.0, y: 0.0, heading: FRAC_PI_2 };
    assert_eq!(path.pose_at(0.0), start);
    assert_eq!(path.pose_at(1248.0), start);
    assert_eq!(path.pose_at(path.duration()), start);

    let is_straight = |movement| matches!(movement, Movement::Straight(_));
    let straights = path.legs().iter().filter(|leg| is_straight(leg.movement)).count();
    assert_eq!((straights, path.legs().len()), (16, 32));
    for turn in path.legs().iter().filter(|leg| !is_straight(leg.movement)) {
        assert!(matches!(turn.movement, Movement::Turn(by) if (by - FRAC_PI_2).abs() < 1e-15));
        assert!((turn.duration - 3.0).abs() < 1e-12);
    }
}

#[test]
fn the_path_is_the_rectangle_counter_clockwise() {
    let path = paper().unwrap().path;
    let lap = 312.0;
    let cases = [
        (50.0, [0.0, 20.0, FRAC_PI_2]),
        (102.0, [0.0, 40.0, FRAC_PI_2 + FRAC_PI_3]),
        (128.0, [-10.0, 40.0, PI]),
        (206.0, [-20.0, 20.0, -FRAC_PI_2]),
        (284.0, [-10.0, 0.0, 0.0]),
        (310.5, [0.0, 0.0, 0.5 * FRAC_PI_2]),
    ];
    for (time, [x, y, heading]) in cases {
        for round in [0.0, 3.0] {
            let pose = path.pose_at(time + round * lap);
            let off = (pose.x - x).abs() + (pose.y - y).abs() + (pose.heading - heading).abs();
            assert!(off < 1e-9, "{time}: {pose:?}");
        }
    }
}

#[test]
fn the_walls_are_two_rectangles() {
    let floor = paper().unwrap().floor;
    let mut found: Vec<_> =
        floor.named_walls().iter().map(|wall| (wall.name(), [wall.from(), wall.to()])).collect();
    for (_, ends) in &mut found {
        ends.sort_by(|a, b| a.partial_cmp(b).unwrap());
    }
    let expected = [
        ("outer east", [[2.5, -1.5], [2.5, 41.5]]),
        ("outer north", [[-22.5, 41.5], [2.5, 41.5]]),
        ("outer west", [[-22.5, -1.5], [-22.5, 41.5]]),
        ("outer south", [[-22.5, -1.5], [2.5, -1.5]]),
        ("inner east", [[-3.0, 3.0], [-3.0, 37.0]]),
        ("inner north", [[-17.0, 37.0], [-3.0, 37.0]]),
        ("inner west", [[-17.0, 3.0], [-17.0, 37.0]]),
        ("inner south", [[-17.0, 3.0], [-3.0, 3.0]]),
    ];
    assert_eq!(found, expected);

    let walls = floor.walls();
    assert_eq!(walls.len(), 8);
    for (wall, named) in walls.iter().zip(floor.named_walls()) {
        let [x, y] = named.from();
        assert_eq!((f64::from(wall.from().x.0), f64::from(wall.from().y.0)), (x, y));
    }
}

#[test]
fn the_robot_is_that_of_the_paper() {
    let robot = paper().unwrap().robot;
    let half_turn = Radians(std::f32::consts::PI);
    let mut config = Config::for_track_width(Metres(0.35));
    config.drive.wheel_noise = PerRootMetre(Metres(0.0005));
    config.drive.scale_walk = PerRootMetre(5e-6);
    config.drive.track_width_walk = PerRootMetre(Metres(5e-6));
    config.max_wheel_speed = MetresPerSecond(2.0);
    config.rangers.first.mount = Point::new(0.0, 0.0);
    config.rangers.first.servo = (-half_turn, half_turn);
    config.rangers.first.cone = Radians(std::f32::consts::PI / 12.0);
    config.rangers.first.min_range = Metres(0.05);
    config.rangers.first.max_range = Metres(10.0);
    config.rangers.first.noise = RangeNoise { floor: Metres(0.0024), per_metre: 0.0 };
    config.rangers.first.timing = PingTiming {
        schedule: PingSchedule::Every(Duration::secs(1)),
        servo: INSTANT_SERVO,
        cycle: Duration::millis(100),
    };
    config.prior.scale_right = 0.01;
    config.prior.scale_left = 0.01;
    config.prior.track_width = Metres(0.01);
    config.prior.range_scale = 0.0;
    config.prior.mount = Metres(0.0);
    config.gating.confidence = 3.0;
    config.echo = EchoParameters::NONE;
    config.policy = Policy::Nearest;
    assert_eq!(robot.localizer, config);
    assert_eq!(robot.encoder_period, Duration::millis(100));
    assert_eq!(robot.right_wheel.signed_travel(), Metres(0.001));
    assert_eq!(robot.left_wheel.signed_travel(), Metres(0.001));
}

#[test]
fn start_truth_and_runs_are_those_of_the_paper() {
    let paper = paper().unwrap();
    assert_eq!(paper.name, "paper");
    assert_eq!(
        paper.start,
        Start { position: 0.001, heading: 0.001, drawn: true, is_unknown: false }
    );
    let truth = Truth {
        track_width: 0.3488,
        scale_right: -0.0065,
        scale_left: 2.0e-4,
        range_scale: 0.0,
        range_offset: 0.0,
        wheel_noise: 0.0005,
        scale_walk: 0.0,
        track_width_walk: 0.0,
        range_noise: 0.0024,
        range_noise_per_metre: 0.0,
        cone: PI / 12.0,
        mount: [None; 2],
        servo_pulses: None,
        servo_zero: 0.0,
        servo_scale: 0.0,
        gyro: GyroTruth::default(),
    };
    assert_eq!(paper.truth, truth);
    assert_eq!(paper.run, Run { runs: 50, seed: 0 });
}
