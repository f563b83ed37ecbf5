//! The loop under load: garbage and commands at the rate of the line, dead devices, and the wear of the flash in a day.
//! `SONARFIX_SECONDS=3600` makes the first three of them an hour long instead of a minute.

use sonarfix::health::Verdict;
use sonarfix_link::message::CommandResult;
use sonarfix_link::{Command, Telemetry};

use crate::flash::{Random, SECTOR, SECTORS, SimFlash};
use crate::rig::{Baked, Bench, config, loop_status, servo, start};

/// Bytes in a millisecond at 115,200 baud, rounded up.
const BYTES: usize = 12;

fn seconds() -> u64 {
    let text = std::env::var("SONARFIX_SECONDS").ok();
    text.map_or(60, |text| text.parse().expect("a whole number"))
}

fn running(baked: &Baked) -> Bench<'_> {
    let mut bench = Bench::switched_on(baked, SimFlash::new());
    for command in [Command::SetPose(start()), Command::Start] {
        assert_eq!(bench.order(&command), CommandResult::Done);
    }
    bench.received();
    bench
}

/// Polls for so many seconds, each poll after `load`; every tick is on time.
fn stays_on_time(bench: &mut Bench, mut load: impl FnMut(&mut Bench, u64)) -> Vec<Telemetry> {
    let mut messages = Vec::new();
    let mut ticks = 0;
    for second in 0..seconds() {
        for milli in 0..1_000 {
            load(bench, milli);
            let polled = bench.poll();
            assert!(polled.is_running, "second {second}");
            ticks += u64::from(polled.is_on_time);
        }
        messages = bench.received();
    }
    let status = loop_status(&messages);
    assert_eq!((status.faults.deadlines, status.faults.clock), (0, 0), "{status:?}");
    assert!(ticks.abs_diff(10 * seconds()) <= 1 + seconds() / 100, "{ticks} ticks");
    messages
}

#[test]
fn garbage_at_the_rate_of_the_line_costs_no_deadline() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let mut random = Random::new(1);
    let messages = stays_on_time(&mut bench, |bench, _| {
        let garbage: [u8; BYTES] = std::array::from_fn(|_| random.next() as u8);
        bench.garble(&garbage);
    });
    let counters = loop_status(&messages).commands;
    assert!(u64::from(counters.skipped()) > 30 * seconds(), "{counters:?}");
    // The zero ends what is left of the garbage.
    bench.garble(&[0]);
    assert_eq!(bench.order(&Command::Stop), CommandResult::Done);
}

#[test]
fn commands_at_the_rate_of_the_line_cost_no_deadline() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let mut sent = 0;
    stays_on_time(&mut bench, |bench, milli| {
        sent += 1;
        // Before its sequence numbers are used up.
        if sent % 100_000 == 0 {
            bench.open_session();
        }
        match milli % 12 {
            // As many bytes as a minute of line time holds: a pose takes 40, a query 14.
            0 => bench.send(&Command::SetPose(start())),
            4 | 6 | 8 => bench.send(&Command::MapChecksum),
            10 => bench.send(&Command::Start),
            _ => {}
        }
    });
    assert_eq!(bench.estimate().health.verdict, Verdict::Tracking);
}

/// Each device dead for 5 s, and all together, again and again: no deadline is missed, the verdict is never `Tracking` for
/// longer than 0.7 s without odometry, and the motors are off then.
#[test]
fn dead_devices_cost_no_deadline() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let mut polls = 0_u64;
    let mut blind = 0_u64;
    stays_on_time(&mut bench, |bench, _| {
        let (device, phase) = ((polls / 10_000) % 5, polls % 10_000);
        let is_dead = |which| phase >= 5_000 && (device == which || device == 4);
        bench.hardware.right.0 = (!is_dead(0)).then_some(7);
        bench.hardware.left.0 = (!is_dead(1)).then_some(7);
        if phase % 5_000 == 0 {
            bench.hardware.servo = servo(!is_dead(2));
        }
        bench.hardware.ranger.is_there = !is_dead(3);
        blind = if is_dead(0) || is_dead(1) { blind + 1 } else { 0 };
        if blind > 700 {
            assert_ne!(bench.estimate().health.verdict, Verdict::Tracking, "poll {polls}");
        } else if phase == 0 {
            bench.send(&Command::SetPose(start()));
        }
        polls += 1;
    });
}

/// The wear that `docs/firmware.md` computes with: at most one write a minute, and eight more.
#[test]
fn a_day_of_commands_wears_the_flash_at_the_permitted_rate() {
    const DAY: u64 = 86_400;
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    for second in 0..DAY / 2 {
        bench.now += 2_000_000;
        let mut start = start();
        start.pose.x.0 += second as f32 * 1e-5;
        bench.send(&Command::SetPose(start));
        let _ = bench.poll();
        bench.received();
    }
    let flash = bench.switched_off();
    let (record, erases) = (92, flash.erased as u64);
    let writes = flash.written as u64 / record;
    println!("{writes} writes and {erases} erases of {SECTORS} sectors of {SECTOR} bytes in a day");
    // A sector also holds its header and the copies of the newest records.
    assert!((DAY / 60..=DAY / 60 + 8 + 2 * erases).contains(&writes), "{writes}");
    let records_per_sector = (SECTOR as u64 - 40) / record - 2;
    assert!(erases <= writes / records_per_sector + 2, "{erases}");
}
