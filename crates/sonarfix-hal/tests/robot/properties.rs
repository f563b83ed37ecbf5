//! Properties for arbitrary times of polls.

use proptest::prelude::*;
use sonarfix::config::PingSchedule;
use sonarfix::geometry::units::{Duration, Instant, Metres};
use sonarfix::localizer::Fix;
use sonarfix_hal::config::{Feature, NotLinked, WheelConfig};
use sonarfix_hal::ranger::NoEcho;
use sonarfix_hal::robot::{Report, Settings, Stamp, StepResult};
use sonarfix_hal::servo::ServoTiming;

use super::rig::{Broken, Drive, World, accounts, pins, robot, run, steps, walls};

/// 2⁻¹⁰ m: sums of such ticks are exact.
const TICK: f32 = 1.0 / 1_024.0;

/// A digital servo of 400 Hz that turns instantly: only the ranger limits the rate.
const FAST: ServoTiming = ServoTiming {
    frame: Duration::from_ticks(2_500),
    sixty_degrees: Duration::from_ticks(0),
    settle: Duration::from_ticks(0),
};

const UNPACED: PingSchedule = PingSchedule::AsFastAsPossible;

fn any_drive() -> impl Strategy<Value = Drive> {
    let speed = prop_oneof![-0.2_f64..-0.05, 0.05_f64..0.2];
    (speed, 0.0_f64..0.04).prop_map(|(speed, sway)| Drive { speed, sway })
}

/// Times of polls, µs. `Debug` prints only their number, because there are hundreds.
#[derive(Clone)]
struct Polls(Vec<u64>);

impl core::fmt::Debug for Polls {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} polls from {:?}", self.0.len(), self.0.first())
    }
}

/// Times of polls for about 4 s: mostly quick ones, some late, some very late; at the end quick ones, which complete
/// the pending ping.
fn any_polls() -> impl Strategy<Value = Polls> {
    let step = prop_oneof![
        8 => 20_u64..3_000,
        2 => 3_000_u64..40_000,
        1 => 40_000_u64..250_000,
    ];
    prop::collection::vec(step, 800).prop_map(|steps| {
        let mut now = 0;
        let times = steps.iter().map(|step| {
            now += step;
            now
        });
        let mut times: Vec<_> = times.take_while(|&time| time < 3_000_000).collect();
        let last = times.last().map_or(0, |&time| time);
        times.insert(0, 0);
        // Two very late ones in a row: if the first starts a ping, the second cannot start another.
        let last = last + 480_000;
        times.extend([last - 240_000, last]);
        times.extend((1..400).map(|step| last + 1_000 * step));
        Polls(times)
    })
}

proptest! {
    /// The localizer's travel equals the counts: no tick is lost or counted twice, across counter overflow, with and
    /// without echoes, with any jitter of the polls.
    #[test]
    fn travel_is_conserved(
        drive in any_drive(),
        first_count in 0_u32..=0xFFFF,
        polls in any_polls(),
        deaf: bool,
        every in prop::option::of(100_000_u64..700_000),
    ) {
        let walls = walls();
        let world = World::new(drive, TICK, first_count);
        world.broken.set(Broken { deaf, ..Broken::default() });
        let schedule = every.map_or(PingSchedule::AsFastAsPossible, |period| {
            PingSchedule::Every(Duration::from_ticks(period))
        });
        let mut robot = robot(&walls, TICK, schedule, Settings::default());
        let mut pins = pins(&world, FAST);
        let mut reports = run(&world, &mut robot, &mut pins, polls.0.iter().copied());

        let first = polls.0[0];
        let heard = reports.iter().filter_map(|(_, report)| report.ping_result);
        let echoes = heard.filter(|heard| heard.outcome.is_ok() != deaf).count();
        prop_assert!(echoes >= 2, "{echoes} pings came to an end");
        // Up to the end of a tick, when all counts have been passed on.
        let last = reports.iter().rposition(|(_, report)| report.tick.is_some()).unwrap();
        reports.truncate(last + 1);
        let counted = world.ticks(reports[last].0) - world.ticks(first);
        let expected = counted as f64 * f64::from(TICK);
        prop_assert_eq!(accounts(&reports), (expected, 0.0));
        prop_assert!(counted != 0, "the robot has moved");
    }

    /// Every range is used at the instant of its reflection, with the wheel travel at that instant, so that the range
    /// agrees with the map.
    #[test]
    fn echoes_meet_the_filter_at_their_reflection(drive in any_drive(), polls in any_polls()) {
        let walls = walls();
        let world = World::new(drive, TICK, 0);
        let mut robot = robot(&walls, TICK, UNPACED, Settings::default());
        let mut pins = pins(&world, FAST);
        let reports = run(&world, &mut robot, &mut pins, polls.0.iter().copied());

        let flights = world.flights.borrow().clone();
        let heard: Vec<_> = reports.iter().enumerate().filter_map(|(index, (_, report))| {
            Some((index, report.ping_result.filter(|heard| heard.outcome.is_ok())?))
        }).collect();
        prop_assert!(heard.len() >= 3);
        // The last echo may still be in flight.
        prop_assert!(flights.len() - heard.len() <= 1);
        for ((index, heard), (sent, back)) in heard.into_iter().zip(flights) {
            let reflected = sent.midpoint(back);
            // The travel is taken in the same poll as the range, or in one before.
            let index = reports[..=index].iter().rposition(|(_, it)| it.reached.is_some()).unwrap();
            let step = reports[index].1.reached.unwrap();
            prop_assert_eq!(step.at, Instant::from_ticks(reflected));
            prop_assert!(matches!(heard.fix, Some(Fix::Accepted(_))), "{heard:?}");
            if step.result != StepResult::Accepted {
                continue;
            }
            // Everything up to this step, without the tick that may follow in the same poll.
            let mut upto = reports[..=index].to_vec();
            upto[index].1.tick = None;
            let (travel, _) = accounts(&upto);
            let truth = world.x(reflected) - world.x(polls.0[0]);
            // A tick at either end, and the curvature of the sway between the two readings.
            let pinged = reports[..index].iter().rfind(|(_, report)| report.pinged.is_some());
            let gap = (reports[index].0 - pinged.unwrap().0) as f64 * 1e-6;
            let bend = 9.0 * drive.sway * gap * gap / 8.0;
            let close = (travel - truth).abs() < 2.0 * f64::from(TICK) + bend;
            prop_assert!(close, "travel {travel}, true {truth}");
        }
    }

    /// No ping before the servo has settled, computed from the PWM duties and the timing alone.
    #[test]
    fn no_ping_before_the_servo_has_settled(drive in any_drive(), polls in any_polls()) {
        let walls = walls();
        let world = World::new(drive, TICK, 0);
        let mut robot = robot(&walls, TICK, UNPACED, Settings::default());
        let mut pins = pins(&world, ServoTiming::SG90);
        run(&world, &mut robot, &mut pins, polls.0.iter().copied());

        let degrees = |duty| world.degrees(duty);
        let (triggers, duties) = (world.triggers.borrow(), world.duties.borrow());
        prop_assert!(triggers.len() >= 2 && !duties.is_empty());
        for &ping in triggers.iter() {
            let turns: Vec<_> = duties.iter().filter(|&&(time, _)| time <= ping).collect();
            let (sent, duty) = **turns.last().unwrap();
            // Before its first turn its bearing is unknown: at least 100° of travel.
            let from = turns.iter().rev().nth(1).map(|&&(_, duty)| degrees(duty));
            let turn = from.map_or(100.0, |from| (degrees(duty) - from).abs());
            let settled = sent as f64 + 20_000.0 + 120_000.0 * turn / 60.0 + 60_000.0;
            prop_assert!(ping as f64 >= settled, "ping {ping}, settled {settled}");
        }
    }

    /// Never two pings within the cycle of the ranger, even with an instant servo.
    #[test]
    fn pings_keep_their_distance(drive in any_drive(), polls in any_polls()) {
        let walls = walls();
        let world = World::new(drive, TICK, 0);
        let mut robot = robot(&walls, TICK, UNPACED, Settings::default());
        let mut pins = pins(&world, FAST);
        run(&world, &mut robot, &mut pins, polls.0.iter().copied());

        let bursts = world.bursts.borrow();
        let gaps: Vec<_> = bursts.windows(2).map(|pair| pair[1] - pair[0]).collect();
        prop_assert!(gaps.iter().all(|&gap| gap >= 60_000), "{gaps:?}");
        // During the 400 ms of quick polls at the end, the rate is that of the ranger.
        prop_assert!(gaps.iter().any(|&gap| gap <= 64_000), "{gaps:?}");
    }

    /// Every deadline of the tick's grid is processed once or reported as skipped, and a tick is late only
    /// if its poll was late or a ping was in flight.
    #[test]
    fn ticks_stay_on_their_grid(drive in any_drive(), polls in any_polls()) {
        let walls = walls();
        let world = World::new(drive, TICK, 0);
        let mut robot = robot(&walls, TICK, UNPACED, Settings::default());
        let mut pins = pins(&world, FAST);
        let reports = run(&world, &mut robot, &mut pins, polls.0.iter().copied());

        let (mut dots, mut missed, mut before) = (0, 0, 0);
        let mut has_ended_ping = false;
        for (now, report) in &reports {
            if let Some(tick) = report.tick {
                let due = now - tick.lateness.to_micros();
                prop_assert_eq!(due, 100_000 * (dots + 1));
                dots += 1 + tick.skipped;
                prop_assert_eq!(dots, now / 100_000);
                // Only a ping in flight delays a tick that is due, up to the poll after its end.
                prop_assert_eq!(tick.held, due <= before);
                prop_assert!(report.ping_result.is_none());
                prop_assert!(has_ended_ping || !tick.held);
                missed += u32::from(now - due.max(before) > 10_000);
            }
            before = *now;
            has_ended_ping = report.ping_result.is_some();
        }
        prop_assert!(dots >= 30 && missed > 0);
        prop_assert_eq!(robot.faults().deadlines, missed);
        prop_assert!(robot.faults().right == robot.faults().left);
    }
}

fn reports_with(
    schedule: PingSchedule,
    settings: Settings,
    drive: Drive,
    tick: f32,
) -> (Vec<(u64, Report)>, u32) {
    let walls = walls();
    let world = World::new(drive, tick, 0);
    let mut robot = robot(&walls, tick, schedule, settings);
    let mut pins = pins(&world, FAST);
    let reports = run(&world, &mut robot, &mut pins, (0..12_000).map(|step| step * 250));
    (reports, robot.faults().travel)
}

#[test]
fn naive_stamps_are_those_of_the_arrival() {
    let drive = Drive { speed: 0.3, sway: 0.0 };
    let naive = Settings { stamp: Stamp::Arrival, ..Settings::default() };
    let (reports, _) = reports_with(UNPACED, naive, drive, TICK);
    let mut heard = 0;
    for (now, report) in &reports {
        if let Some(step) = report.reached {
            assert_eq!(step.at, Instant::from_ticks(*now));
            heard += 1;
        }
    }
    assert!(heard > 20, "{heard}");
}

/// 16 mm per tick, as of an encoder disc with few slots: most steps to a reflection and from it to the next
/// tick appear far too fast. Their travel is deferred, and none is discarded.
#[test]
fn coarse_ticks_are_not_discarded() {
    let mut kept = 0;
    for speed in [0.3, 0.4, 0.5, 0.6, 0.7, 0.8] {
        let drive = Drive { speed, sway: 0.0 };
        let (reports, written_off) = reports_with(UNPACED, Settings::default(), drive, 16.0 * TICK);
        let steps = steps(&reports);
        kept += steps.filter(|step| matches!(step.result, StepResult::Deferred(_))).count();
        assert_eq!(written_off, 0);
        let last = reports.iter().rposition(|(_, report)| report.tick.is_some()).unwrap();
        let (now, _) = reports[last];
        let world = World::new(drive, 16.0 * TICK, 0);
        let counted = world.ticks(now) as f64 * 16.0 * f64::from(TICK);
        let (taken, _) = accounts(&reports[..=last]);
        assert!((taken - counted).abs() < 1e-9, "{taken} of {counted}");
    }
    assert!(kept > 0);
}

/// Ticks with a shorter period than a ping are skipped while it is in flight; this is not a fault.
#[test]
fn ticks_delayed_by_a_ping_meet_their_deadlines() {
    let drive = Drive { speed: 0.1, sway: 0.0 };
    let settings = Settings {
        encoder_period: Duration::from_ticks(5_000),
        tolerance: Duration::from_ticks(1_000),
        ..Settings::default()
    };
    let walls = walls();
    let world = World::new(drive, TICK, 0);
    let mut robot = robot(&walls, TICK, UNPACED, settings);
    let mut pins = pins(&world, FAST);
    let reports = run(&world, &mut robot, &mut pins, (0..4_000).map(|step| step * 250));
    let skipped = reports.iter().filter_map(|(_, report)| report.tick);
    assert!(skipped.filter(|tick| tick.held && tick.skipped > 0).count() > 10);
    assert!(robot.faults().is_none(), "{:?}", robot.faults());
}

#[test]
fn fixes_keep_their_schedule() {
    let schedule = PingSchedule::Every(Duration::from_ticks(500_000));
    let drive = Drive { speed: 0.1, sway: 0.0 };
    let (reports, _) = reports_with(schedule, Settings::default(), drive, TICK);
    let aims = reports.iter().filter(|(_, report)| report.aimed.is_some());
    let aims: Vec<_> = aims.map(|&(time, _)| time).collect();
    // A tick is due at the same time and precedes the choice by a poll, of which there are three; the schedule is unaffected.
    assert_eq!(aims, [500_750, 1_000_750, 1_500_750, 2_000_750, 2_500_750]);
    let silent = reports.iter().filter_map(|(_, report)| report.ping_result);
    assert!(silent.filter(|heard| heard.outcome == Err(NoEcho::Nothing)).count() == 0);
}

#[test]
fn a_mirrored_wheel_counts_the_other_way() {
    let wheel = WheelConfig::of_diameter(Metres(0.065), 360.0);
    assert_eq!(wheel.mirrored().signed_travel(), Metres(-wheel.signed_travel().0));
    assert_eq!(wheel.mirrored().mirrored(), wheel);
}

#[test]
fn a_part_that_is_not_linked_is_named_as_its_feature() {
    let manifest = include_str!("../../Cargo.toml");
    for feature in Feature::ALL {
        let text = NotLinked(feature).to_string();
        let name = text.split('`').nth(1).unwrap();
        assert!(manifest.contains(&format!("\n{name} = [")), "{text}");
    }
}
