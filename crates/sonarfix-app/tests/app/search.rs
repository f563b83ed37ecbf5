//! A robot that may start without a pose: it starts, sweeps and reports no pose; commands and power cuts leave it so.

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::Start;
use sonarfix_hal::config::{RobotConfig, StartPose};
use sonarfix_link::message::{CommandError, SearchAnswer};
use sonarfix_link::{Command, CommandResult, Telemetry};
use sonarfix_search::navigator::{Mode, UNKNOWN_POSITION};

use crate::flash::SimFlash;
use crate::rig::{Baked, Bench, config, start};
use crate::room::Truth;

fn searching() -> Baked {
    Baked::new(&RobotConfig { start: StartPose::Unknown { region: None }, ..config() })
}

fn here() -> Command {
    Command::SetPose(Start {
        pose: Pose::new(1.0, 1.0, Radians(0.0)),
        position_deviation: Metres(0.05),
        heading_deviation: Radians(0.05),
    })
}

fn mode(bench: &Bench) -> Option<Mode> {
    bench.app.navigation_mode()
}

#[test]
fn it_starts_without_a_pose_and_claims_none() {
    let baked = searching();
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::Start), CommandResult::Done);
    assert_eq!(mode(&bench), Some(Mode::Searching));
    let (mut estimates, mut sweeps, mut statuses) = (0, 0, 0);
    for message in bench.wait(10_000) {
        match message {
            Telemetry::Initialized(estimate) => {
                assert_eq!(estimate.deviation.x, UNKNOWN_POSITION);
            }
            Telemetry::Estimate(estimate) => {
                estimates += 1;
                assert_eq!(estimate.health.verdict, Verdict::Lost);
                assert!(estimate.deviation.x > Metres(900.0), "{estimate:?}");
                assert!(estimate.deviation.heading > Radians(3.0), "{estimate:?}");
            }
            Telemetry::Sweep(_) => sweeps += 1,
            Telemetry::Search(status) => {
                statuses += 1;
                assert_eq!(status.mode, Mode::Searching);
                assert_ne!(status.answer, SearchAnswer::Unique);
            }
            Telemetry::Ping(ping) => panic!("it aims at a wall without a pose: {ping:?}"),
            _ => {}
        }
    }
    assert!(estimates > 90 && sweeps > 10 && (9..=11).contains(&statuses));
}

#[test]
fn a_pose_ends_the_search_and_a_command_begins_it() {
    let baked = searching();
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::Start), CommandResult::Done);
    assert_eq!(bench.order(&here()), CommandResult::Done);
    assert_eq!(mode(&bench), Some(Mode::Tracking));
    bench.received();
    assert_eq!(bench.order(&Command::Search), CommandResult::Done);
    assert_eq!(mode(&bench), Some(Mode::Searching));
    // A stop does not turn the pose of dead reckoning into a known one.
    assert_eq!(bench.order(&Command::Stop), CommandResult::Done);
    assert!(bench.app.known().is_some_and(|known| !known.has_pose));
    assert_eq!(bench.order(&Command::Start), CommandResult::Done);
    assert_eq!(mode(&bench), Some(Mode::Searching));
}

/// An executor that polls at once when it is asked to, and one that polls once a tick.
#[test]
fn a_new_pose_and_a_search_are_reported_once_to_each_executor() {
    for period in [1_000, 100_000] {
        let baked = searching();
        let mut bench = Bench::switched_on(&baked, SimFlash::new());
        assert_eq!(bench.order(&Command::Start), CommandResult::Done);
        let polled = |bench: &mut Bench, polls: u32| {
            for _ in 0..polls {
                bench.set_now(bench.now() + period - 1_000);
                bench.roll(3, 3);
                let _ = bench.poll();
            }
            bench.received()
        };
        polled(&mut bench, 30);
        let frames = [here(), Command::Search].map(|command| bench.frame(&command));
        bench.garble(&frames[0]);
        let messages = polled(&mut bench, 30);
        let set: Vec<_> = messages
            .iter()
            .filter_map(|message| match message {
                Telemetry::PoseSet(estimate) => Some(estimate.state.pose()),
                _ => None,
            })
            .collect();
        assert_eq!(set, [Pose::new(1.0, 1.0, Radians(0.0))], "{period}");
        bench.garble(&frames[1]);
        let messages = polled(&mut bench, 30);
        let modes = messages.iter().filter_map(|message| match message {
            Telemetry::ModeChanged(changed) => Some(changed.mode),
            _ => None,
        });
        assert_eq!(modes.collect::<Vec<_>>(), [Mode::Searching], "{period}");
    }
}

#[test]
fn after_a_power_loss_on_the_way_it_searches() {
    let baked = searching();
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&here()), CommandResult::Done);
    assert_eq!(bench.order(&Command::Start), CommandResult::Done);
    assert_eq!(mode(&bench), Some(Mode::Tracking));
    bench.wait(1_000);
    let flash = bench.switched_off();
    let mut bench = Bench::switched_on(&baked, flash);
    assert_eq!(bench.order(&Command::Start), CommandResult::Done);
    assert_eq!(mode(&bench), Some(Mode::Searching));
}

#[test]
fn a_robot_whose_start_is_known_does_not_search() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    let refused = CommandResult::Refused(CommandError::NoSearch);
    assert_eq!(bench.order(&Command::Search), refused);
    assert_eq!(bench.order(&here()), CommandResult::Done);
    assert_eq!(bench.order(&Command::Start), CommandResult::Done);
    assert_eq!(bench.order(&Command::Search), refused);
    bench.wait(2_000);
    assert_eq!(mode(&bench), Some(Mode::Tracking));
}

/// Between two polls the search works for a robot that searches, up to 0.8 ms after the poll, and for no other.
#[test]
fn the_search_works_between_polls_while_it_is_time() {
    let after = |bench: &mut Bench, micros: u64| {
        let before = format!("{:?}", bench.app.search());
        let start = Instant::from_ticks(bench.now);
        bench.app.work(start, || Instant::from_ticks(start.ticks() + micros));
        before != format!("{:?}", bench.app.search())
    };
    let baked = searching();
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert!(!after(&mut bench, 0), "it waits");
    bench.truth = Some(Truth::at(&start()));
    assert_eq!(bench.order(&Command::Start), CommandResult::Done);
    // Pings enough for a window.
    for _ in 0..200 {
        bench.roll(40, 36);
        bench.wait(100);
    }
    assert_eq!(mode(&bench), Some(Mode::Searching));
    assert!(after(&mut bench, 0) && after(&mut bench, 799) && after(&mut bench, 800));
    assert!(!after(&mut bench, 801) && !after(&mut bench, 10_000));
    assert_eq!(bench.order(&here()), CommandResult::Done);
    assert_eq!(mode(&bench), Some(Mode::Tracking));
    assert!(!after(&mut bench, 0), "it tracks");
}
