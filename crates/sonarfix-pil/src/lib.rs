//! Processor in the loop: the shipped loop runs on a microcontroller whose devices are messages.
//!
//! ```text
//!   a PC simulates the world                      a microcontroller, emulated or real
//!   counts, edges ──── Request ────▶ Wires ──▶ drivers ──▶ App, Localizer
//!   servo, trigger ◀── Answer ────── Wires ◀── drivers ◀──┘   and every bit of the estimate
//! ```
//!
//! The PC provides the time, which stands still between two messages: a run does not depend on the speed of the
//! microcontroller. The same [`Session`] runs on the PC, so that both answers can be compared byte by byte.
//!
//! `no_std`, no allocation, no panic, no `unsafe`, no clock, no global.
//!
//! | module | |
//! |---|---|
//! | [`message`] | requests and answers |
//! | [`wires`] | the signals at the pins of the devices |
//! | [`board`] | the drivers of a robot on those wires |
//! | [`load`] | what arrives over the link |
//! | [`session`] | executes requests: a localizer alone, or the shipped loop |
//! | [`meter`] | counts the instructions and the stack of a call |
//! | [`line`](mod@line) | frames of messages over a stream of bytes |
//! | [`ram_flash`] | a flash in RAM |
//! | [`serve`](mod@serve) | the microcontroller's program |

#![no_std]
#![forbid(unsafe_code)]

pub mod board;
pub mod line;
pub mod load;
pub mod message;
pub mod meter;
pub mod ram_flash;
pub mod serve;
pub mod session;
pub mod wires;

pub use line::{Line, LineError};
pub use load::Load;
pub use message::{Answer, Begin, Request, RequestError, SessionKind, Snapshot};
pub use meter::{Meter, Unmetered};
pub use ram_flash::RamFlash;
pub use serve::serve;
pub use session::Session;
pub use wires::{
    Actuators, Counted, EchoSignals, GyroSignal, LightSignal, RangerActuators, Sensors, Wires,
};
