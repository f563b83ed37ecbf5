//! The localizer with other rangers than one sonar: with a ranger of light, and with two sonars.
#![no_std]
#![no_main]

use emulated_board::meter::{Cost, Meter};
use emulated_board::report;
use emulated_probe::{Robot, STEPS, STEPS_A_RANGE, end, room, travel};
use sonarfix::aim::Standing;
use sonarfix::config::{Config, LightBeam, RangerId, Ranging};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Instant, Metres};
use sonarfix::localizer::Localizer;

/// No input: the localizer chooses the aim.
#[unsafe(no_mangle)]
extern "C" fn probe_light_aim(robot: &mut Robot, _: &()) {
    robot.aim = robot.localizer.aim().ok();
}

/// Of both rangers, of which the one with the higher score pings.
#[unsafe(no_mangle)]
extern "C" fn probe_pair_aim(robot: &mut Robot, _: &()) {
    let standing = Standing { bearing: None, ready_in: Duration::from_ticks(0) };
    let policy = robot.localizer.config().policy;
    let [one, other] =
        [RangerId(0), RangerId(1)].map(|ranger| robot.localizer.aim_of(ranger, &standing).ok());
    let is_better = |is: f32, than: f32| is > than;
    robot.aim = match (one, other) {
        (Some(one), Some(other)) if is_better(other.score(policy), one.score(policy)) => {
            Some(other)
        }
        (one, other) => one.or(other),
    };
}

#[unsafe(no_mangle)]
extern "C" fn probe_light_fix(robot: &mut Robot, range: &Metres) {
    fix(robot, *range);
}

#[unsafe(no_mangle)]
extern "C" fn probe_pair_fix(robot: &mut Robot, range: &Metres) {
    fix(robot, *range);
}

fn fix(robot: &mut Robot, range: Metres) {
    if let Some(aim) = robot.aim {
        let fix = robot.localizer.fix(&aim, Some(range));
        robot.all_well &= fix.innovation_used().is_some();
    }
}

#[emulated_board::entry]
fn main() -> ! {
    end(drives())
}

type Aim = extern "C" fn(&mut Robot, &());
type Fix = extern "C" fn(&mut Robot, &Metres);

fn drives() -> Option<bool> {
    let mut light = Config::for_track_width(Metres(0.16));
    light.rangers.first.ranging = Ranging::Light(LightBeam::VL53L1X);
    let (with_light, [aim, fix]) = drive(&light, probe_light_aim, probe_light_fix)?;
    report::cost(c"light_aim", &aim);
    report::cost(c"light_fix", &fix);

    let mut pair = Config::for_track_width(Metres(0.16));
    let mut second = pair.rangers.first;
    second.mount = Point::new(0.05, 0.08);
    pair.rangers.push(second).ok()?;
    let (with_pair, [aim, fix]) = drive(&pair, probe_pair_aim, probe_pair_fix)?;
    report::cost(c"pair_aim", &aim);
    report::cost(c"pair_fix", &fix);
    report::line(c"object", u32::try_from(size_of::<Localizer>()).unwrap_or(u32::MAX));
    Some(with_light && with_pair)
}

/// Whether nothing was refused, and the costs of aim and fix.
fn drive(config: &Config, aim: Aim, fix: Fix) -> Option<(bool, [Cost; 2])> {
    let walls = room().ok()?;
    let mut robot = Robot::new(*config, &walls).ok()?;
    let mut meter = Meter::start();
    let [mut aims, mut fixes] = [Cost::default(); 2];
    for step in 0..STEPS {
        let now = Instant::from_ticks(u64::from(step + 1) * 100_000);
        robot.all_well &= robot.localizer.odometry(now, travel(step)).is_ok();
        if !(step + 1).is_multiple_of(STEPS_A_RANGE) {
            continue;
        }
        meter.measure(&mut aims, aim, &mut robot, &());
        let range = robot.aim?.range + Metres(0.004);
        meter.measure(&mut fixes, fix, &mut robot, &range);
    }
    Some((robot.all_well, [aims, fixes]))
}
