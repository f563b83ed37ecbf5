//! Tests of the link, by topic.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test should stop")]

mod baked;
mod damage;
mod golden;
mod messages;
mod reporter;
mod session;
mod sizes;
mod streams;
mod wire;
