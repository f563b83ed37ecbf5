//! Map, robot and scenario files: read, checked, and turned into what the localizer and the
//! simulator take. The formats are described key by key in `docs/formats.md`.
//!
//! Whatever is wrong with a file is a [`FileError`] with its file, line and key:
//!
//! ```text
//! paper.toml:45: robot.sonar.cone: must be between 0 and 90° (half of the cone)
//! ```
//!
//! | file | is read by | gives |
//! |---|---|---|
//! | map | [`Floor::read`] | the walls |
//! | robot | [`Robot::read`] | the localizer's configuration, and the periods of its loop |
//! | scenario | [`Scenario::read`] | both, a path, and what is true |
//!
//! Numbers that the localizer takes are `f32` in the types of [`sonarfix`]; everything else is
//! `f64` in metres, seconds and radians.

#![forbid(unsafe_code)]

mod bake;
mod document;
mod error;
mod faults;
mod fidelity;
mod file;
mod floor;
mod geometry;
mod path;
mod quantity;
mod robot;
mod scenario;
mod surroundings;

pub use bake::{BakeError, bake};
pub use error::FileError;
pub use faults::{Fault, FaultKind, Wheel};
pub use fidelity::{Fidelity, Follow, Hardware, ServoName, SonarName, Upset, Upsets};
pub use floor::{Floor, NamedWall};
pub use path::{Leg, Motion, Movement, Path, PathError, PathPlan, PathPose};
pub use robot::Robot;
pub use scenario::{Run, Scenario, Start, Truth};
pub use surroundings::{Obstacle, Outline, Surroundings, Walk};

/// The text of the reference scenario: the conditions of the paper that Sonarfix starts from.
pub const PAPER: &str = include_str!("../scenarios/paper.toml");

/// The text of the scenario `classroom`: a cheap robot in a furnished room, down to its pins.
pub const CLASSROOM: &str = include_str!("../scenarios/classroom.toml");

/// The localizer's number for one of a file.
fn single(value: f64) -> f32 {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the nearest f32 is what the localizer computes with; what becomes infinite is \
                  refused by its own check"
    )]
    let single = value as f32;
    single
}
