//! The localizer of a robot with a gyro: odometry with a turn, fix.
#![no_std]
#![no_main]

use emulated_board::meter::{Cost, Meter};
use emulated_board::report;
use emulated_probe::{Robot, STEPS, STEPS_A_RANGE, end, room, travel};
use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::sensor::gyro::{GyroParameters, MeasuredTurn, TurnIntegral};

const TRACK_WIDTH: f32 = 0.16;

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
    end(drive())
}

fn drive() -> Option<bool> {
    let walls = room().ok()?;
    let mut config = Config::for_track_width(Metres(TRACK_WIDTH));
    config.gyro = Some(GyroParameters::MPU_6050);
    let mut robot = Robot::new(config, &walls).ok()?;

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
