//! Localization of a small wheeled robot: two wheel encoders, one ultrasonic ranger on a servo, a map
//! of walls.
//!
//! `no_std`; no allocation, panic, `unsafe`, clock or global. The crate receives wheel travels and
//! ranges with their times, and returns the pose, its covariance, the calibration of the robot, and the
//! bearing of the next ping.
//!
//! [`localizer::Localizer`] is the entry point. The modules, from the bottom; each uses only those
//! above it:
//!
//! | module | contents |
//! |---|---|
//! | [`geometry`] | quantities, frames, sine and cosine with the same bits on every target |
//! | [`map`] | walls, in a slice or in a baked image |
//! | `state` | the seven states: public form and filter coordinates |
//! | [`sensor`] | measurement models and parameters: sonar, light, gyro, heading, position, pose |
//! | [`filter`] | motion model, process noise, covariance, prediction and correction |
//! | [`config`] | the parameters of a localizer, checked once |
//! | [`association`] | which walls can be measured, what may answer a ping, how far an echo is believed |
//! | [`aim`] | planner: the wall to measure next |
//! | [`health`] | verdict on the estimate |
//! | [`localizer`] | all of them together |
//!
//! Equation numbers are those of `docs/model.md`; every function that implements one has a banner
//! `===== Eq. (n)`.
//!
//! # Features
//! - `defmt`: derives `defmt::Format` for the public types.
//! - `serde`: derives `Serialize` and `Deserialize` for inputs and outputs of the localizer.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod aim;
pub mod association;
pub mod config;
pub mod filter;
pub mod geometry;
pub mod health;
pub mod localizer;
pub mod map;
pub mod sensor;
mod state;

/// The parts of the filter as [`filter::ekf::Ekf`] uses them, for benchmarks that count them one by one.
/// Exempt from semantic versioning.
#[cfg(feature = "unstable-kernel")]
#[doc(hidden)]
pub mod kernel {
    pub use crate::filter::covariance::{Correction, Covariance, Transition};
    pub use crate::filter::motion::LinearizedMotion;
    pub use crate::filter::process_noise::{AccumulatedRandomWalk, NoiseDensities, ProcessNoise};
    pub use crate::state::estimate::FilterEstimate;
}
