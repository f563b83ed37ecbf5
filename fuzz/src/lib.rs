//! The fuzz targets as functions: each accepts any bytes, and panics if an invariant is violated.
//!
//! | target | meaning of the bytes |
//! |---|---|
//! | [`localizer`] | a configuration, a map, and calls in any order with hostile numbers and times |
//! | [`search`] | a map, and travels, pings and evaluations of the search |
//! | [`baked_map`] | a baked map, whole or damaged, or walls to bake |
//! | [`map_file`], [`scenario_file`], [`robot_file`] | the text of such a file |
//! | [`replay_log`] | the lines of a log |
//! | [`c_interface`] | calls of the functions of the C header, with pointers that are NULL or misaligned |
//! | [`link`] | a message, and line noise before it |
//!
//! `cargo xtask fuzz` searches for a bounded time, `cargo fuzz run TARGET` without limit; `cargo test --no-default-features` runs
//! them on `corpus/` and on seeded random bytes.

mod baked;
mod bytes;
mod c_interface;
mod calls;
mod files;
mod link;
mod search;

pub use baked::baked_map;
pub use c_interface::c_interface;
pub use calls::localizer;
pub use files::{map_file, replay_log, robot_file, scenario_file};
pub use link::link;
pub use search::search;

/// A target with its name, which is also that of its corpus.
pub type Target = (&'static str, fn(&[u8]));

/// Every target.
pub const TARGETS: [Target; 9] = [
    ("localizer", localizer),
    ("search", search),
    ("baked_map", baked_map),
    ("map_file", map_file),
    ("scenario_file", scenario_file),
    ("robot_file", robot_file),
    ("replay_log", replay_log),
    ("link", link),
    ("c_interface", c_interface),
];
