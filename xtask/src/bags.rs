//! Bags of ROS 2 against rosbags, a program in Python that shares no code with this one.
//!
//! Everything is below `target/bags`: `tools` is the environment with rosbags, `files` what the proof writes.

use std::path::PathBuf;
use std::process::Command;

use anyhow::Context;

use crate::cargo;

/// Ours read by rosbags; its own of every type and storage, and damaged ones, read by ours.
pub fn check() -> anyhow::Result<()> {
    // Optimized, as other steps build it.
    cargo::run("build --release --bin sonarfix")?;
    cargo::run("build --release --package sonarfix-bags --examples")?;
    let source = cargo::root().join("xtask/bags");
    let programs = cargo::target_folder().join("release");
    let examples = programs.join("examples");
    let mut proof = Command::new(python()?);
    proof.arg(source.join("proof.py")).arg(programs.join("sonarfix"));
    // The errors of damaged bags are many, and finding the lines of each would take a second.
    proof.env("RUST_BACKTRACE", "0");
    proof.args([examples.join("print"), examples.join("every_type"), folder().join("files")]);
    cargo::check(proof)
}

fn folder() -> PathBuf {
    cargo::target_folder().join("bags")
}

/// The Python of an environment that has rosbags.
fn python() -> anyhow::Result<PathBuf> {
    let tools = folder().join("tools");
    if !tools.join("bin/pip").exists() {
        let mut command = Command::new("python3");
        command.args(["-m", "venv"]).arg(&tools);
        cargo::check(command).context("Debian needs the package python3-venv")?;
    }
    let mut install = Command::new(tools.join("bin/pip"));
    install.args(["install", "--quiet", "--requirement"]);
    install.arg(cargo::root().join("xtask/bags/requirements.txt"));
    cargo::check(install)?;
    Ok(tools.join("bin/python"))
}
