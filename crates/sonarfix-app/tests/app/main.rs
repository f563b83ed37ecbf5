//! The application on simulated hardware: flash whose power can be cut, pins of a small room.
#![cfg(test)]
#![expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    reason = "a few metres, seconds and sectors fit into any of these types"
)]

mod attacks;
mod commands;
mod devices;
#[cfg(feature = "drive")]
mod drive;
mod facts;
mod flash;
mod journal;
mod load;
mod motors;
mod next_poll;
mod power_cut;
mod random;
mod resume;
mod rig;
mod robot_file;
mod room;
mod save_policy;
mod search;
mod two_links;
