//! Programs that end while the robot drives.

use sonarfix_link::Command;
use sonarfix_link::message::ResetCause;

use crate::pico::{Event, PICO, Polls, World};
use crate::results::{Table, polls, row};
use crate::{done, driving_in, start, world_of};

/// The most that the motors may run after a program has stopped, milliseconds.
pub const STOPS_WITHIN: f64 = 250.0;

/// Whatever ends the program, the motors are off and the chip is reset in time, and the robot waits for the PC.
#[test]
#[ignore = "cargo xtask chips"]
fn a_program_that_stops_stops_the_motors() {
    let counted = stop(
        &world_of(PICO),
        "",
        &[
            ("hang", ResetCause::Watchdog),
            ("fault", ResetCause::Software),
            ("overflow", ResetCause::Watchdog),
        ],
    );
    polls("a program that stops", counted);
}

/// Ends the program in these ways, with the causes of the resets that follow.
pub fn stop(world: &World, robot: &str, ends: &[(&str, ResetCause)]) -> Polls {
    let mut counted = Polls::default();
    for &(end, cause) in ends {
        let mut pico = driving_in(world);
        let began = pico.state().ms;
        pico.ask(end);
        pico.run(1_000, &[]);
        let events = pico.events();
        let after = |what: &str| {
            let find = |event: &&Event| event.what.starts_with(what);
            events.iter().find(find).map(|event| event.ms - began)
        };
        let (off, reset) = (after("disabled").unwrap(), after("reset").unwrap());
        row(
            Table::Measured,
            &[
                &format!("{robot}{end}: motors off after; reset after"),
                &format!("{off:.0} ms; {reset:.0} ms"),
            ],
        );
        assert!(off <= STOPS_WITHIN && reset <= STOPS_WITHIN, "{end}: {events:?}");
        assert!(after("enabled").is_none(), "{end}: {events:?}");
        pico.forget_session();
        assert_eq!(pico.hello().reset, cause, "{end}");
        assert!(!pico.loop_status().running);
        assert!(!pico.state().is_enabled);
        // It drives again after these commands.
        done(pico.order(&Command::SetPose(start())));
        done(pico.order(&Command::Start));
        pico.run(1_000, &[]);
        assert!(pico.state().is_enabled);
        counted = counted.and(pico.polls());
    }
    counted
}
