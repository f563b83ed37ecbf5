//! The loop under load: garbage and commands at the rate of the line, dead devices, and the wear of the flash in a day.
//! `SONARFIX_SECONDS=3600` makes the first three of them an hour long instead of a minute.

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::Radians;
use sonarfix::health::Verdict;
use sonarfix::localizer::{Fix, Start};
use sonarfix_link::message::CommandResult;
use sonarfix_link::{Command, Ping, Telemetry};

use crate::flash::{Random, SECTOR, SECTORS, SimFlash};
use crate::rig::{Baked, Bench, config, loop_status, start};
use crate::room::Truth;

/// Bytes in a millisecond at 115,200 baud, rounded up.
const BYTES: usize = 12;

fn seconds() -> u64 {
    let text = std::env::var("SONARFIX_SECONDS").ok();
    text.map_or(60, |text| text.parse().expect("a whole number"))
}

/// A robot whose sonar hears the room, with a running loop.
fn running(baked: &Baked) -> Bench<'_> {
    let mut bench = Bench::switched_on(baked, SimFlash::new());
    bench.truth = Some(Truth::at(&start()));
    for command in [Command::SetPose(start()), Command::Start] {
        assert_eq!(bench.order(&command), CommandResult::Done);
    }
    bench.received();
    bench
}

/// What a minute under load has shown.
struct Minute {
    /// The messages of its last second.
    last: Vec<Telemetry>,
    /// Accepted ranges.
    accepted: usize,
    /// The largest error of the position with the verdict `Tracking`, metres.
    worst: f64,
}

/// Drives in circles of 40 cm for so many seconds, while the motors are enabled; each poll comes after `load`. Every tick is
/// on time, nothing resets the robot, and with the verdict `Tracking` the position is right within 10 cm.
fn stays_on_time(bench: &mut Bench, mut load: impl FnMut(&mut Bench, u64)) -> Minute {
    let mut minute = Minute { last: Vec::new(), accepted: 0, worst: 0.0 };
    let (mut ticks, mut may_drive) = (0, true);
    for second in 0..seconds() {
        for milli in 0..1_000 {
            if may_drive {
                bench.roll(1, i16::from(milli % 3 > 0));
            }
            load(bench, milli);
            let polled = bench.poll();
            assert!(polled.is_running, "second {second}");
            (ticks, may_drive) = (ticks + u64::from(polled.is_on_time), polled.may_drive);
            if bench.estimate().health.verdict == Verdict::Tracking {
                minute.worst = minute.worst.max(bench.error());
                assert!(minute.worst < 0.1, "{} m at {second}.{milli:03} s", minute.worst);
            }
        }
        minute.last = bench.received();
        let is_accepted = |message: &&Telemetry| {
            matches!(message, Telemetry::Ping(Ping { fix: Fix::Accepted(_), .. }))
        };
        minute.accepted += minute.last.iter().filter(is_accepted).count();
    }
    let status = bench.app.faults();
    assert_eq!((status.deadlines, status.clock), (0, 0), "{status:?}");
    assert!(ticks.abs_diff(10 * seconds()) <= 1 + seconds() / 100, "{ticks} ticks");
    println!(
        "{ticks} ticks, {} ranges accepted, at most {:.4} m off",
        minute.accepted, minute.worst
    );
    minute
}

#[test]
fn garbage_at_the_rate_of_the_line_costs_no_deadline() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let mut random = Random::new(1);
    let minute = stays_on_time(&mut bench, |bench, _| {
        let garbage: [u8; BYTES] = std::array::from_fn(|_| random.next() as u8);
        bench.garble(&garbage);
    });
    let counters = loop_status(&minute.last).commands;
    assert!(u64::from(counters.skipped()) > 30 * seconds(), "{counters:?}");
    assert!(minute.accepted as u64 >= seconds() * 9 / 10, "{} ranges", minute.accepted);
    assert_eq!(bench.estimate().health.verdict, Verdict::Tracking);
    // The zero ends what is left of the garbage.
    bench.garble(&[0]);
    assert_eq!(bench.order(&Command::Stop), CommandResult::Done);
}

/// The true pose, as a person would measure it.
fn measured(bench: &Bench) -> Start {
    let Truth { x, y, heading } = bench.truth.expect("the robot is in the room");
    Start { pose: Pose::new(x as f32, y as f32, Radians(heading as f32)), ..start() }
}

/// As many commands as a line has room for: a pose takes 40 bytes, a query 14. A new pose aborts the ping in flight;
/// once in `period` milliseconds it leaves time for pings, every 12 ms it does not.
fn flood(period: u64) -> Minute {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let mut sent = 0;
    let minute = stays_on_time(&mut bench, |bench, milli| {
        sent += 1;
        // Before its sequence numbers are used up.
        if sent % 100_000 == 0 {
            bench.open_session();
        }
        match milli % 12 {
            0 if sent % period < 12 => bench.send(&Command::SetPose(measured(bench))),
            0 | 4 | 6 | 8 => bench.send(&Command::MapChecksum),
            10 => bench.send(&Command::Start),
            _ => {}
        }
    });
    assert_eq!(bench.estimate().health.verdict, Verdict::Tracking);
    minute
}

#[test]
fn commands_at_the_rate_of_the_line_cost_no_deadline() {
    flood(12);
    let accepted = flood(5_000).accepted;
    assert!(accepted as u64 >= seconds() / 2, "{accepted} ranges");
}

/// The link is unplugged in the middle of a frame and plugged again, every 5 s.
#[test]
fn an_unplugged_link_costs_no_deadline() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let mut polls = 0_u64;
    let minute = stays_on_time(&mut bench, |bench, _| {
        polls += 1;
        bench.line.is_unplugged = polls % 10_000 >= 5_000;
        if polls % 5_000 == 4_995 {
            bench.send(&Command::MapChecksum);
        }
    });
    bench.line.is_unplugged = false;
    // Half of them are not heard of.
    assert!(minute.accepted as u64 >= seconds() * 4 / 10, "{} ranges", minute.accepted);
    assert_eq!(bench.estimate().health.verdict, Verdict::Tracking);
    bench.wait(1_100);
    assert_eq!(bench.order(&Command::Stop), CommandResult::Done);
}

/// Each device dead for 5 s, and all together, again and again: no deadline is missed, the verdict is never `Tracking` for
/// longer than 0.7 s without odometry, and the motors are off then.
#[test]
fn dead_devices_cost_no_deadline() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let mut polls = 0_u64;
    let mut blind = 0_u64;
    let mut recovered = 0_u64;
    let minute = stays_on_time(&mut bench, |bench, _| {
        let (device, phase) = ((polls / 20_000) % 5, polls % 20_000);
        let is_dead = |which| phase >= 15_000 && (device == which || device == 4);
        let [right, left] = bench.counted;
        bench.hardware.right.0 = (!is_dead(0)).then_some(right);
        bench.hardware.left.0 = (!is_dead(1)).then_some(left);
        bench.servo_is_there.set(!is_dead(2));
        bench.hardware.ranger.is_there = !is_dead(3);
        blind = if is_dead(0) || is_dead(1) { blind + 1 } else { 0 };
        if blind > 700 {
            assert_ne!(bench.estimate().health.verdict, Verdict::Tracking, "poll {polls}");
        } else if phase == 14_999 {
            // Healthy for 15 s.
            recovered += u64::from(bench.estimate().health.verdict == Verdict::Tracking);
        }
        polls += 1;
    });
    assert_eq!(recovered, seconds() / 20);
    assert!(minute.accepted as u64 >= seconds() / 2, "{} ranges", minute.accepted);
}

/// A day with a command every 2 s; the flash after it.
fn a_day_of(command: impl Fn(u64) -> Command) -> SimFlash {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    for number in 0..DAY / 2 {
        bench.now += 2_000_000;
        bench.send(&command(number));
        let _ = bench.poll();
        bench.received();
    }
    bench.switched_off()
}

/// A day of a robot that gets a pose and starts, and is switched off a minute later, again and again; the flash after it, and
/// the writes that the robot has counted.
fn a_day_of_resets() -> (SimFlash, u32) {
    let baked = Baked::new(&config());
    let mut flash = SimFlash::new();
    let mut counted = 0;
    for number in 0..DAY / 60 {
        let mut bench = Bench::switched_on(&baked, flash);
        assert_eq!(bench.order(&another_pose(number)), CommandResult::Done);
        assert_eq!(bench.order(&Command::Start), CommandResult::Done);
        assert_eq!(bench.order(&Command::Stop), CommandResult::Done);
        for _ in 0..59 {
            bench.now += 1_000_000;
            let _ = bench.poll();
            bench.received();
        }
        counted = bench.app.store().status().writes;
        flash = bench.switched_off();
    }
    (flash, counted)
}

/// Seconds.
const DAY: u64 = 86_400;
/// Bytes of a record and of a configuration in flash.
const RECORD: u64 = 96;
const CONFIGURATION: u64 = 220;

/// Another pose each time.
fn another_pose(number: u64) -> Command {
    let mut start = start();
    start.pose.x.0 += number as f32 * 1e-5;
    Command::SetPose(start)
}

/// Another configuration each time.
fn another_configuration(number: u64) -> Command {
    let mut config = config();
    config.localizer.gating.confidence += 1e-3 * (1 + number % 1_000) as f32;
    Command::SetConfiguration(config)
}

/// Entries that fit into a sector, besides its header and the copies of the newest records.
fn per_sector(entry: u64, copies: u64) -> u64 {
    (SECTOR as u64 - 40 - copies) / entry
}

/// Life of so many sectors that endure so many erases each, with so many new bytes a day.
fn years(new: u64, sector: u64, sectors: u64, endures: u64) -> f64 {
    let erases = new as f64 / (sector - 40 - CONFIGURATION - RECORD) as f64;
    (endures * sectors) as f64 / erases / 365.25
}

/// The wear that `docs/firmware.md` computes with: at most one write a minute, and eight more.
#[test]
fn a_day_of_commands_wears_the_flash_at_the_permitted_rate() {
    let flash = a_day_of(another_pose);
    let (writes, erases) = (flash.written as u64 / RECORD, flash.erased as u64);
    println!("{writes} writes and {erases} erases of {SECTORS} sectors of {SECTOR} bytes in a day");
    // A sector also holds its header and the copies of the newest records.
    assert!((DAY / 60..=DAY / 60 + 120 + 2 * erases).contains(&writes), "{writes}");
    assert!(erases <= writes / per_sector(RECORD, 2 * RECORD) + 2, "{erases}");
}

/// A bucket that were full after each reset would permit three writes a minute here.
#[test]
fn a_day_of_resets_wears_the_flash_at_the_permitted_rate() {
    let (flash, counted) = a_day_of_resets();
    let (writes, erases) = (flash.written as u64 / RECORD, flash.erased as u64);
    println!("{writes} writes, {counted} of them counted, and {erases} erases in a day of resets");
    assert!(writes <= DAY / 60 + 120 + 2 * erases, "{writes}");
    assert!(u64::from(counted) <= DAY / 60 + 120, "{counted}");
    assert!(counted >= 120, "{counted}: the bucket was full at first");
}

/// The same over both keys: no sequence of commands wears the flash faster than one configuration a minute.
#[test]
fn a_day_of_configurations_wears_the_flash_at_the_permitted_rate() {
    let all = |number: u64| match number % 5 {
        0 => another_configuration(number / 5),
        1 => another_pose(number),
        2 => Command::Start,
        3 => Command::Stop,
        _ => Command::ResetCalibration,
    };
    let most = DAY / 60 + 120;
    let worst = most / per_sector(CONFIGURATION, CONFIGURATION + RECORD) + 2;
    let days: [(&str, SimFlash); 2] =
        [("configurations", a_day_of(another_configuration)), ("all commands", a_day_of(all))];
    for (name, flash) in days {
        let (bytes, erases) = (flash.written as u64, flash.erased as u64);
        println!(
            "{name}: {bytes} bytes and {erases} erases of {SECTORS} sectors of {SECTOR} bytes in a day"
        );
        // Without the header and the copies of each sector.
        let new = bytes - erases * (40 + CONFIGURATION + RECORD);
        let [stm32, pico] = [years(new, 16_384, 2, 10_000), years(new, 4_096, 8, 100_000)];
        println!("life: {stm32:.1} years on an STM32F405, {pico:.0} on a Pico 2");
        assert!(stm32 > 2.8 && pico > 26.0, "{name}: {stm32} and {pico} years");
        assert!(bytes >= DAY / 60 * RECORD, "{name}: {bytes} bytes");
        assert!(erases <= worst, "{name}: {erases} erases, at most {worst}");
    }
}

/// Counts the messages that are due once a second and every ten seconds.
fn periodic(messages: &[Telemetry]) -> (usize, usize) {
    let count = |is_it: fn(&&Telemetry) -> bool| messages.iter().filter(is_it).count();
    let statuses = count(|message| matches!(message, Telemetry::LoopStatus(_)));
    (statuses, count(|message| matches!(message, Telemetry::Hello(_))))
}

/// Encoders that have never been read are a fault in every poll.
#[test]
fn a_fault_in_every_poll_does_not_suppress_the_periodic_messages() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    (bench.hardware.right.0, bench.hardware.left.0) = (None, None);
    for command in [Command::SetPose(start()), Command::Start] {
        assert_eq!(bench.order(&command), CommandResult::Done);
    }
    bench.received();
    let messages = bench.wait(30_000);
    assert!(loop_status(&messages).faults.right.errors > 10_000);
    let (statuses, hellos) = periodic(&messages);
    assert!((29..=30).contains(&statuses) && hellos == 3, "{statuses}, {hellos}");
}

/// An executor that polls only at the ticks has a tick in every poll.
#[test]
fn a_tick_in_every_poll_does_not_suppress_the_periodic_messages() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let period = config().encoder_period.ticks();
    let first = bench.app.localizer().unwrap().time();
    for _ in 0..300 {
        bench.now += period - 1_000;
        let polled = bench.poll();
        assert!(polled.is_running);
    }
    let ticks = (bench.app.localizer().unwrap().time() - first).ticks() / period;
    assert!(ticks >= 290, "{ticks} ticks");
    let (statuses, hellos) = periodic(&bench.received());
    assert!((27..=30).contains(&statuses) && (2..=3).contains(&hellos), "{statuses}, {hellos}");
}
