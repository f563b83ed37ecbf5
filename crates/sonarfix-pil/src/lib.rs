//! Processor in the loop: the loop that ships, on a microcontroller whose devices are messages.
//!
//! ```text
//!   a PC simulates the world                      a microcontroller, emulated or real
//!   counts, edges ──── Request ────▶ Wires ──▶ drivers ──▶ App, Localizer
//!   servo, trigger ◀── Answer ────── Wires ◀── drivers ◀──┘   and every bit of the estimate
//! ```
//!
//! Time is the PC's: nothing happens between two messages, so a run is the same however long the
//! microcontroller takes. The same [`Device`] runs on the PC, so what both answer can be compared
//! byte by byte.
//!
//! `no_std`, no allocation, no panic, no `unsafe`, no clock, no global.
//!
//! | module | what it is for |
//! |---|---|
//! | [`message`] | what is asked and answered |
//! | [`wires`] | what stands at the pins of the devices |
//! | [`board`] | the drivers of a robot on those wires |
//! | [`device`] | what answers: a localizer alone, or the shipped loop |
//! | [`line`](mod@line) | how messages are carried: frames over any byte stream |
//! | [`serve`](mod@serve) | what the microcontroller's program does |

#![no_std]
#![forbid(unsafe_code)]

pub mod board;
pub mod device;
pub mod line;
pub mod message;
mod ram_flash;
pub mod serve;
pub mod wires;

pub use board::{Board, SetupError};
pub use device::{Device, Refusal};
pub use line::{Line, LineError};
pub use message::{Answer, Begin, Belief, Request};
pub use serve::{Meter, serve};
pub use wires::{Actuators, Counted, Sensors, Wires};
