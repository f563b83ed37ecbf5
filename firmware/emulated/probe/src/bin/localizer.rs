//! The whole localizer: odometry, aim, fix.
#![no_std]
#![no_main]

use core::hint::black_box;

use emulated_board::meter::{Cost, Meter};
use emulated_board::report;
use emulated_probe::{Robot, STEPS, STEPS_A_RANGE, end, room, travel};
use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::Localizer;

/// Travel of the wheels up to a time.
struct Roll {
    now: Instant,
    travel: WheelTravel,
}

#[unsafe(no_mangle)]
extern "C" fn probe_odometry(robot: &mut Robot, roll: &Roll) {
    robot.all_well &= robot.localizer.odometry(roll.now, roll.travel).is_ok();
}

/// No input: the localizer chooses the aim.
#[unsafe(no_mangle)]
extern "C" fn probe_aim(robot: &mut Robot, _: &()) {
    robot.aim = robot.localizer.aim().ok();
}

#[unsafe(no_mangle)]
extern "C" fn probe_fix(robot: &mut Robot, range: &Metres) {
    if let Some(aim) = robot.aim {
        let fix = robot.localizer.fix(&aim, Some(*range));
        robot.all_well &= fix.innovation_used().is_some();
    }
}

#[emulated_board::entry]
fn main() -> ! {
    end(drive())
}

fn drive() -> Option<bool> {
    let walls = room().ok()?;
    let config = Config::for_track_width(Metres(0.16));
    let mut robot = Robot::new(config, &walls).ok()?;

    let mut meter = Meter::start();
    let [mut odometry, mut aims, mut fixes] = [Cost::default(); 3];
    for step in 0..STEPS {
        let now = Instant::from_ticks(u64::from(step + 1) * 100_000);
        let roll = Roll { now, travel: travel(step) };
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
    report::line(c"object", u32::try_from(size_of::<Localizer>()).unwrap_or(u32::MAX));
    link_the_rest(&mut robot.localizer);
    Some(robot.all_well)
}

/// Calls the other functions that a robot uses, so that they are linked and searched for panics; not measured.
fn link_the_rest(localizer: &mut Localizer) {
    let _ = black_box(localizer.aim_at(Radians(black_box(0.5))));
    localizer.skip();
    black_box(localizer.health());
    black_box(localizer.pose());
    black_box(localizer.time());
    black_box(localizer.config());
    black_box(localizer.map().count());
    let _ = black_box(localizer.config().check());
    black_box(localizer.filter().state_vector());
    black_box(localizer.filter().covariance());
    black_box(localizer.filter().standard_deviations());
}
