//! Controllers for a robot that [`sonarfix`] localizes. The localizer uses none of them.
//!
//! | module | input | output |
//! |---|---|---|
//! | [`wheel`] | ticks of an encoder, a wheel speed | the duty of the motor |
//! | [`pursuit`] | the estimate, a route | the motion, and why the robot stands |
//! | [`obstacles`] | pings, the map | the distance of an unmapped object ahead, for [`pursuit`] |
//! | [`search_motion`] | the pings of a search, the travel of the wheels | the motion of a robot that searches for its pose |
//!
//! # Features
//! - `defmt`: derives `defmt::Format` for the public types.

#![no_std]
#![forbid(unsafe_code)]

use sonarfix::geometry::numeric::{at_least, at_most};

pub mod obstacles;
pub mod pursuit;
pub mod search_motion;
pub mod wheel;

/// The value within ± the limit.
fn clamped(value: f32, limit: f32) -> f32 {
    at_least(at_most(value, limit), -limit)
}
