//! Reads and checks map, robot and scenario files for the localizer and the simulator. `docs/formats.md` describes the
//! formats, key by key.
//!
//! A [`FileError`] has all mistakes in a file, each with its line, its key and what to do:
//!
//! ```text
//! paper.toml:45: robot.sonar.cone: must be between 0 and 90° (half of the cone)
//! ```
//!
//! | file | read by | result |
//! |---|---|---|
//! | map | [`Floor::read`] | the walls |
//! | robot | [`robot_file::read`] | the [`RobotConfig`](sonarfix_hal::config::RobotConfig) |
//! | scenario | [`Scenario::read`] | both, a path, and the true parameters |
//! | any with a map | [`MapFile::read`] | the walls, and the line of each |
//!
//! [`plausibility`] warns of values that are valid and improbable. [`flaws`] finds contradictions between walls, [`simplify`] joins collinear pieces, and [`bake`] creates the image that a
//! robot reads in place.
//!
//! Parameters of the localizer are `f32` in the types of [`sonarfix`]; all others are `f64` in metres, seconds and radians.

#![forbid(unsafe_code)]

mod addition;
mod bake;
mod clearance;
pub mod devices;
mod document;
mod documentation;
mod error;
mod example;
mod file;
mod flaws;
mod floor;
mod geometry;
mod keys;
mod map_file;
mod neighbours;
mod path;
pub mod plausibility;
mod quantity;
pub mod robot_file;
mod scenario;
pub mod servo;
mod simplify;
mod sonar_model;
mod spelling;
mod symmetry;
mod text_lines;
mod wall_file;

pub use addition::{Addition, PlacedAddition, along_walls, with_cabinet};
pub use bake::{BakeError, bake};
pub use clearance::Collision;
pub use documentation::{documentation, with_comments};
pub use error::{FileError, Mistake};
pub use file::{MAX_FILE_BYTES, on_read, read_bytes, read_text};
pub use flaws::{Finding, Flaw, Severity, flaws};
pub use floor::{Floor, NamedWall};
pub use map_file::MapFile;
pub use path::{Leg, Motion, Movement, Path, PathError, PathPlan, PathPose};
pub use robot_file::text as robot_text;
pub use scenario::absolute::{AbsoluteSensors, HeadingSensor, PositionSensor, Sampling};
pub use scenario::faults::{Fault, FaultKind, Wheel};
pub use scenario::fidelity::{Fidelity, Hardware, ServoName};
pub use scenario::path_table::Follow;
pub use scenario::start::Start;
pub use scenario::surroundings::{Obstacle, Oscillation, Outline, Surroundings};
pub use scenario::truth::{GyroTruth, Truth};
pub use scenario::upsets::{HeadingSlip, Upset, Upsets};
pub use scenario::{Run, Scenario, scenario_keys};
pub use simplify::{Limits, Simplified, simplify};
pub use sonar_model::{SonarModel, SonarName};
pub use symmetry::{Motion as SymmetryMotion, Symmetry, symmetries};

/// The text of the reference scenario, with the conditions of the paper.
pub const PAPER: &str = include_str!("../scenarios/paper.toml");

/// The text of the scenario `classroom`: a cheap robot in a furnished room, simulated at its pins.
pub const CLASSROOM: &str = include_str!("../scenarios/classroom.toml");

/// Converts a number of a file to the localizer's type.
fn single(value: f64) -> f32 {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the localizer computes with the nearest f32; its own check refuses an infinite one"
    )]
    let single = value as f32;
    single
}
