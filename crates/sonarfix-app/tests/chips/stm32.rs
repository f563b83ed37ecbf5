//! The STM32F405 and the Nucleo-F446RE in QEMU, with a robot in a room: the scenarios of the Pico, as far as the emulated chip goes.

use sonarfix_link::baked;
use sonarfix_link::message::{ImageStatus, ResetCause};

use crate::commands::{configuration_is_kept, poses_are_taken};
use crate::pico::{Board, NUCLEO, Pico, STM32F405, World};
use crate::results::{Table, row};
use crate::search::find_from_nothing;
use crate::stops::stop;
use crate::{configuration, cut_while_a_pose_is_written, drive, image, map, world_of};

/// The boards, and what precedes their measurements.
const BOARDS: [(&Board, &str); 2] = [(NUCLEO, "Nucleo, "), (STM32F405, "STM32F405, ")];

/// Each of the boards in the room.
fn each() -> impl Iterator<Item = (World, &'static str)> {
    BOARDS.into_iter().map(|(board, name)| (world_of(board), name))
}

#[test]
#[ignore = "cargo xtask chips"]
fn with_images_hello_has_their_checksums() {
    for (world, name) in each() {
        let config = configuration();
        let mut robot = Pico::switched_on(world.board.elf, &world, &map(), &image(&config));
        let hello = robot.hello();
        let valid = ImageStatus::Valid(baked::checksum(&config));
        assert_eq!((hello.configuration, hello.reset), (valid, ResetCause::PowerOn), "{name}");
        assert!(matches!(hello.map, ImageStatus::Valid(_)), "{name}: {hello:?}");
    }
}

#[test]
#[ignore = "cargo xtask chips"]
fn ninety_seconds_of_driving_stay_within_15_mm_and_have_the_bits_of_the_pc() {
    for (world, name) in each() {
        let measured = drive(&world);
        row(
            Table::Measured,
            &[
                &format!("{name}90 s drive: position within; heading within; pings"),
                &format!(
                    "{:.1} mm; {:.2}°; {}",
                    1e3 * measured.worst,
                    measured.turn.to_degrees(),
                    measured.pings
                ),
            ],
        );
    }
}

#[test]
#[ignore = "cargo xtask chips"]
fn a_pose_that_is_set_while_driving_is_taken() {
    for (world, name) in each() {
        poses_are_taken(&world, name);
    }
}

#[test]
#[ignore = "cargo xtask chips"]
fn a_configuration_that_was_sent_survives_resets_of_every_kind() {
    for (world, _) in each() {
        configuration_is_kept(&world);
    }
}

/// An overflow of the stack locks the core up, which ends the emulator.
#[test]
#[ignore = "cargo xtask chips"]
fn a_program_that_stops_stops_the_motors() {
    for (world, name) in each() {
        stop(&world, name, &[("hang", ResetCause::Watchdog), ("fault", ResetCause::Software)]);
    }
}

/// A step is a word that changes; the record of a pose has at least 22 and at most 24.
#[test]
#[ignore = "cargo xtask chips"]
fn a_power_cut_loses_no_record() {
    for (world, name) in each() {
        let (cuts, _) = cut_while_a_pose_is_written(&world, (1..25).step_by(2));
        assert!(cuts >= 11, "{name}{cuts} cuts");
    }
}

/// The motor code drives, because these programs take no motions from a PC.
#[test]
#[ignore = "cargo xtask chips"]
fn a_robot_without_a_pose_finds_it_within_a_minute() {
    for (world, name) in each() {
        find_from_nothing(&world, name, None);
    }
}
