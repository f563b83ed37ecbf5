//! I²C buses: a master on two pins, and one bus for several drivers.

mod shared;
mod two_wire;

pub use shared::SharedBus;
pub use two_wire::{MOST_STRETCHES, TwoWire};
