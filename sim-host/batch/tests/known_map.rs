//! Calibration of synthetic robots in a room with a known map: accuracy, coverage of the intervals, refusals.
//!
//! The robots here are a model of a few lines, independent of estimator and simulator; the study `sonarfix-studies calibration`
//! uses the simulated pins.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "all of this file is a test")]

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use sonarfix::geometry::pose::Point;
use sonarfix_batch::calibrate::{CalibrateError, Calibration, Determined, Nominal, calibrate};
use sonarfix_batch::constants::Name;
use sonarfix_batch::echoes::Source;
use sonarfix_batch::odometry::WheelNoise;
use sonarfix_batch::problem::Noise;
use sonarfix_batch::recording::{
    Ping, Reading, Recording, RecordingError, ReferencePose, StartPose,
};
use sonarfix_batch::unknown_start::calibrate_from_search;
use sonarfix_batch::wall::Wall;
use sonarfix_map::{CLASSROOM, Scenario};
use sonarfix_replay::find::Find;

const WIDTH: f64 = 0.12;
const NOMINAL: Nominal = Nominal {
    track_width: WIDTH,
    mount: [0.06, 0.0],
    reach: [0.1, 3.5],
    sure_within: 0.0,
    noise: Noise {
        wheel: WheelNoise::independent(0.003),
        range: 0.003,
        range_per_metre: 0.001,
        position: 0.005,
        heading: 0.01,
    },
    has_servo: true,
};
/// True noise of the wheels, m/√m.
const WHEEL_NOISE: f64 = 0.002;
const ROOM: [f64; 2] = [4.0, 3.5];

fn walls() -> Vec<Wall> {
    room(ROOM)
}

/// The walls of a rectangular room, metres.
fn room([x, y]: [f64; 2]) -> Vec<Wall> {
    let corners = [[0.0, 0.0], [x, 0.0], [x, y], [0.0, y], [0.0, 0.0]];
    corners.windows(2).map(|ends| Wall::new(ends[0], ends[1]).unwrap()).collect()
}

/// A robot and its errors.
#[derive(Clone, Copy)]
struct Robot {
    wheels: [f64; 2],
    track: f64,
    range: f64,
    mount: [f64; 2],
    bearing: f64,
    turns_both_ways: bool,
}

const ROBOT: Robot = Robot {
    wheels: [0.03, -0.02],
    track: 0.05,
    range: 0.01,
    mount: [0.07, -0.01],
    bearing: 0.1,
    turns_both_ways: true,
};

/// Squares of 1 m, alternately to the left and to the right, with a sweeping sonar.
fn record(robot: &Robot, metres: f64, seed: u64) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = move || rng.sample::<f64, _>(StandardNormal);
    let mut uniform = ChaCha8Rng::seed_from_u64(!seed);
    let mut recording = Recording::default();
    let (mut pose, mut time, mut travel) = (Vector3::new(1.5, 1.25, 0.0), 0.0, [0.0, 0.0]);
    let mut bearing = -1.7_f64;
    let mut step = 0.15;
    recording.start = Some(StartPose {
        time,
        pose: pose + Vector3::new(0.01, -0.01, 0.01),
        position: 0.02,
        heading: 0.03,
    });
    recording.readings.push(Reading { time, travel });
    let mut legs = 0;
    let mut driven = 0.0;
    while driven < metres {
        let is_right = robot.turns_both_ways && (legs / 4) % 2 == 1;
        // A leg of a metre, then a quarter turn, in steps of 0.1 s.
        let straight = std::iter::repeat_n((0.02, 0.0), 50);
        let turn = if is_right { -FRAC_PI_2 } else { FRAC_PI_2 };
        for (advance, turn) in straight.chain(std::iter::repeat_n((0.0, turn / 20.0), 20)) {
            let middle = pose.z + 0.5 * turn;
            pose += Vector3::new(advance * middle.cos(), advance * middle.sin(), turn);
            time += 0.1;
            driven += advance;
            let arc = 0.5 * turn * WIDTH * (1.0 + robot.track);
            for (k, rolled) in [advance + arc, advance - arc].into_iter().enumerate() {
                let nominal = rolled / (1.0 + robot.wheels[k]);
                travel[k] += nominal + WHEEL_NOISE * nominal.abs().sqrt() * normal();
            }
            recording.readings.push(Reading { time, travel });
            bearing += step;
            if bearing.abs() > 1.7 {
                step = -step;
            }
            let range = echo(robot, &pose, bearing, uniform.random()).map(|range| {
                let outlier = if uniform.random::<f64>() < 0.03 {
                    0.3 * uniform.random::<f64>()
                } else {
                    0.0
                };
                range + 0.003 * normal() - outlier
            });
            // Just before the reading, so that it lies between two of them.
            recording.pings.push(Ping { time: time - 1e-6, bearing, range });
        }
        legs += 1;
    }
    recording
}

/// The nearest of the walls and corners within 18° of the axis answers, with a soft rim.
fn echo(robot: &Robot, pose: &Vector3<f64>, bearing: f64, chance: f64) -> Option<f64> {
    let (sin, cos) = pose.z.sin_cos();
    let [ahead, left] = robot.mount;
    let at = [pose.x + cos * ahead - sin * left, pose.y + sin * ahead + cos * left];
    let direction = pose.z + bearing + robot.bearing;
    let feet =
        [(-FRAC_PI_2, at[1]), (0.0, ROOM[0] - at[0]), (FRAC_PI_2, ROOM[1] - at[1]), (PI, at[0])];
    let corners = [[0.0, 0.0], [ROOM[0], 0.0], ROOM, [0.0, ROOM[1]]].map(|[x, y]| {
        let (ahead, left) = (x - at[0], y - at[1]);
        (left.atan2(ahead), ahead.hypot(left))
    });
    let heard = feet.into_iter().chain(corners).filter(|(towards, distance)| {
        let off = (direction - towards + PI).rem_euclid(2.0 * PI) - PI;
        *distance < 3.5 && chance < 0.98 / (1.0 + ((off.abs() - 0.31) / 0.026).exp())
    });
    let nearest = heard.map(|(_, distance)| distance).min_by(f64::total_cmp)?;
    Some(nearest * (1.0 + robot.range))
}

/// Error and standard deviation of each constant of the robot.
fn errors(found: &Calibration, robot: &Robot) -> Vec<(Name, f64, f64)> {
    let truths = [
        (Name::Right, robot.wheels[0]),
        (Name::Left, robot.wheels[1]),
        (Name::Track, robot.track),
        (Name::RangeScale, robot.range),
        (Name::MountAhead, robot.mount[0]),
        (Name::MountLeft, robot.mount[1]),
    ];
    let of = |(name, truth): (Name, f64)| {
        let estimate = found.estimates.iter().find(|estimate| estimate.name == name).unwrap();
        (name, estimate.value - truth, estimate.deviation)
    };
    truths.map(of).to_vec()
}

#[test]
fn intervals_contain_the_truth() {
    const SEEDS: u64 = 10;
    let (mut inside, mut all) = (0, 0);
    for seed in 0..SEEDS {
        let found = calibrate(&record(&ROBOT, 16.0, seed), &walls(), &NOMINAL).unwrap();
        for (name, error, deviation) in errors(&found, &ROBOT) {
            all += 1;
            inside += u32::from(error.abs() <= 1.96 * deviation);
            assert!(error.abs() <= 4.5 * deviation, "seed {seed}, {name:?}: {error} ± {deviation}");
        }
        let wheel = found.wheel_noise.wheel;
        let error = (wheel.value / WHEEL_NOISE).ln();
        assert!(error.abs() <= 4.5 * wheel.deviation, "seed {seed}: {wheel:?}");
        assert!(wheel.deviation < 0.25, "seed {seed}: {wheel:?}");
        let bearings = found.bearings.unwrap();
        assert!(
            (bearings.offset - ROBOT.bearing).abs() < 4.0 * bearings.offset_deviation + 2e-3,
            "{bearings:?}"
        );
    }
    // 95 % of 60, less three deviations of a binomial variable.
    assert!(inside >= 51, "{inside} of {all}");
}

#[test]
fn echoes_of_corners_are_used() {
    let found = calibrate(&record(&ROBOT, 16.0, 0), &walls(), &NOMINAL).unwrap();
    // The reflectors are the walls, then the corners. 3 % of the echoes are outliers.
    let of_corners = found.residuals.iter().filter(|residual| residual.reflector >= walls().len());
    assert!(of_corners.count() > found.residuals.len() / 10);
    assert!(found.inliers * 10 > found.expected * 9, "{} of {}", found.inliers, found.expected);
}

/// Wheels that differ by up to 20 %, and a horn that is fitted 9° aside.
/// Of the pings within the cone 2 % have no echo, and 3 % of the echoes are too short.
#[test]
fn shares_and_kind_of_the_echoes_are_found() {
    for seed in 0..4 {
        let found = calibrate(&record(&ROBOT, 30.0, seed), &walls(), &NOMINAL).unwrap();
        let square = found.echoes.square.unwrap();
        for (share, truth) in [(square.missed, 0.02), (square.short, 0.03), (square.long, 0.0)] {
            let error = (share.value - truth).abs();
            assert!(error < 4.0 * share.deviation && share.deviation < 0.02, "{square:?}");
        }
        let oblique = found.echoes.oblique.unwrap();
        assert_eq!(oblique.source(), Some(Source::Perpendicular), "{oblique:?}");
        let bearings = found.bearings.unwrap();
        let error = (bearings.half_cone - 0.31).abs();
        assert!(error < 4.0 * bearings.cone_deviation && error < 0.02, "{bearings:?}");
    }
}

#[test]
fn wheels_ten_per_cent_wrong_are_found() {
    let signs = [[0.1, 0.1], [-0.1, -0.1], [0.1, -0.1], [-0.1, 0.1]];
    for (seed, wheels) in (0..).zip(signs.into_iter().cycle().take(8)) {
        let robot = Robot { wheels, bearing: -0.157, ..ROBOT };
        let found = calibrate(&record(&robot, 20.0, seed), &walls(), &NOMINAL)
            .unwrap_or_else(|error| panic!("{seed} {wheels:?}: {error}"));
        for (name, error, deviation) in errors(&found, &robot) {
            assert!(error.abs() <= 5.0 * deviation, "{wheels:?} {name:?}: {error} ± {deviation}");
        }
    }
}

#[test]
fn one_circle_does_not_separate_wheels_and_track_width() {
    let robot = Robot { turns_both_ways: false, ..ROBOT };
    let mut recording = record(&robot, 8.0, 5);
    // The legs' travel is spread over the turns: a polygon becomes a circle, and ranges no longer belong to it. Only the
    // poses of a reference remain.
    recording.pings.clear();
    recording.readings.clear();
    let (mut pose, mut travel) = (Vector3::new(0.0, 0.0, 0.0), [0.0, 0.0]);
    for n in 0..900_u32 {
        let time = 0.1 * f64::from(n);
        recording.readings.push(Reading { time, travel });
        recording.references.push(ReferencePose { time, pose });
        let (advance, turn) = (0.01, 0.02);
        let middle = pose.z + 0.5 * turn;
        pose += Vector3::new(advance * middle.cos(), advance * middle.sin(), turn);
        let arc = 0.5 * turn * WIDTH * (1.0 + robot.track);
        travel[0] += (advance + arc) / (1.0 + robot.wheels[0]);
        travel[1] += (advance - arc) / (1.0 + robot.wheels[1]);
    }
    recording.start = None;
    let found = calibrate(&recording, &[], &NOMINAL).unwrap();
    for estimate in &found.estimates {
        let is_paired = matches!(estimate.name, Name::Right | Name::Left | Name::Track);
        assert_eq!(estimate.determined == Determined::Jointly, is_paired, "{estimate:?}");
    }
}

#[test]
fn a_wrong_start_is_corrected_or_refused() {
    for (seed, by) in [(6, [0.6, 0.3, 0.8]), (7, [0.0, 0.0, PI]), (8, [-0.4, 0.2, 0.3])] {
        let mut recording = record(&ROBOT, 12.0, seed);
        recording.start.as_mut().unwrap().pose += Vector3::from(by);
        let Ok(found) = calibrate(&recording, &walls(), &NOMINAL) else { continue };
        for (name, error, deviation) in errors(&found, &ROBOT) {
            assert!(error.abs() <= 5.0 * deviation, "{by:?} {name:?}: {error} ± {deviation}");
        }
    }
}

/// Two of four walls are wrong by 0.6 and 0.9 m: the other two still determine the robot, less exactly.
#[test]
fn a_wrong_map_does_not_mislead() {
    let other = [
        Wall::new([0.0, 0.0], [3.1, 0.0]).unwrap(),
        Wall::new([3.1, 0.0], [3.1, 2.9]).unwrap(),
        Wall::new([3.1, 2.9], [0.0, 2.9]).unwrap(),
        Wall::new([0.0, 2.9], [0.0, 0.0]).unwrap(),
    ];
    if let Ok(found) = calibrate(&record(&ROBOT, 12.0, 6), &other, &NOMINAL) {
        for (name, error, deviation) in errors(&found, &ROBOT) {
            assert!(error.abs() <= 5.0 * deviation, "{name:?}: {error} ± {deviation}");
        }
    }
}

/// A map of two short walls in a corner contradicts no echo, and explains hardly any.
#[test]
fn a_path_beside_the_map_is_refused() {
    let corner =
        [Wall::new([0.0, 0.0], [1.0, 0.0]).unwrap(), Wall::new([0.0, 1.0], [0.0, 0.0]).unwrap()];
    let exact = Robot {
        wheels: [0.0; 2],
        track: 0.0,
        range: 0.0,
        mount: NOMINAL.mount,
        bearing: 0.0,
        ..ROBOT
    };
    let refused = calibrate(&record(&exact, 12.0, 6), &corner, &NOMINAL);
    assert!(matches!(refused, Err(CalibrateError::Unexplained { .. })), "{refused:?}");
}

/// A calibration of a recording without its start, in a room.
fn without_start(recording: Recording, walls: &[Wall]) -> Result<Calibration, CalibrateError> {
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    let point = |[x, y]: [f64; 2]| Point::new(x as f32, y as f32);
    let map: Vec<sonarfix::map::Wall> = walls
        .iter()
        .map(|wall| {
            let [from, to] = wall.ends().map(point);
            sonarfix::map::Wall::new(from, to).unwrap()
        })
        .collect();
    // The robot of the scenario has the dimensions of `NOMINAL`.
    let robot = Scenario::parse(CLASSROOM, "classroom.toml", Path::new("")).unwrap().robot;
    let recording = Recording { start: None, ..recording };
    calibrate_from_search(&recording, walls, &NOMINAL, &Find { robot: &robot, walls: &map })
}

/// The room is the same turned by 180°: either pose has the same constants.
#[test]
fn a_recording_without_a_start_begins_where_the_search_finds_the_pose() {
    for bearing in [0.0, 0.157] {
        let robot = Robot { bearing, ..ROBOT };
        let found = without_start(record(&robot, 24.0, 8), &walls()).unwrap();
        for (name, error, deviation) in errors(&found, &robot) {
            assert!(error.abs() <= 4.5 * deviation, "{name:?}: {error} ± {deviation}");
        }
        let offset = found.bearings.unwrap().offset;
        assert!((offset - bearing).abs() < 0.01, "{bearing}: {offset}");
        assert!(found.trajectory[0].0 > 10.0, "the search takes its time");
    }
}

/// Rooms of other sizes have the same corners: the search finds one that fits, and its walls determine the constants.
#[test]
fn another_room_does_not_mislead_a_calibration_from_the_search() {
    for (seed, size) in (8..).zip([[8.0, 7.0], [5.0, 3.5], [4.0, 3.0]]) {
        if let Ok(found) = without_start(record(&ROBOT, 16.0, seed), &room(size)) {
            for (name, error, deviation) in errors(&found, &ROBOT) {
                assert!(error.abs() <= 5.0 * deviation, "{size:?} {name:?}: {error} ± {deviation}");
            }
        }
    }
}

#[test]
fn a_recording_without_a_start_that_is_too_short_for_the_search_has_no_pose() {
    let refused = |recording| without_start(recording, &walls()).map(|found| found.distance);
    let mut short = record(&ROBOT, 4.0, 7);
    short.cut(0.2);
    assert_eq!(refused(short.clone()), Err(CalibrateError::NoPose));
    short.pings.clear();
    assert_eq!(refused(short), Err(CalibrateError::NothingMeasured));
}

#[test]
fn unusable_recordings_have_typed_errors() {
    let recording = record(&ROBOT, 4.0, 7);
    let result = |change: fn(&mut Recording)| {
        let mut changed = recording.clone();
        change(&mut changed);
        calibrate(&changed, &walls(), &NOMINAL).err()
    };
    assert_eq!(
        result(|r| r.start = None),
        Some(CalibrateError::Recording(RecordingError::NoStart))
    );
    assert_eq!(
        result(|r| r.readings.truncate(1)),
        Some(CalibrateError::Recording(RecordingError::NoTravel))
    );
    assert_eq!(result(|r| r.pings.clear()), Some(CalibrateError::NothingMeasured));
    assert!(matches!(result(|r| r.readings.truncate(100)), Some(CalibrateError::TooShort(_))));
    assert!(matches!(
        result(|r| r.readings[3].travel[0] = f64::NAN),
        Some(CalibrateError::Recording(RecordingError::NotFinite(_)))
    ));
    assert!(matches!(
        result(|r| r.readings[3].time = 0.0),
        Some(CalibrateError::Recording(RecordingError::TimeWentBack(_)))
    ));
}
