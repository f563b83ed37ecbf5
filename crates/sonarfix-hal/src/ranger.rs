//! Rangers behind one trait: trigger, poll, and an echo or the reason for none.
//!
//! - [`Ranger`]: the interface of a driver; [`RangerSettings`]: its settings; [`Echo`], [`NoEcho`]: its results;
//! - [`Air`]: the speed of sound at a given temperature;
//! - [`PulseRanger`]: rangers whose echo pulse is as long as the time of flight (HC-SR04 and compatible ones,
//!   SRF04/05, LV-MaxSonar by pulse width), over an [`EchoLine`] that is [`Polled`], or [`Captured`] by an interrupt
//!   or by hardware with time stamps ([`StampedEdges`]);
//! - [`Srf`]: SRF02 and SRF08 on I²C;
//! - [`Vl53l1x`], [`Vl53l0x`]: time-of-flight rangers on I²C, which measure with light;
//! - [`OneOf`]: drivers for two kinds of rangers on one board.
//!
//! Not supported: rangers whose pulse encodes the range after the measurement (HRLV-MaxSonar, 1 µs/mm), because the
//! pulse does not contain the instant of the reflection.
//!
//! # Non-finite policy
//! The only floating-point input is the temperature; [`Air::at`] refuses values that are not finite, so every range
//! is finite.

mod air;
mod capture;
mod driver;
mod echo;
mod one_of;
mod polled;
mod pulse;
mod settings;
mod shot;
mod srf;
mod stamps;
mod vl53l0x;
mod vl53l1x;

pub use air::{Air, Celsius, TemperatureError};
pub use capture::{Captured, EchoCapture};
pub use driver::{Ranger, TriggerError, UnsupportedKind};
pub use echo::{Echo, NoEcho, Outcome};
pub use one_of::{OneOf, OneOfError};
pub use polled::Polled;
pub use pulse::{EchoLine, Pulse, PulseError, PulseRanger};
pub use settings::{PulseTiming, RangerKind, RangerSettings};
pub use srf::Srf;
pub use stamps::{StampedEdges, Stamps};
pub use vl53l0x::{Vl53l0x, Vl53l0xError};
pub use vl53l1x::{Vl53l1x, Vl53l1xError};
