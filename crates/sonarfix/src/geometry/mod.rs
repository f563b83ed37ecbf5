//! Quantities, frames and plane geometry: what every other room computes with.

pub mod elementary;
pub mod list;
pub mod numeric;
pub mod pose;
pub mod trig;
pub mod units;
pub mod vector;
