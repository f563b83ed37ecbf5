//! The localizer of a robot with a gyro: odometry with a turn, fix.
#![no_std]
#![no_main]

use emulated_board::meter::{Cost, Meter};
use emulated_board::report;
use emulated_probe::{STEPS, STEPS_A_RANGE, room, travel};
use sonarfix::aim::Aim;
use sonarfix::config::Config;
use sonarfix::gyro::{GyroParameters, MeasuredTurn, TurnIntegral};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::Map;
use sonarfix::motion::WheelTravel;
use sonarfix::pose::Pose;
use sonarfix::units::{Duration, Instant, Metres, Radians};

const TRACK_WIDTH: f32 = 0.16;

/// The localizer, and the result of the last call.
struct Robot<'a> {
    localizer: Localizer<'a>,
    all_well: bool,
    aim: Option<Aim>,
}

/// Travel of the wheels and turn of the gyro up to a time.
struct Roll {
    now: Instant,
    travel: WheelTravel,
    turn: MeasuredTurn,
}

#[unsafe(no_mangle)]
extern "C" fn probe_turn(robot: &mut Robot, roll: &Roll) {
    let Roll { now, travel, turn } = *roll;
    robot.all_well &= robot.localizer.odometry_with_turn(now, travel, Some(turn)).is_ok();
}

#[unsafe(no_mangle)]
extern "C" fn probe_turn_fix(robot: &mut Robot, range: &Metres) {
    if let Some(aim) = robot.aim {
        // A range may be gated here; that costs less.
        let _ = robot.localizer.fix(&aim, Some(*range));
    }
}

#[emulated_board::entry]
fn main() -> ! {
    match drive() {
        Some(true) => report::done(),
        _ => report::fail(c"the localizer refused something"),
    }
}

fn drive() -> Option<bool> {
    let walls = room().ok()?;
    let mut config = Config::for_track_width(Metres(TRACK_WIDTH));
    config.gyro = Some(GyroParameters::MPU_6050);
    config.prior.range_scale = 0.01;
    let start = Start {
        pose: Pose::new(1.2, 1.1, Radians(0.1)),
        position_deviation: Metres(0.05),
        heading_deviation: Radians(0.02),
    };
    let localizer = Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(0)).ok()?;
    let mut robot = Robot { localizer, all_well: true, aim: None };

    let mut meter = Meter::start();
    let [mut turns, mut fixes] = [Cost::default(); 2];
    for step in 0..STEPS {
        let now = Instant::from_ticks(u64::from(step + 1) * 100_000);
        let travel = travel(step);
        // A bias of 0.01 rad/s.
        let angle = Radians((travel.right.0 - travel.left.0) / TRACK_WIDTH + 0.001);
        let turn = MeasuredTurn { angle, duration: Duration::from_ticks(100_000) };
        let roll = Roll { now, travel, turn };
        meter.measure(&mut turns, probe_turn, &mut robot, &roll);
        if !(step + 1).is_multiple_of(STEPS_A_RANGE) {
            continue;
        }
        robot.aim = robot.localizer.aim().ok();
        let range = robot.aim?.range + Metres(0.004);
        meter.measure(&mut fixes, probe_turn_fix, &mut robot, &range);
    }
    report::cost(c"turn", &turns);
    report::cost(c"turn_fix", &fixes);
    report::line(c"object", u32::try_from(size_of::<TurnIntegral>()).unwrap_or(u32::MAX));
    Some(robot.all_well)
}
