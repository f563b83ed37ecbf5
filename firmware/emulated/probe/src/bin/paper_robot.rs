//! The robot of the example `paper_robot`: filter, nearest wall, gate.
#![no_std]
#![no_main]

#[path = "../../../../../crates/sonarfix/examples/paper_robot/robot.rs"]
mod robot;

use core::hint::black_box;

use emulated_board::meter::{Cost, Meter};
use emulated_board::report;
use emulated_probe::{STEPS, STEPS_A_RANGE, end, room, travel};
use robot::{PaperRobot, Target};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, Radians};

/// The robot, its target, and whether it has refused nothing.
struct Probed<'m> {
    robot: PaperRobot<'m>,
    target: Option<Target<'m>>,
    all_well: bool,
}

#[unsafe(no_mangle)]
extern "C" fn probe_odometry(probed: &mut Probed, travel: &WheelTravel) {
    probed.all_well &= probed.robot.odometry(*travel).is_ok();
}

#[unsafe(no_mangle)]
extern "C" fn probe_aim(probed: &mut Probed, _: &()) {
    probed.target = probed.robot.aim();
    // A robot turns its sonar there.
    black_box(probed.target.as_ref().map(|target| target.bearing));
}

#[unsafe(no_mangle)]
extern "C" fn probe_fix(probed: &mut Probed, range: &Metres) {
    if let Some(target) = &probed.target {
        probed.all_well &= probed.robot.fix(target, *range).is_ok();
    }
}

#[emulated_board::entry]
fn main() -> ! {
    end(drive())
}

fn drive() -> Option<bool> {
    let walls = room().ok()?;
    let start = Pose::new(1.2, 1.1, Radians(0.1));
    let robot = PaperRobot::new(start, Metres(0.16), &walls).ok()?;
    let mut probed = Probed { robot, target: None, all_well: true };
    let mut meter = Meter::start();
    let [mut odometry, mut aims, mut fixes] = [Cost::default(); 3];
    for step in 0..STEPS {
        meter.measure(&mut odometry, probe_odometry, &mut probed, &travel(step));
        if !(step + 1).is_multiple_of(STEPS_A_RANGE) {
            continue;
        }
        meter.measure(&mut aims, probe_aim, &mut probed, &());
        meter.measure(&mut fixes, probe_fix, &mut probed, &Metres(1.1));
    }
    report::cost(c"odometry", &odometry);
    report::cost(c"aim", &aims);
    report::cost(c"fix", &fixes);
    report::line(c"object", u32::try_from(size_of::<PaperRobot>()).unwrap_or(u32::MAX));
    Some(probed.all_well && probed.robot.state().x.is_finite())
}
