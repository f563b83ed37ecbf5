//! A robot's electronics, down to the pins: what a board would offer to the drivers of
//! `sonarfix-hal`, which run on it unmodified.
//!
//! ```text
//!   drivers and loop     sonarfix-pil's wires            the world's side
//!   Counter     ◀──────── Sensors ◀── Quadrature ◀── A, B ── EncoderDisc ◀── wheel
//!   Servo       ────────▶ Actuators ── duty ────────────────▶ ServoPlant
//!   PulseRanger ────────▶ Actuators ── trigger ─────────────▶ SonarBoard ──▶ ping
//!   EchoCapture ◀──────── Sensors ◀─── edges, stamped ─────── SonarBoard ◀── echo
//! ```
//!
//! - [`wires`]: the channels of an encoder, and the shipped decoder's count of them;
//! - [`disc`]: an encoder's disc, which makes the edges;
//! - [`board`]: a sonar's board, which turns a trigger into the pulse of an echo;
//! - [`devices`]: what the drivers are told of a scenario's devices;
//! - [`faults`]: what goes wrong on the way.

pub mod board;
pub mod devices;
pub mod disc;
pub mod faults;
pub mod wires;
