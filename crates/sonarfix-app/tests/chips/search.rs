//! A robot that starts without a pose: it searches while a PC drives it.

use sonarfix::geometry::units::{MetresPerSecond, RadiansPerSecond};
use sonarfix_hal::config::{RobotConfig, StartPose};
use sonarfix_link::{Command, Motion, Telemetry};
use sonarfix_search::navigator::Mode;

use crate::pico::{Pico, Polls, World};
use crate::results::{Table, polls, row};
use crate::{configuration, done, image, map, world};

/// The longest search, seconds.
const FOUND_WITHIN: f64 = 60.0;
/// The largest error of the pose that was found, metres.
const OFF: f64 = 0.1;
/// A circle of 0.7 m, which stays within the room.
const MOTION: Motion = Motion { speed: MetresPerSecond(0.15), turn: RadiansPerSecond(0.43) };

/// The robot of the other scenarios, which searches and may drive meanwhile.
fn searching() -> RobotConfig {
    let mut config = RobotConfig { start: StartPose::Unknown { region: None }, ..configuration() };
    config.motors.lost = true;
    config
}

#[test]
#[ignore = "cargo xtask chips"]
fn a_robot_without_a_pose_finds_it_within_a_minute() {
    polls("search from nothing", find_from_nothing(&world(), "", Some(MOTION)));
}

/// Starts a robot without a pose, which a PC drives, or its motor code; `robot` precedes what is measured.
pub fn find_from_nothing(world: &World, robot: &str, motion: Option<Motion>) -> Polls {
    let world = World { pose: [1.1, 1.1, 0.6], walls: world.walls.clone(), ..*world };
    let mut pico = Pico::switched_on(world.board.elf, &world, &map(), &image(&searching()));
    pico.hello();
    done(pico.order(&Command::Start));
    let began = pico.state().ms;
    let mut found = None;
    while found.is_none() {
        let seconds = (pico.state().ms - began) / 1e3;
        assert!(seconds <= FOUND_WITHIN, "no pose was found");
        if let Some(motion) = motion {
            done(pico.order(&Command::Drive(motion)));
        }
        pico.run(80, &[]);
        // Of all messages: the wait for an acknowledgement drops those before it.
        let unique = pico.heard.iter().find_map(|message| match message {
            Telemetry::ModeChanged(it) if it.mode == Mode::Provisional => Some(it.estimate),
            _ => None,
        });
        found = unique.map(|estimate| {
            let pose = estimate.state.pose();
            (seconds, pico.truth(estimate.at).distance(pose.x.0, pose.y.0))
        });
    }
    let (after, off) = found.unwrap();
    row(
        Table::Measured,
        &[
            &format!("{robot}search from nothing: a unique answer after; off by"),
            &format!("{after:.1} s; {:.0} mm", 1e3 * off),
        ],
    );
    assert!(off <= OFF, "{off} m");
    let (counters, status) = (pico.counters(), pico.loop_status());
    assert_eq!((status.faults.deadlines, counters.overruns, counters.lost_bytes), (0, 0, 0));
    pico.polls()
}
