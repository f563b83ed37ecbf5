//! Checks the packages as their users use them, outside the repository's build.
//!
//! | module | |
//! |---|---|
//! | `examples` | the examples for Arduino: for each processor, and closed loop in the simulator |
//! | `builds` | pkg-config, CMake, one command |
//! | `rules` | the published rules of Arduino's library manager |

mod builds;
mod examples;
mod rules;

use std::path::Path;

use anyhow::Result;

use crate::packages::Packages;

/// Checks all packages; `work` is a folder for what is built.
///
/// # Errors
/// By the first check that fails.
pub fn run(workspace: &Path, packages: &Packages, work: &Path) -> Result<()> {
    std::fs::create_dir_all(work)?;
    rules::check(&packages.arduino)?;
    builds::check(&packages.c, work)?;
    examples::compare(workspace, packages, work)?;
    examples::compile(workspace, &packages.arduino, work)?;
    examples::drive(workspace, packages, work)
}
