//! The application of a sonarfix robot, independent of its board: [`App`].
//!
//! `no_std`, no allocation, no panic, no `unsafe`, no clock, no global; it never waits. A board provides its devices, the
//! bytes of its link, its flash and the time. Everything else is in this crate and is tested on a PC.
//!
//! | module | |
//! |---|---|
//! | this one | [`App`]: starts and stops the loop, executes commands, sends telemetry |
//! | [`store`] | calibration, last pose and a sent configuration in flash |
//! | [`boots`] | resets in a row, after which the store is not used |
//! | [`watchdog`] | when a board feeds its watchdog |
//! | [`Check`] | the check of the devices while the loop does not run |
//! | [`FlashContents`] | map and configuration in flash |
//!
//! # Features
//! - `drive`: `App::motion`, the motion that the PC commands. Not a default: the motor code must obey it.
//! - `defmt`: derives `defmt::Format` for the public types that hold data, and logs
//!   events (`log`).

#![no_std]
#![forbid(unsafe_code)]

mod app;
pub mod boots;
mod check;
mod flash_contents;
#[cfg(feature = "defmt")]
pub mod log;
pub mod store;
mod time;
pub mod two_links;
pub mod watchdog;

pub use app::{App, Board, Link, Polled};
pub use check::Check;
pub use flash_contents::FlashContents;
