//! The simulated electronics of a robot, down to the pins. The drivers of `sonarfix-hal` run on them
//! unmodified, as on a board.
//!
//! ```text
//!   drivers and loop     sonarfix-pil's wires            simulated hardware
//!   Counter     ◀──────── Sensors ◀── Quadrature ◀── A, B ── EncoderDisc ◀── wheel
//!   Servo       ────────▶ Actuators ── duty ────────────────▶ ServoPlant
//!   PulseRanger ────────▶ Actuators ── trigger ─────────────▶ SonarBoard ──▶ ping
//!   EchoCapture ◀──────── Sensors ◀─── edges, stamped ─────── SonarBoard ◀── echo
//! ```
//!
//! - [`wires`]: the channels of an encoder and the count of the shipped decoder;
//! - [`disc`]: an encoder disc, which generates the edges;
//! - [`board`]: the board of a sonar, which answers a trigger with an echo pulse;
//! - [`sonar`]: a sonar with its board and its servo, and the cross-talk of several;
//! - [`devices`]: the parameters of a scenario's devices, for the drivers and for the models;
//! - [`gyro`]: the rate of a gyro, for its registers on the bus;
//! - [`faults`]: faults of the hardware.

pub mod board;
pub mod devices;
pub mod disc;
pub mod faults;
pub mod gyro;
pub mod light;
pub mod sonar;
pub mod wires;
