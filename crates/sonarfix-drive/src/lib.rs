//! Controllers for a robot that [`sonarfix`] localizes. The localizer uses none of them.
//!
//! | module | input | output |
//! |---|---|---|
//! | [`wheel`] | ticks of an encoder, a wheel speed | the duty of the motor |
//!
//! # Features
//! - `defmt`: derives `defmt::Format` for the public types.

#![no_std]
#![forbid(unsafe_code)]

pub mod wheel;
