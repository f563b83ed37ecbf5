//! What the commands of Sonarfix on a PC have in common.
//!
//! | module | what |
//! |---|---|
//! | [`output`] | standard output and error without panic, and files for results |
//! | [`progress`] | a progress bar, and the end of many runs by Ctrl-C |
//! | [`json`] | answers as JSON |
//!
//! A program imports the macros by `#[macro_use] extern crate sonarfix_terminal`.

#[macro_use]
pub mod output;
pub mod json;
pub mod progress;
