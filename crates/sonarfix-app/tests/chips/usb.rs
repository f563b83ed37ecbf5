//! The link over USB beside the UART.

use sonarfix::geometry::units::{MetresPerSecond, RadiansPerSecond};
use sonarfix_link::message::{CommandError, CommandResult, LoopStatus, ResetCause};
use sonarfix_link::{Command, Motion, Telemetry};

use crate::pico::{Pico, Wire, World, XRP};
use crate::results::{Table, polls, row};
use crate::{beside, configuration, done, image, map, start, world, world_of};

const MOTION: Motion = Motion { speed: MetresPerSecond(0.12), turn: RadiansPerSecond(0.3) };
/// From the last motion that the PC commands to motors without voltage, milliseconds: the motion lasts 300.
const UNPOWERED_WITHIN: f64 = 350.0;
/// The time within which a command is answered that is not lost, milliseconds: it is repeated after 200.
const ANSWERED_WITHIN: f64 = 100.0;

/// A robot that a PC at its USB socket has started.
fn driving(world: &World) -> Pico {
    driving_with(world, "noise off")
}

/// The same after an order to the emulator.
fn driving_with(world: &World, order: &str) -> Pico {
    let mut pico = Pico::switched_on(world.board.elf, world, &map(), &image(&configuration()));
    pico.ask(order);
    pico.ask("plug");
    pico.speak_over(Wire::Usb);
    assert_eq!(pico.hello().reset, ResetCause::PowerOn);
    done(pico.order(&Command::SetPose(start())));
    done(pico.order(&Command::Start));
    pico.run(1_000, &[]);
    assert!(pico.state().is_enabled);
    pico.events();
    pico
}

/// Renews the motion for so many times 100 ms; returns the largest error of the estimates, metres.
fn drive(pico: &mut Pico, times: u32) -> f64 {
    let mut worst = 0.0_f64;
    for _ in 0..times {
        let before = pico.heard.len();
        answered(pico, &Command::Drive(MOTION));
        pico.run(80, &[]);
        for message in pico.take_after(before) {
            let Telemetry::Estimate(estimate) = message else { continue };
            let pose = estimate.state.pose();
            worst = worst.max(pico.truth(estimate.at).distance(pose.x.0, pose.y.0));
        }
    }
    worst
}

/// A command whose frame is not lost.
fn answered(pico: &mut Pico, command: &Command) {
    let sent = pico.state().ms;
    done(pico.order(command));
    let after = pico.state().ms - sent;
    assert!(after <= ANSWERED_WITHIN, "{command:?}: answered after {after} ms");
}

/// The loop has missed nothing, and no reset has come.
fn undisturbed(pico: &mut Pico) -> LoopStatus {
    let status = pico.loop_status();
    assert!(status.running && status.faults.deadlines == 0, "{status:?}");
    assert_eq!(pico.events(), []);
    status
}

/// Before anybody has spoken, both links have the telemetry; then only that of the PC.
#[test]
#[ignore = "cargo xtask chips"]
fn a_pc_at_the_usb_socket_drives_and_the_uart_is_silent() {
    let mut pico = driving(&world());
    assert!(pico.arrived_elsewhere() > 20);
    let worst = drive(&mut pico, 60);
    assert_eq!(pico.arrived_elsewhere(), 0);
    let compared = beside::compare(&pico.heard, &map(), &configuration());
    assert!(worst <= 0.015 && compared.estimates > 60, "{worst} m, {compared:?}");
    let status = undisturbed(&mut pico);
    assert_eq!(status.commands.skipped(), 0, "{:?}", status.commands);
    assert_eq!(pico.missing(), 0);
    row(
        Table::Measured,
        &[&"position in 6 s of driving over USB, at most", &format!("{:.1} mm", 1e3 * worst)],
    );
    polls("driven over USB", pico.polls());
}

/// The board of an XRP has the same port.
#[test]
#[ignore = "cargo xtask chips"]
fn an_xrp_answers_at_its_usb_socket() {
    let mut xrp = Pico::switched_on(XRP.elf, &world_of(XRP), &map(), &[]);
    xrp.ask("plug");
    xrp.speak_over(Wire::Usb);
    xrp.hello();
    let refused = CommandResult::Refused(CommandError::NoConfiguration);
    assert_eq!(xrp.order(&Command::Start), Some(refused));
    xrp.arrived_elsewhere();
    assert_eq!(xrp.order(&Command::Start), Some(refused));
    assert_eq!(xrp.arrived_elsewhere(), 0);
}

/// The robot stands, takes the next command over the UART, and over USB when it is plugged again: of the cable nothing is lost but
/// telemetry, and the half of a frame.
#[test]
#[ignore = "cargo xtask chips"]
fn usb_that_is_unplugged_in_a_frame_loses_no_command_after_it() {
    let mut pico = driving(&world());
    drive(&mut pico, 10);
    let cut = pico.state().ms;
    answered(&mut pico, &Command::Drive(MOTION));
    let frame = pico.next_frame(&Command::Drive(MOTION));
    let (half, _) = frame.split_at(frame.len() / 2);
    pico.run(2, half);
    pico.ask("unplug");
    pico.run(1_500, &[]);
    let unpowered = pico.state().powered - cut;
    assert!(unpowered > 0.0 && unpowered <= UNPOWERED_WITHIN, "{unpowered} ms");

    pico.speak_over(Wire::Uart);
    answered(&mut pico, &Command::Drive(MOTION));
    let worst = drive(&mut pico, 10);
    assert!(worst <= 0.015, "{worst} m");
    let status = undisturbed(&mut pico);
    assert_eq!(status.commands.skipped(), 1, "{:?}", status.commands);

    // The UART falls silent, and the cable is plugged again.
    pico.ask("plug");
    pico.run(1_500, &[]);
    pico.speak_over(Wire::Usb);
    drive(&mut pico, 10);
    let status = undisturbed(&mut pico);
    assert!(status.commands.skipped() <= 2, "{:?}", status.commands);
    row(
        Table::Measured,
        &[
            &"from the last motion over USB, which is unplugged in the next frame, to motors without voltage",
            &format!("{unpowered:.0} ms"),
        ],
    );
    polls("USB unplugged in a frame, plugged again", pico.polls());
}

/// The PC sleeps for three seconds: afterwards the first command is taken.
#[test]
#[ignore = "cargo xtask chips"]
fn a_pc_that_sleeps_loses_only_telemetry() {
    let mut pico = driving(&world());
    drive(&mut pico, 5);
    pico.ask("suspend");
    pico.run(3_000, &[]);
    assert!(pico.messages().is_empty());
    pico.ask("resume");
    drive(&mut pico, 10);
    let status = undisturbed(&mut pico);
    assert_eq!(status.commands.skipped(), 0, "{:?}", status.commands);
    polls("the PC at the USB socket sleeps", pico.polls());
}

/// Random bytes at the UART are no PC that speaks.
#[test]
#[ignore = "cargo xtask chips"]
fn noise_at_the_uart_does_not_close_usb() {
    let mut pico = driving_with(&world(), "noise on");
    drive(&mut pico, 10);
    undisturbed(&mut pico);
    polls("driven over USB, noise at the UART", pico.polls());
}
