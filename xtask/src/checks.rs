//! Checks that are a few calls of cargo.

use crate::bench::cmsis;
use crate::cargo;
use crate::ci;
use crate::workspace::Workspace;

/// The crates that run on a robot.
pub const NO_STD_CRATES: [&str; 9] = [
    "sonarfix",
    "sonarfix-search",
    "sonarfix-hal",
    "sonarfix-link",
    "sonarfix-app",
    "sonarfix-drive",
    "sonarfix-c",
    "sonarfix-pil",
    "sonarfix-soft-float",
];
/// Cortex-M4F, and Cortex-M0+ without FPU or atomics.
const TARGETS: [&str; 2] = ["thumbv7em-none-eabihf", "thumbv6m-none-eabi"];

/// Formatting of every workspace.
pub fn format() -> anyhow::Result<()> {
    Workspace::ALL
        .into_iter()
        .try_for_each(|workspace| cargo::check(workspace.cargo("fmt --all --check")))
}

/// Builds the documentation.
pub fn docs() -> anyhow::Result<()> {
    let mut command = cargo::command("doc --workspace --no-deps --all-features");
    command.env("RUSTDOCFLAGS", "-D warnings");
    cargo::check(command)
}

/// Checks that the `no_std` crates compile for microcontrollers, without features and with all, and the simulator for WebAssembly,
/// without terminal and processes.
pub fn embedded() -> anyhow::Result<()> {
    let packages: Vec<String> =
        NO_STD_CRATES.iter().map(|name| format!("--package {name}")).collect();
    let packages = packages.join(" ");
    for target in TARGETS {
        for features in ["", "--all-features"] {
            cargo::run(&format!("check --release {packages} --target {target} {features}"))?;
        }
    }
    cargo::run("check --package sonarfix-sim --target wasm32-unknown-unknown")
}

/// Formatting and Clippy of the programs for emulated boards, and of those of `bench` that link no peer.
pub fn lint_emulated() -> anyhow::Result<()> {
    let programs = [
        (Workspace::Emulated, "--workspace --target thumbv7em-none-eabihf"),
        (Workspace::Emulated, "--package emulated-pil --target riscv32imac-unknown-none-elf"),
        (
            Workspace::Bench,
            "--package bench-mcu --package bench-ours --target thumbv7em-none-eabihf",
        ),
    ];
    for workspace in [Workspace::Emulated, Workspace::Bench] {
        cargo::check(workspace.cargo("fmt --all --check"))?;
    }
    for (workspace, packages) in programs {
        let clippy = format!("clippy --release {packages} -- -D warnings");
        cargo::check(workspace.cargo(&clippy))?;
    }
    Ok(())
}

/// Compares the result of every peer with that of an independent filter; the one over CMSIS-DSP if its source can be
/// downloaded.
pub fn peers() -> anyhow::Result<()> {
    let mut tests = "test --package bench-host --test agreement --test derived".to_owned();
    match cmsis::fetch() {
        Ok(()) => tests.push_str(" --features crazyflie"),
        Err(error) => ci::skip(&format!("the peer crazyflie: {error:#}")),
    }
    cargo::check(Workspace::Bench.cargo(&tests))
}

/// Checks licences and sources of the crates and of the firmware; advisories too if their database can be reached.
pub fn deny() -> anyhow::Result<()> {
    cargo::install("cargo-deny", "0.20.2")?;
    deny_in_all("licenses bans sources")?;
    // The advisory database is on the network.
    if cargo::run("deny fetch db").is_err() {
        ci::skip("the advisories: their database cannot be reached");
        return Ok(());
    }
    deny_in_all("advisories")
}

/// These checks of cargo-deny in the workspaces that make products.
fn deny_in_all(checks: &str) -> anyhow::Result<()> {
    for workspace in [Workspace::Main, Workspace::Firmware, Workspace::Python, Workspace::Ros] {
        let manifest = workspace.folder().join("Cargo.toml");
        let mut command = cargo::command("deny --log-level error --manifest-path");
        command.arg(manifest).args(["check"]).args(checks.split(' '));
        cargo::check(command)?;
    }
    Ok(())
}

/// The paper's statistics at full length.
pub fn statistics() -> anyhow::Result<()> {
    for policy in ["nearest", "informative"] {
        let paper = "run --release --bin sonarfix -- paper";
        cargo::run(&format!("{paper} --statistics --runs 5000 --policy {policy}"))?;
    }
    Ok(())
}
