//! Every message fits into a frame.

use sonarfix_link::frame::{FRAME_MAX, MESSAGE_MAX};
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
    let longest = (0..6)
        .flat_map(|variant| {
            let telemetry =
                (0..TELEMETRY).map(move |kind| length(&telemetry(kind, &mut Largest { variant })));
            let commands =
                (0..COMMANDS).map(move |kind| length(&command(kind, &mut Largest { variant })));
            telemetry.chain(commands)
        })
        .max()
        .unwrap();
    assert_eq!(longest, LONGEST);
    assert!(longest <= MESSAGE_MAX);
}

/// The longest of all, `SetConfiguration`: 5 for the session, 43 · 4 for the numbers, 16 · 10 for the times, 13 for
/// variants (of command, schedule, policy, gyro and whether it is inverted, ranger, whether a wheel is mirrored, of the motor policy, start, region). The longest of the robot's,
/// `Estimate`, has 110, of which an hour after the start 20 are not sent.
const LONGEST: usize = 350;

#[test]
fn the_frame_is_as_long_as_documented() {
    assert_eq!((MESSAGE_MAX, FRAME_MAX), (352, 364));
}
