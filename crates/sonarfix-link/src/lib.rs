//! The link between a robot and a PC: telemetry in one direction, commands in the other; and the robot's
//! configuration as an image in its flash.
//!
//! Both ends use the same definitions. `no_std`, no allocation, no panic, no `unsafe`, no clock, no global. The crate
//! is independent of the transport: a UART, a socket or a file.
//!
//! | module | |
//! |---|---|
//! | [`message`] | the messages: [`Telemetry`], [`Command`] |
//! | [`frame`] | the frame around a message: [`Sender`] |
//! | [`receiver`] | finds the frames in a stream of bytes: [`Receiver`] |
//! | [`counters`] | counts what a receiver has read and skipped: [`ReceiverCounters`] |
//! | [`gaps`] | counts lost frames by their sequence numbers: [`Gaps`] |
//! | [`session`] | admits a command once, in order, and only in the present session: [`Session`] |
//! | [`reporter`] | turns a poll of the robot's loop into telemetry: [`Reporter`] |
//! | [`baked`] | the configuration image |
//!
//! The frame format and the rule for versions are in `docs/link.md`.
//!
//! ```
//! use sonarfix_link::{
//!     Command, CommandResult, Receiver, Sender, Session, SessionCommand, Telemetry, frame,
//! };
//!
//! // The PC sends a command. Line noise precedes the frame.
//! let mut buffer = frame::EMPTY;
//! let mut wire = vec![0x17, 0x2a];
//! let mut sender = Sender::starting_at(7);
//! let stop = SessionCommand { session: 0, command: Command::Stop };
//! wire.extend_from_slice(sender.frame(&stop, &mut buffer));
//!
//! // The robot receives, executes and acknowledges it.
//! let mut receiver = Receiver::<SessionCommand>::new();
//! let mut session = Session::default();
//! let mut answers = Vec::new();
//! for byte in wire {
//!     if let Some(frame) = receiver.push(byte) {
//!         answers.push(session.answer(&frame, 1, |command| {
//!             assert_eq!(*command, Command::Stop);
//!             CommandResult::Done
//!         }));
//!     }
//! }
//! assert!(matches!(answers[..], [Telemetry::Ack(ack)] if ack.sequence == 7));
//! assert_eq!(receiver.counters().corrupt, 1);
//! ```
//!
//! # Features
//! - `defmt`: derives `defmt::Format` for the public types that hold data.

#![no_std]
#![forbid(unsafe_code)]

pub mod baked;
pub mod counters;
pub mod frame;
pub mod gaps;
pub mod message;
pub mod receiver;
pub mod reporter;
pub mod session;

pub use counters::ReceiverCounters;
pub use frame::{Frame, Sender, VERSION};
pub use gaps::Gaps;
pub use message::{
    Ack, Command, CommandResult, Estimate, Hello, Motion, Ping, SessionCommand, Telemetry,
};
pub use receiver::Receiver;
pub use reporter::Reporter;
pub use session::Session;
