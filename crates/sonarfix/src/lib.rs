//! Tells a small wheeled robot where it is: two wheel encoders, one ultrasonic ranger on a servo,
//! a map of walls.
//!
//! `no_std`, no allocation, no panic, no `unsafe`, no clock, no global. The crate is only told
//! things (wheel travels and ranges, each with its time) and answers with a pose, its covariance,
//! the robot's own calibration, and the bearing where the sonar should look next.
//!
//! [`localizer::Localizer`] is the way in; its example is a whole fix. The parts, from the bottom:
//!
//! | module | what it is for |
//! |---|---|
//! | [`units`], [`pose`], [`trig`] | quantities, frames, sine and cosine with the same bits everywhere |
//! | [`motion`] | how wheel travel moves the pose |
//! | [`map`], [`range`] | walls, and what the sonar hears from one |
//! | [`ekf`] | the filter: seven states, predicted and corrected |
//! | [`aim`] | which wall to look at |
//! | [`health`] | whether to believe the estimate |
//! | [`config`] | everything that can be set |
//!
//! Equation numbers in the docs are those of `docs/model.md`.
//!
//! # Features
//! - `defmt`: derives `defmt::Format` for the public types.
//! - `serde`: derives `Serialize` and `Deserialize` for those that a robot is told or tells.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod aim;
pub mod config;
mod covariance;
pub mod ekf;
pub mod health;
pub mod localizer;
pub mod map;
pub mod motion;
pub mod pose;
pub mod range;
mod state;
pub mod trig;
pub mod units;

/// The parts of the filter's kernel, as [`ekf::Ekf`] uses them: to be counted one by one. Outside
/// semver.
#[cfg(feature = "unstable-kernel")]
#[doc(hidden)]
pub mod kernel {
    pub use crate::covariance::{Correction, Covariance, Derivatives, Gain, RangeScale, SixStates};
    pub use crate::motion::{Noise, Rates, Step};
    pub use crate::state::{Mean, Remainder};
}
