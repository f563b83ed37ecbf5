//! The localizer as a robot uses it, with the parts that the features of this package choose. The configuration is read from
//! memory, so that the compiler does not know which of the linked parts the robot has.
#![no_std]
#![no_main]

#[cfg(feature = "drive")]
mod driving;
#[cfg(feature = "search")]
mod searching;

use core::hint::black_box;

use emulated_board::meter::{Cost, Meter};
use emulated_board::report;
use emulated_probe::{Robot, STEPS, STEPS_A_RANGE, end, room, travel};
use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start, StartError};
use sonarfix::map::{Map, MapError};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::MeasuredTurn;

/// A step of the odometry.
struct Step {
    now: Instant,
    travel: WheelTravel,
    turn: Option<MeasuredTurn>,
}

/// What a localizer starts with.
struct Stored<'m> {
    config: Config,
    image: &'m [u8],
    start: Start,
}

#[unsafe(no_mangle)]
extern "C" fn probe_odometry(robot: &mut Robot, step: &Step) {
    robot.all_well &= robot.localizer.odometry_with_turn(step.now, step.travel, step.turn).is_ok();
}

/// No input: the localizer chooses the aim.
#[unsafe(no_mangle)]
extern "C" fn probe_aim(robot: &mut Robot, _: &()) {
    robot.aim = robot.localizer.aim().ok();
    if robot.aim.is_none() {
        robot.localizer.skip();
    }
}

#[unsafe(no_mangle)]
extern "C" fn probe_fix(robot: &mut Robot, range: &Metres) {
    if let Some(aim) = robot.aim {
        let fix = robot.localizer.fix(&aim, Some(*range));
        robot.all_well &= fix.innovation_used().is_some();
    }
}

/// Linked and not measured: a start from the configuration and the map in flash.
#[unsafe(no_mangle)]
extern "C" fn probe_start<'m>(robot: &mut Robot<'m>, stored: &Stored<'m>) {
    let localizer = start(stored);
    robot.all_well &= localizer.is_ok();
    if let Ok(Ok(localizer)) = localizer {
        robot.localizer = localizer;
    }
}

fn start<'m>(stored: &Stored<'m>) -> Result<Result<Localizer<'m>, StartError>, MapError> {
    let map = Map::read(stored.image)?;
    Ok(Localizer::new(stored.config, map, stored.start, Instant::from_ticks(0)))
}

/// Linked and not measured: what a robot does now and then.
#[unsafe(no_mangle)]
extern "C" fn probe_rest(robot: &mut Robot, measurement: &AbsoluteMeasurement) {
    let localizer = &mut robot.localizer;
    let now = localizer.time();
    let _ = black_box(localizer.absolute(now, measurement));
    localizer.odometry_missing(now);
    let start = Start {
        pose: localizer.pose(),
        position_deviation: Metres(0.1),
        heading_deviation: Radians(0.1),
    };
    robot.all_well &= localizer.set_pose(&start).is_ok();
    black_box(localizer.health());
    black_box(localizer.filter().standard_deviations());
    black_box(localizer.gyro());
}

#[emulated_board::entry]
fn main() -> ! {
    end(drive())
}

fn drive() -> Option<bool> {
    let walls = room().ok()?;
    let config = black_box(Config::for_track_width(Metres(0.16)));
    let mut robot = Robot::new(config, &walls).ok()?;

    let mut meter = Meter::start();
    let [mut odometry, mut aims, mut fixes] = [Cost::default(); 3];
    for step in 0..STEPS {
        let now = Instant::from_ticks(u64::from(step + 1) * 100_000);
        let roll = Step { now, travel: travel(step), turn: None };
        meter.measure(&mut odometry, probe_odometry, &mut robot, &roll);
        if !(step + 1).is_multiple_of(STEPS_A_RANGE) {
            continue;
        }
        meter.measure(&mut aims, probe_aim, &mut robot, &());
        let range = robot.aim?.range + Metres(0.004);
        meter.measure(&mut fixes, probe_fix, &mut robot, &range);
    }
    report::cost(c"odometry", &odometry);
    report::cost(c"aim", &aims);
    report::cost(c"fix", &fixes);
    let well = robot.all_well;
    link_the_rest(&mut robot, &config);
    #[cfg(feature = "search")]
    searching::link(robot.localizer.clone(), &config);
    #[cfg(feature = "drive")]
    driving::link(&robot.localizer);
    let bytes = size_of::<Localizer>();
    #[cfg(feature = "search")]
    let bytes = bytes + searching::BYTES;
    #[cfg(feature = "drive")]
    let bytes = bytes + driving::BYTES;
    report::line(c"object", u32::try_from(bytes).unwrap_or(u32::MAX));
    Some(well)
}

fn link_the_rest(robot: &mut Robot, config: &Config) {
    let start = Start {
        pose: Pose::new(1.2, 1.1, Radians(0.1)),
        position_deviation: Metres(0.05),
        heading_deviation: Radians(0.02),
    };
    probe_start(robot, &black_box(Stored { config: *config, image: &[], start }));
    let turn = MeasuredTurn { angle: Radians(0.0), duration: Duration::from_ticks(100_000) };
    let now = robot.localizer.time() + Duration::from_ticks(100_000);
    let step = Step { now, travel: WheelTravel::new(0.0, 0.0), turn: black_box(Some(turn)) };
    probe_odometry(robot, &step);
    let heading = AbsoluteMeasurement::Heading { angle: Radians(0.1), deviation: Radians(0.1) };
    probe_rest(robot, &black_box(heading));
}
