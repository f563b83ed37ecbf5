//! Random sequences of commands, power cuts, damaged bytes and device failures: after each, with
//! healthy devices, the robot can be given a pose and started, and it tracks.
//!
//! `SONARFIX_SEQUENCES=1000000 cargo test --release --package sonarfix-app --test app random_sequences`
//! runs a million; without the variable it is four thousand. A failure names the seed of its sequence,
//! which `SONARFIX_SEED` runs alone.

use sonarfix::config::PingSchedule;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::Start;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::Command;
use sonarfix_link::message::CommandResult;

use crate::attacks::is_within_prior;
use crate::flash::{Random, SimFlash};
use crate::rig::{Baked, Bench, config, start};
use crate::room::Truth;

/// Sequences without the variable.
const SEQUENCES: u64 = 4_000;

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|text| text.parse().expect("a whole number"))
}

/// An arbitrary number, often a usual one.
fn any_number(random: &mut Random) -> f32 {
    match random.below(8) {
        0 => f32::from_bits(random.next() as u32),
        1 => 0.0,
        2 => -1.0,
        3 => f32::NAN,
        4 => 1e7,
        _ => 0.01 * random.below(100) as f32,
    }
}

fn any_pose(random: &mut Random) -> Start {
    let (x, y) = (any_number(random), any_number(random));
    Start {
        pose: Pose::new(x, y, Radians(any_number(random))),
        position_deviation: Metres(any_number(random)),
        heading_deviation: Radians(any_number(random)),
    }
}

fn any_config(random: &mut Random) -> RobotConfig {
    let mut any = config();
    let localizer = &mut any.localizer;
    for _ in 0..random.below(3) {
        let number = any_number(random);
        match random.below(8) {
            0 => localizer.drive.track_width = Metres(number),
            1 => localizer.prior.range_scale = number,
            2 => localizer.prior.track_width = Metres(number),
            3 => (localizer.prior.scale_left, localizer.prior.scale_right) = (number, number),
            4 => localizer.max_wheel_speed.0 = number,
            5 => localizer.rangers.first.servo = (Radians(-number), Radians(number)),
            6 => {
                any.encoder_period =
                    sonarfix::geometry::units::Duration::from_ticks(random.next() % 200_000);
            }
            _ => any.right_wheel.travel_per_edge = Metres(number),
        }
    }
    any
}

fn any_command(random: &mut Random) -> Command {
    match random.below(8) {
        0 | 1 => Command::SetPose(start()),
        2 => Command::SetPose(any_pose(random)),
        3 => Command::SetConfiguration(any_config(random)),
        4 | 5 => Command::Start,
        6 => Command::Stop,
        _ => Command::ResetCalibration,
    }
}

/// Lets time pass in uneven steps, while the wheels roll or not.
fn pass(bench: &mut Bench, random: &mut Random) {
    let rolls = i16::try_from(random.below(3)).unwrap();
    for _ in 0..random.below(60) {
        bench.now += 1_000 * random.below(12) as u64;
        bench.roll(rolls, rolls);
        let _ = bench.poll();
    }
}

fn break_devices(bench: &mut Bench, random: &mut Random) {
    let mut is_there = || random.below(3) > 0;
    let [right, left] = bench.counted;
    bench.hardware.right.0 = is_there().then_some(right);
    bench.hardware.left.0 = is_there().then_some(left);
    bench.hardware.ranger.is_there = is_there();
    let servo_is_there = is_there();
    bench.servo_is_there.set(servo_is_there);
}

/// A power cycle, perhaps during a write.
fn cycle<'m>(mut bench: Bench<'m>, baked: &'m Baked, random: &mut Random) -> Bench<'m> {
    if random.below(2) == 0 {
        bench.app.store_mut().flash_mut().cut_after(random.below(120), random.next());
        for _ in 0..3 {
            bench.send(&any_command(random));
            let _ = bench.poll();
        }
    }
    let mut flash = bench.switched_off();
    flash.power_up();
    if random.below(8) == 0 {
        flash.damage(random.below(4_096), random.next() as u8);
    }
    if random.below(4) == 0 {
        // Another one while the store is repaired.
        flash.cut_after(random.below(60), random.next());
        flash = Bench::switched_on(baked, flash).switched_off();
        flash.power_up();
    }
    Bench::switched_on(baked, flash)
}

fn sequence(baked: &Baked, seed: u64) {
    let mut random = Random::new(seed);
    let mut bench = Bench::switched_on(baked, SimFlash::new());
    for _ in 0..random.below(40) {
        match random.below(10) {
            0..4 => bench.send(&any_command(&mut random)),
            4 => {
                let garbage = (0..random.below(300)).map(|_| random.next() as u8);
                bench.garble(&garbage.collect::<Vec<_>>());
            }
            5 => break_devices(&mut bench, &mut random),
            6 => bench = cycle(bench, baked, &mut random),
            _ => {}
        }
        pass(&mut bench, &mut random);
        if let Some(localizer) = bench.app.localizer() {
            let deviation = localizer.filter().standard_deviations();
            let prior = localizer.config().prior;
            assert!(is_within_prior(&deviation, &prior), "seed {seed}: {deviation:?}");
        }
    }
    bench.mend();
    bench.drain();
    if random.below(2) == 0 {
        bench = cycle(bench, baked, &mut random);
        bench.drain();
    } else {
        let _ = bench.order(&Command::Stop);
    }
    bench.truth = Some(Truth::at(&start()));
    for command in [Command::SetPose(start()), Command::Start] {
        assert_eq!(bench.order(&command), CommandResult::Done, "seed {seed}: {command:?}");
    }
    let on_time = (0..600).filter(|_| bench.poll().is_on_time).count();
    assert!(on_time >= 1, "seed {seed}: no tick");
    assert_eq!(bench.estimate().health.verdict, Verdict::Tracking, "seed {seed}");
    assert!(bench.poll().may_drive, "seed {seed}");
    // Its configuration may be that of a robot with other wheels.
    for command in [Command::SetConfiguration(tracking()), Command::SetPose(start())] {
        assert_eq!(bench.order(&command), CommandResult::Done, "seed {seed}: {command:?}");
    }
    tracks(&mut bench, seed);
}

/// The configuration of the robot in the room, which pings as fast as it can.
fn tracking() -> RobotConfig {
    let mut config = config();
    config.localizer.rangers.first.timing.schedule = PingSchedule::AsFastAsPossible;
    config
}

/// Drives a curve of half a metre in 3 s with a poll each 5 ms: the estimate follows, with ranges, and all deviations are
/// within their priors.
fn tracks(bench: &mut Bench, seed: u64) {
    let (mut ticks, mut most) = (0, 0);
    for poll in 0..600 {
        bench.now += 4_000;
        bench.roll(4, 4 + i16::from(poll % 5 == 0));
        let polled = bench.poll();
        ticks += u32::from(polled.is_on_time);
        assert!(polled.may_drive, "seed {seed}, poll {poll}");
        most = most.max(bench.estimate().health.accepted_in_a_row);
    }
    let localizer = bench.app.localizer().expect("it runs");
    let (health, filter) = (localizer.health(), localizer.filter());
    assert!(ticks >= 5 && most >= 2, "seed {seed}: {ticks} ticks, {most} ranges");
    assert_eq!(health.verdict, Verdict::Tracking, "seed {seed}: {health:?}");
    let (error, deviation) = (bench.error(), filter.standard_deviations());
    assert!(error < 0.05, "seed {seed}: {error} m, {deviation:?}");
    let prior = localizer.config().prior;
    assert!(is_within_prior(&deviation, &prior), "seed {seed}: {deviation:?}");
}

#[test]
fn random_sequences() {
    let baked = Baked::new(&config());
    if let Some(seed) = number("SONARFIX_SEED") {
        return sequence(&baked, seed);
    }
    let count = number("SONARFIX_SEQUENCES").unwrap_or(SEQUENCES);
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get() as u64);
    std::thread::scope(|scope| {
        for thread in 0..threads {
            let baked = &baked;
            scope.spawn(move || {
                (thread..count).step_by(threads as usize).for_each(|seed| sequence(baked, seed));
            });
        }
    });
    println!("{count} sequences");
}
