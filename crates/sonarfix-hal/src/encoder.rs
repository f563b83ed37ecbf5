//! Wheel encoders: from edges or a hardware counter to metres rolled.
//!
//! Responsibilities, one file each:
//! - [`Counter`]: what a position counter is, whoever counts (a timer in encoder mode, a chip on
//!   a bus, or software), and how its wrap-around is undone;
//! - [`Quadrature`]: counting in software, from two pins;
//! - [`WheelGeometry`]: how far one tick rolls the wheel.
//!
//! *Tick*: one count. A decoder that counts every edge of both channels (x4) makes four ticks of
//! one period of a channel.
//!
//! # Non-finite policy
//! Counts are integers; [`WheelGeometry`] refuses a diameter or a resolution that is not finite.

mod counter;
mod quadrature;
mod wheel;

pub(crate) use counter::Unwrapped;
pub use counter::{Count16, Count32, Counter};
pub use quadrature::{Quadrature, TickCount};
pub use wheel::{GeometryError, WheelGeometry, Wheels};
