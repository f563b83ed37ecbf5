//! Wheel encoders: from edges or a hardware counter to travel in metres.
//!
//! - [`Counter`]: a position counter (a timer in encoder mode, a chip on a bus, or software), and the removal of its
//!   wrap-around;
//! - [`Quadrature`]: a decoder in software, from two pins;
//! - [`WheelGeometry`]: the travel of the wheel from one tick to the next.
//!
//! *Tick*: one count. A decoder that counts every edge of both channels (x4) counts four ticks in a period of a
//! channel.
//!
//! # Non-finite policy
//! Counts are integers; [`WheelGeometry`] refuses a diameter or a resolution that is not finite.

mod counter;
mod quadrature;
mod wheel;

pub use counter::{Count16, Count32, Counter, Unwrapped};
pub use quadrature::{Quadrature, TickCount};
pub use wheel::{GeometryError, WheelGeometry, Wheels};
