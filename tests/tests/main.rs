//! Tests across the crates, in one program, which links once.

mod absolute;
mod baked;
mod built;
mod consistency;
mod failed_ranger;
mod gyro;
mod kidnapped;
mod motors;
mod oracle;
mod paper_robot;
mod pil;
mod pins;
mod state_machines;
