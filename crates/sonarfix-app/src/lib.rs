//! What a sonarfix robot runs, whatever its board: [`App`].
//!
//! `no_std`, no allocation, no panic, no `unsafe`, no clock, no global, and never a wait. A board
//! hands it its devices, its link's bytes, its flash and the time; everything else is here, and
//! is tested on a PC.
//!
//! | module | what it is for |
//! |---|---|
//! | this one | [`App`]: when the robot's loop runs, what commands do, what is told when |
//! | [`store`] | calibration and last pose, over a power loss |
//! | [`Check`] | whether the sensors are there at all, while the loop does not run |
//! | [`Flashed`] | map and configuration, as they lie in flash |
//!
//! # Features
//! - `defmt`: derives `defmt::Format` for the public types that hold data, and logs what
//!   happens (`log`).

#![no_std]
#![forbid(unsafe_code)]

mod app;
mod check;
mod flashed;
#[cfg(feature = "defmt")]
pub mod log;
pub mod store;
mod time;

pub use app::{App, Body, Link, Polled};
pub use check::Check;
pub use flashed::Flashed;
