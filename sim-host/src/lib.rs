//! Simulates, measures and replays the Sonarfix localizer on a PC.
//!
//! The localizer here is the one that a robot is flashed with; everything around it is simulated.
//! [`simulate`] runs a scenario once, [`monte_carlo`] many times; [`bound`] is what no estimator
//! could beat, [`dense`] the textbook filter that the shipped one is compared with.

pub mod angle;
pub mod bound;
pub mod claim;
pub mod cli;
pub mod convert;
pub mod dense;
pub mod fault_table;
pub mod floor_plan;
pub mod health_page;
pub mod kidnapped;
pub mod monitor;
pub mod monte_carlo;
pub mod observe;
pub mod odometry;
pub mod pil;
pub mod pins;
pub mod plan;
pub mod plant;
pub mod replay;
pub mod report;
pub mod simulate;
pub mod sonar_model;
pub mod statistics;
pub mod trace;
pub mod trace_csv;
pub mod world;

/// The names of the filter's states, in its order.
pub const STATES: [&str; 7] =
    ["x", "y", "heading", "scale_right", "scale_left", "track_width", "range_scale"];

/// The README's example, so that the tests compile it.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
