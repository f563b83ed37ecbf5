//! A robot's electronics, down to the pins: what a board would offer to the drivers of
//! `sonarfix-hal`, which run on it unmodified.
//!
//! ```text
//!   drivers and loop          wires                     the world's side
//!   Quadrature ◀── A, B ───────────────────────────── EncoderDisc ◀── wheel
//!   Servo ─────── duty ──────────────────────────────▶ ServoPlant
//!   PulseRanger ── trigger ───────────────────────────▶ SonarBoard ──▶ ping
//!   EchoCapture ◀─ edges, stamped by an "interrupt" ─── SonarBoard ◀── echo
//! ```
//!
//! - [`wires`]: the pins, as the drivers see them;
//! - [`disc`]: an encoder's disc, which makes the edges;
//! - [`board`]: a sonar's board, which turns a trigger into the pulse of an echo;
//! - [`devices`]: the drivers, set up for a scenario;
//! - [`faults`]: what goes wrong on the way.

pub mod board;
pub mod devices;
pub mod disc;
pub mod faults;
pub mod wires;
