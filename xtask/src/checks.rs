//! The checks that are a few calls of cargo.

use std::process::Command;

use anyhow::bail;

use crate::cargo;

/// The crates that run on a robot.
const NO_STD_CRATES: [&str; 5] =
    ["sonarfix", "sonarfix-hal", "sonarfix-link", "sonarfix-app", "sonarfix-pil"];
/// Cortex-M4F, and Cortex-M0+ without FPU or atomics.
const TARGETS: [&str; 2] = ["thumbv7em-none-eabihf", "thumbv6m-none-eabi"];

pub fn docs() -> anyhow::Result<()> {
    let mut command = cargo::command("doc --workspace --no-deps --all-features");
    command.env("RUSTDOCFLAGS", "-D warnings");
    cargo::check(command)
}

pub fn embedded() -> anyhow::Result<()> {
    for target in TARGETS {
        for name in NO_STD_CRATES {
            cargo::run(&format!("build --release --package {name} --target {target}"))?;
            cargo::run(&format!(
                "build --release --package {name} --target {target} --all-features"
            ))?;
        }
    }
    Ok(())
}

pub fn lint_bench() -> anyhow::Result<()> {
    cargo::check(cargo::in_bench("fmt --all --check"))?;
    let packages = "--package bench-probe --package bench-building --package bench-mcu --package bench-ours \
         --package bench-pil";
    let target = "--target thumbv7em-none-eabihf";
    cargo::check(cargo::in_bench(&format!("clippy --release {packages} {target} -- -D warnings")))
}

pub fn peers() -> anyhow::Result<()> {
    cargo::check(cargo::in_bench("test --package bench-host --test agreement"))
}

pub fn deny() -> anyhow::Result<()> {
    if Command::new("cargo").args(["deny", "--version"]).output().is_ok_and(|o| !o.status.success())
    {
        bail!("cargo-deny is missing: install it with `cargo install cargo-deny --locked`");
    }
    cargo::run("deny --log-level error check licenses bans sources")?;
    // The advisory database lives on the network; without it, say so and go on.
    if cargo::run("deny fetch db").is_err() {
        eprintln!("advisories: not checked, their database cannot be reached");
        return Ok(());
    }
    cargo::run("deny --log-level error check advisories")
}

pub fn statistics() -> anyhow::Result<()> {
    for policy in ["nearest", "informative"] {
        let paper = "run --release --package sonarfix-sim --bin sonarfix -- paper";
        cargo::run(&format!("{paper} --statistics --runs 5000 --policy {policy}"))?;
    }
    Ok(())
}
