//! Drivers for the sensors of a small wheeled robot, for the [`sonarfix`] localizer.
//!
//! `no_std`, no allocation, no panic, no `unsafe`, no global, and never a wait: everything is
//! polled with the time, by firmware, simulator and emulator alike. The hardware is reached
//! through `embedded-hal` 1.0, so any board that has it will do.
//!
//! | module | what it is for |
//! |---|---|
//! | [`servo`] | bearing to pulse, and a model of where the servo points now |
//! | [`ranger`] | ultrasonic rangers: HC-SR04 and kin, LV-MaxSonar, SRF02, SRF08 |
//!
//! *Time* is a `fugit` instant in microseconds that the caller passes; one clock for everything,
//! the stamps of interrupts included. *Bearing*: relative to the robot's heading, positive to
//! the left.
//!
//! # Features
//! - `defmt`: derives `defmt::Format` for the public types that hold data.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod ranger;
pub mod servo;
mod time;
