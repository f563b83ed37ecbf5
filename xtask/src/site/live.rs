//! The robot that the live page is connected to.

use std::path::Path;
use std::{env, fs};

use anyhow::Context;

use crate::cargo;

/// Puts the program `sonarfix` into a folder, and the files of a robot into its folder `live-robot`: `check.mjs` starts a virtual robot.
pub fn prepare(folder: &Path) -> anyhow::Result<()> {
    cargo::run("build --quiet --bin sonarfix")?;
    let name = format!("sonarfix{}", env::consts::EXE_SUFFIX);
    let program = folder.join("sonarfix");
    fs::copy(cargo::target_folder().join("debug").join(&name), &program).context(name)?;
    let robot = folder.join("live-robot");
    if robot.exists() {
        fs::remove_dir_all(&robot)?;
    }
    let mut init = std::process::Command::new(program);
    init.arg("init").arg(robot);
    cargo::check(init)
}
