//! Drivers for the sensors of a small wheeled robot, and the loop that joins them to the
//! [`sonarfix`] localizer.
//!
//! `no_std`, no allocation, no panic, no `unsafe`, no global, and never a wait: everything is
//! polled with the time, by firmware, simulator and emulator alike. The hardware is reached
//! through `embedded-hal` 1.0, so any board that has it will do.
//!
//! | module | what it is for |
//! |---|---|
//! | [`encoder`] | counters of any width, a software quadrature decoder, ticks to metres |
//! | [`servo`] | bearing to pulse, and a model of where the servo points now |
//! | [`ranger`] | ultrasonic rangers: HC-SR04 and kin, LV-MaxSonar, SRF02, SRF08 |
//! | [`robot`] | the loop: encoder ticks, and the sonar's aim, turn, settle, ping, listen, fuse |
//!
//! [`robot::Robot`] is the way in; its example is a whole fix.
//!
//! *Time* is a `fugit` instant in microseconds that the caller passes; one clock for everything,
//! the stamps of interrupts included. *Bearing*: relative to the robot's heading, positive to
//! the left.
//!
//! # Non-finite policy
//! Counts, edges and times are integers here; what is made of them, travel and ranges, is finite.
//! NaN and infinity in a calibration, a geometry, a temperature or a bearing to point at are typed
//! errors, and nothing has moved (the modules say which).
//!
//! # Features
//! - `async`: the same drivers behind the waits of `embedded-hal-async` (module `asynch`).
//! - `defmt`: derives `defmt::Format` for the public types that hold data.
//! - `serde`: derives `Serialize` and `Deserialize` for those that a robot tells of its loop.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

#[cfg(feature = "async")]
pub mod asynch;
pub mod encoder;
pub mod ranger;
pub mod robot;
pub mod servo;
mod time;
