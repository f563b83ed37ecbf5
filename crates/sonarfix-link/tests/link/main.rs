//! Tests of the link, by what they are about.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test should stop")]

mod answered;
mod baked;
mod damage;
mod golden;
mod messages;
mod sizes;
mod streams;
mod wire;
