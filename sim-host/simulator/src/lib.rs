//! Simulates a robot with the Sonarfix localizer, and measures the localizer.
//!
//! The localizer is the shipped one; everything around it is simulated. [`simulate`] runs a scenario
//! once, [`monte_carlo`] many times. [`bound`] is the posterior Cramér–Rao bound, [`dense`] the
//! textbook filter in `f64` that the shipped one is compared with. This package opens no file and
//! uses no terminal.

pub mod angle;
pub mod bound;
pub mod dense;
pub mod dense_gyro;
pub mod integrity;
pub mod mismatch;
pub mod monte_carlo;
pub mod observe;
pub mod odometry;
pub mod pins;
pub mod plant;
pub mod progress;
mod random;
pub mod row;
mod run_result;
pub mod simulate;
pub mod spread;
pub mod statistics;
pub mod text;
pub mod time;
pub mod trace;
pub mod world;

/// The names of the filter's states, in the order of the state vector.
pub const STATES: [&str; 7] =
    ["x", "y", "heading", "scale_right", "scale_left", "track_width", "range_scale"];

/// The example in the README of the core, so that the tests compile it.
#[cfg(doctest)]
#[doc = include_str!("../../../crates/sonarfix/README.md")]
pub struct Readme;
