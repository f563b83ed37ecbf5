//! Drivers for the sensors of a small wheeled robot, and the loop that connects them to the
//! [`sonarfix`] localizer.
//!
//! `no_std`, no allocation, no panic, no `unsafe`, no global. Nothing waits, except [`bus::TwoWire`] for the bits of its bus: firmware, simulator and emulator
//! poll the same code with the time as an argument. The hardware is accessed through `embedded-hal` 1.0.
//!
//! | module | |
//! |---|---|
//! | [`config`] | the description of a robot: everything that its builder measures or chooses |
//! | [`encoder`] | counters of any width, a software quadrature decoder, edges to metres |
//! | [`servo`] | bearing to pulse, and a model of the servo's present bearing |
//! | [`ranger`] | ultrasonic rangers: HC-SR04 and compatible ones, LV-MaxSonar, SRF02, SRF08; of light: VL53L0X, VL53L1X |
//! | [`gyro`] | gyros: MPU-6050 and compatible ones |
//! | [`bus`] | an I²C master on two pins, whose transfers always end; one bus for several drivers |
//! | [`robot`] | the loop: encoder samples, and the measurement cycle of the sonar |
//!
//! Start with [`robot::Robot`], whose example is a complete fix.
//!
//! *Time* is a `fugit` instant in microseconds that the caller passes; all times are of one clock, including the
//! time stamps of interrupts. *Bearing*: relative to the robot's heading, positive to
//! the left.
//!
//! # Non-finite policy
//! Counts, edges and times are integers, so travel and ranges are finite. NaN and infinity in a calibration, a
//! geometry, a temperature or a commanded bearing are typed errors without any other effect.
//!
//! # Features
//! - `async`: `embedded-hal-async` functions over the same drivers (module `asynch`).
//! - `light`, `gyro`, `rangers`, `absolute`, `reflectors`, `informative`, `mount` (default): the parts of the localizer. A configuration
//!   that asks for one that is not linked is refused by name ([`config::RobotConfig::check_linked`]).
//! - `search` (default): a loop that searches for its pose when it does not know it, by `sonarfix-search`.
//! - `defmt`: derives `defmt::Format` for the public types that hold data.
//! - `serde`: derives `Serialize` and `Deserialize` for configuration and telemetry.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

#[cfg(feature = "async")]
pub mod asynch;
pub mod bus;
pub mod config;
pub mod encoder;
pub mod gyro;
pub mod ranger;
pub mod robot;
pub mod servo;
mod time;
