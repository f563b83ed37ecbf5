//! When the application asks to be polled next: a board sleeps until then.

use sonarfix::geometry::units::Metres;
use sonarfix_link::Command;
use sonarfix_link::message::CommandResult;

use crate::flash::SimFlash;
use crate::rig::{Baked, Bench, config, start};
use crate::room::Truth;

const DONE: CommandResult = CommandResult::Done;

/// A record that is owed, but not permitted yet, does not keep a robot that waits from sleeping: it is written with the second
/// write that is gained, because one is kept in reserve.
#[test]
fn a_postponed_record_is_no_reason_to_poll() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    let mut written = 0;
    for number in 0..130_u8 {
        let mut pose = start();
        pose.pose.x = Metres(0.01 * f32::from(number));
        bench.send(&Command::SetPose(pose));
        let polled = bench.poll();
        assert_eq!(polled.answered, Some(DONE));
        written += u8::from(polled.saved == Some(Ok(())));
        bench.wait(1);
        assert!(bench.next_poll() > bench.now, "after {number} poses");
    }
    assert_eq!(written, 120);
    let mut awake = 0;
    let saved = (1..=121_000).find(|_| {
        let is_saved = bench.poll().saved.is_some();
        awake += u32::from(bench.next_poll() <= bench.now);
        is_saved
    });
    // Its messages are due.
    assert!(awake < 1_000, "{awake} times");
    assert!(saved.is_some_and(|millis| millis > 119_000), "{saved:?}");
}

/// The store is not used, so that nothing is owed to it.
#[test]
fn a_robot_without_a_store_sleeps_after_a_command() {
    let baked = Baked::new(&config());
    let mut bench = Bench::reset(&baked, SimFlash::new(), 3);
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    bench.wait(1);
    assert!(bench.next_poll() > bench.now);
}

/// While a robot waits, its check of the ranger sleeps until the echo arrives, 3 m and 17 ms away.
#[test]
fn a_check_sleeps_until_the_echo() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    bench.truth = Some(Truth { x: 1.0, y: 1.5, heading: 0.0 });
    let mut longest = 0;
    for _ in 0..3_000 {
        let _ = bench.poll();
        if bench.hardware.ranger.is_pinging() {
            longest = longest.max(bench.next_poll() - bench.now);
        }
    }
    assert!((16_000..18_000).contains(&longest), "{longest}");
    // A ranger that does not answer is asked every millisecond.
    bench.hardware.ranger.is_there = false;
    let mut asked = 0;
    for _ in 0..3_000 {
        let _ = bench.poll();
        asked += u32::from(bench.hardware.ranger.is_pinging());
        assert!(bench.next_poll() > bench.now || !bench.hardware.ranger.is_pinging());
    }
    assert!(asked > 0);
}

/// The next poll, except while a ping is in flight.
#[test]
fn a_simulator_skips_the_time_until_the_next_poll() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    let idle_until = |bench: &mut Bench| bench.app.idle_until(&mut bench.hardware);
    for _ in 0..100 {
        let next = bench.next_poll();
        assert_eq!(idle_until(&mut bench).map(|at| at.ticks()), Some(next));
        let _ = bench.poll();
    }
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    let (mut pinging, mut busy, mut idle) = (0, 0, 0);
    for _ in 0..5_000 {
        let _ = bench.poll();
        let has_sent = !bench.received().is_empty();
        if bench.hardware.ranger.is_pinging() {
            assert_eq!(idle_until(&mut bench), None);
            pinging += 1;
        } else if bench.app.report().unwrap().has_worked() || has_sent {
            // Telemetry, the next slice of a choice, or the ping after it, is due at once; or what waited for a poll that sent telemetry.
            busy += u32::from(idle_until(&mut bench).unwrap().ticks() <= bench.now);
        } else if let Some(until) = idle_until(&mut bench) {
            assert!(until.ticks() >= bench.now, "{until} after {}", bench.now);
            assert!(until.ticks() <= bench.now + 100_000, "later than a tick: {until}");
            idle += 1;
        }
    }
    assert!(pinging > 0 && busy > 0 && idle > 1_000, "{pinging} {busy} {idle}");
}
