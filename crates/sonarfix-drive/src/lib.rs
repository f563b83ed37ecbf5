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

pub mod obstacles;
pub mod pursuit;
pub mod wheel;
