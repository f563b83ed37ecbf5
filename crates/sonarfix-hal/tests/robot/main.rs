//! The loop on the shipped drivers, over pins of a simulated room.
#![cfg(test)]
#![expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a few seconds and a few metres fit into any of these types"
)]

mod absolute;
#[cfg(feature = "async")]
mod asynch;
mod faults;
mod properties;
mod rig;
mod unmeasured;
