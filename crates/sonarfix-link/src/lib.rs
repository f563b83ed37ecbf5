//! The wire between a robot and a PC: telemetry one way, commands the other, one definition for
//! both ends; and the robot's configuration as the bytes that it reads from its flash.
//!
//! `no_std`, no allocation, no panic, no `unsafe`, no clock, no global. Nothing here knows what
//! carries the bytes: a UART, a socket, a file.
//!
//! | module | what it is for |
//! |---|---|
//! | [`message`] | what is said: [`Telemetry`], [`Command`] |
//! | [`frame`] | how it is sent: [`Sender`] |
//! | [`receiver`] | how it is found again in whatever comes in: [`Receiver`], [`Gaps`] |
//! | [`answered`] | that a command sent twice is not done twice: [`Answered`] |
//! | [`reporter`] | what a robot says when: [`Reporter`] |
//! | [`baked`] | the configuration in flash |
//!
//! The frame and the rule for versions are in `docs/link.md`.
//!
//! ```
//! use sonarfix_link::{Command, Outcome, Receiver, Sender, Telemetry, answered::Answered, frame};
//!
//! // The PC sends a command; the line picks up a spark before it.
//! let mut buffer = frame::EMPTY;
//! let mut wire = vec![0x17, 0x2a];
//! wire.extend_from_slice(Sender::<Command>::starting_at(7).frame(&Command::Stop, &mut buffer));
//!
//! // The robot finds it, does it, and answers.
//! let mut receiver = Receiver::<Command>::new();
//! let mut answered = Answered::default();
//! let mut answers = Vec::new();
//! for byte in wire {
//!     if let Some(frame) = receiver.push(byte) {
//!         answers.push(answered.answer(&frame, |command| {
//!             assert_eq!(*command, Command::Stop);
//!             Outcome::Done
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

pub mod answered;
pub mod baked;
pub mod frame;
pub mod message;
pub mod receiver;
pub mod reporter;

pub use answered::Answered;
pub use frame::{Frame, Sender};
pub use message::{Ack, Command, Estimate, Hello, Look, Outcome, Telemetry};
pub use receiver::{Counters, Gaps, Receiver};
pub use reporter::Reporter;

/// The version of the link: of the frame's contents, not of its outside, which never changes. It
/// goes up whenever the bytes of any message change (`docs/link.md`).
pub const VERSION: u8 = 1;
