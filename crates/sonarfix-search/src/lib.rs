//! Global localization for [`sonarfix`]: the pose of a robot that starts anywhere in its map, or was moved.
//!
//! | module | contents |
//! |---|---|
//! | [`search`] | the search for the pose in a bounded memory and in bounded slices |
//! | [`navigator`] | localizer and search together: tracking, searching, and the hand-over |
//!
//! # Features
//! - `defmt`: derives `defmt::Format` for the public types.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod navigator;
pub mod search;
