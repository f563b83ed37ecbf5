//! The controllers on models of what they control.
#![expect(clippy::unwrap_used, reason = "a test should stop")]

mod motor;
mod obstacles;
mod pursuit;
mod search_motion;
mod wheel;
