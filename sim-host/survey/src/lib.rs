//! A map of walls from the recording of a drive with a sweeping sonar.
//!
//! `docs/survey.md` describes the method.

pub mod comparison;
pub mod drawing;
pub mod evidence;
pub mod line;
pub mod map_text;
pub mod novel;
pub mod problem;
pub mod propose;
mod select;
pub mod solve;
pub mod survey;
pub mod track;
pub mod walls;
