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
//! | [`units`], [`trig`], [`pose`] | quantities; sine and cosine with the same bits on every target; frames |
//! | [`map`] | walls |
//! | `state`, `estimate` | the seven states: public form and filter coordinates |
//! | [`motion`], `process_noise` | motion model and its noise, eqs. (4) and (7) to (9) |
//! | [`gyro`] | a gyro: parameters, and the integral of its rate |
//! | [`absolute`] | measurements of heading, position and pose, eqs. (40), (41) and (43) |
//! | [`range`] | measurement model, eqs. (11) to (13) |
//! | [`config`] | parameters |
//! | `covariance` | P: eqs. (5), (6), (10), (14) and (18) to (20) |
//! | `accumulated` | motion that is not yet applied to P, eqs. (27) to (29) |
//! | [`ekf`] | the filter, eqs. (4) to (6) |
//! | `outcome`, `odometry` | outcome of a measurement; plausibility of a travel |
//! | `gyro_fusion` | turns of a gyro beside the wheels, eqs. (36) to (39) |
//! | `visibility` | which walls can be measured |
//! | `reflector` | what of the map may answer a ping |
//! | `gating` | gate, downweighting and covariance inflation, eqs. (15) to (17) |
//! | [`health`] | verdict on the estimate, eq. (23) |
//! | `unseen` | growth of P without odometry, eq. (24) |
//! | [`aim`] | planner: the wall to measure next, eqs. (21) and (22) |
//! | `alternatives` | other reflectors that may have returned an echo, eq. (25) |
//! | [`localizer`] | all of them together |
//! | [`search`] | global localization without a start pose |
//! | [`navigator`] | localizer and search together: tracking, searching, and the hand-over |
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

pub mod absolute;
mod accumulated;
pub mod aim;
mod alternatives;
pub mod config;
mod covariance;
pub mod echo;
pub mod ekf;
mod elementary;
mod estimate;
mod gating;
pub mod gyro;
mod gyro_fusion;
pub mod health;
pub mod localizer;
pub mod map;
pub mod motion;
pub mod navigator;
mod numeric;
mod odometry;
mod outcome;
pub mod pose;
mod process_noise;
pub mod range;
mod reflector;
pub mod search;
pub mod servo;
mod state;
pub mod trig;
pub mod units;
mod unseen;
mod vector;
mod visibility;

/// The parts of the filter as [`ekf::Ekf`] uses them, for benchmarks that count them one by one.
/// Exempt from semantic versioning.
#[cfg(feature = "unstable-kernel")]
#[doc(hidden)]
pub mod kernel {
    pub use crate::accumulated::{AccumulatedMotion, CalibratedDrive, WheelNoise};
    pub use crate::covariance::{Correction, Covariance};
    pub use crate::estimate::FilterEstimate;
    pub use crate::process_noise::{AccumulatedRandomWalk, NoiseDensities};
}
