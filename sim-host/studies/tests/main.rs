//! Tests of the studies and of their command, in one program, which links once.

mod endings;
mod fault_campaign;
mod faults;
mod find;
mod floor_plan;
mod rooms;
#[path = "../../cli/tests/skipped/mod.rs"]
mod skipped;
mod sonar_model;
