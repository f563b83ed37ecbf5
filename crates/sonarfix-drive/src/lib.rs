//! Controllers for a robot that [`sonarfix`] localizes. The localizer uses none of them.
//!
//! | module | input | output |
//! |---|---|---|
//! | [`wheel`] | ticks of an encoder, a wheel speed | the duty of the motor |
//! | [`pursuit`] | the estimate, a route | the motion, and why the robot stands |
//! | [`obstacles`] | pings, the map | the distance of an unmapped object ahead, for [`pursuit`] |
//!
//! # Features
//! - `defmt`: derives `defmt::Format` for the public types.

#![no_std]
#![forbid(unsafe_code)]

use sonarfix::geometry::numeric::{at_least, at_most};

pub mod obstacles;
pub mod pursuit;
pub mod wheel;

/// The value within ± the limit.
fn clamped(value: f32, limit: f32) -> f32 {
    at_least(at_most(value, limit), -limit)
}
