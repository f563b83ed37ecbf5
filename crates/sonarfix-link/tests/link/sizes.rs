//! Every message fits into a frame.

use sonarfix_link::frame::{FRAME_MAX, MESSAGE_MAX, TELEMETRY_FRAME_MAX, TELEMETRY_MAX};
use sonarfix_link::message::Message;

use crate::messages::{COMMANDS, Largest, TELEMETRY, command, telemetry};
use crate::wire::{sent, to_stdvec};

fn length<M: Message>(message: &M) -> usize {
    let length = to_stdvec(message).len();
    let frame = sent(u16::MAX, message);
    assert!(!frame.is_empty() && frame.len() <= FRAME_MAX);
    length
}

#[test]
fn the_largest_of_every_message_fits() {
    // Every variant in turn; no enum has more than six.
    let of_robot = (0..6).flat_map(|variant| {
        (0..TELEMETRY).map(move |kind| length(&telemetry(kind, &mut Largest { variant })))
    });
    let of_commands = (0..6).flat_map(|variant| {
        (0..COMMANDS).map(move |kind| length(&command(kind, &mut Largest { variant })))
    });
    let [of_robot, of_commands] = [of_robot.max(), of_commands.max()];
    assert_eq!([of_robot, of_commands], [Some(LONGEST_OF_ROBOT), Some(LONGEST)]);
    const { assert!(LONGEST <= MESSAGE_MAX && LONGEST_OF_ROBOT <= TELEMETRY_MAX) };
}

/// The longest of all, `SetConfiguration` of a robot with three rangers, of which each further one has 14 · 4 for the numbers, 13 · 10 for the times
/// and 4 for variants.
const LONGEST: usize = 768;
/// The longest of the robot's, `ModeChanged`: the mode and an `Estimate`, of which an hour after the start 20 bytes are not sent.
const LONGEST_OF_ROBOT: usize = 111;

#[test]
fn the_frame_is_as_long_as_documented() {
    assert_eq!((MESSAGE_MAX, FRAME_MAX), (784, 798));
    assert_eq!((TELEMETRY_MAX, TELEMETRY_FRAME_MAX), (112, 123));
}
