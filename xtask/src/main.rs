//! What CI runs, by the same names: `cargo xtask ci` is every check, and each has a name of its
//! own, so that whoever broke one can run just that.

mod endurance;
mod fuzz;
mod miri;

use std::path::PathBuf;
use std::process::{Command, ExitCode};

use anyhow::{Context, bail};
use clap::{Parser, Subcommand};

#[derive(Debug, Parser)]
#[command(about = "The project's checks and chores")]
struct Xtask {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Clone, PartialEq, Eq, Subcommand)]
enum Task {
    /// Every check below, in order.
    Ci,
    /// Formatting.
    Format,
    /// Clippy, warnings are errors.
    Lint,
    /// The tests, as the README runs them.
    TestHost,
    /// The documentation, warnings are errors.
    Docs,
    /// The `no_std` crates for microcontrollers with and without FPU.
    Embedded,
    /// Licences of all dependencies, and advisories if their database can be reached.
    Deny,
    /// The paper's statistics at full length: 5,000 seeds, both policies (minutes).
    Statistics,
    /// Random lives of the filter, 10⁸ steps unless told otherwise (minutes).
    Endurance(endurance::Args),
    /// The fuzz targets, for a bounded time.
    Fuzz(fuzz::Args),
    /// The core under Miri, if there is one.
    Miri,
}

/// The crates that run on a robot.
const NO_STD_CRATES: [&str; 3] = ["sonarfix", "sonarfix-hal", "sonarfix-link"];
/// Cortex-M4F, and Cortex-M0+ without FPU or atomics.
const TARGETS: [&str; 2] = ["thumbv7em-none-eabihf", "thumbv6m-none-eabi"];

fn main() -> ExitCode {
    match run(Xtask::parse().task) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(task: Task) -> anyhow::Result<()> {
    match task {
        Task::Ci => {
            let checks = [
                Task::Format,
                Task::Lint,
                Task::TestHost,
                Task::Docs,
                Task::Embedded,
                Task::Deny,
                Task::Endurance(endurance::Args::SHORT),
                Task::Fuzz(fuzz::Args::short()),
                Task::Miri,
            ];
            checks.into_iter().try_for_each(run)
        }
        Task::Format => cargo("fmt --all --check"),
        Task::Lint => cargo("clippy --workspace --all-targets --all-features -- -D warnings"),
        Task::TestHost => cargo("test"),
        Task::Docs => docs(),
        Task::Embedded => embedded(),
        Task::Deny => deny(),
        Task::Statistics => statistics(),
        Task::Endurance(args) => endurance::run(args),
        Task::Fuzz(args) => fuzz::run(&args),
        Task::Miri => miri::run(),
    }
}

fn docs() -> anyhow::Result<()> {
    let mut command = cargo_command("doc --workspace --no-deps --all-features");
    command.env("RUSTDOCFLAGS", "-D warnings");
    check(command)
}

fn embedded() -> anyhow::Result<()> {
    for target in TARGETS {
        for name in NO_STD_CRATES {
            cargo(&format!("build --release --package {name} --target {target}"))?;
            cargo(&format!("build --release --package {name} --target {target} --all-features"))?;
        }
    }
    Ok(())
}

fn deny() -> anyhow::Result<()> {
    if Command::new("cargo").args(["deny", "--version"]).output().is_ok_and(|o| !o.status.success())
    {
        bail!("cargo-deny is missing: install it with `cargo install cargo-deny --locked`");
    }
    cargo("deny --log-level error check licenses bans sources")?;
    // The advisory database lives on the network; without it, say so and go on.
    if cargo("deny fetch db").is_err() {
        eprintln!("advisories: not checked, their database cannot be reached");
        return Ok(());
    }
    cargo("deny --log-level error check advisories")
}

fn statistics() -> anyhow::Result<()> {
    for policy in ["nearest", "informative"] {
        let paper = "run --release --package sonarfix-sim --bin sonarfix -- paper";
        cargo(&format!("{paper} --statistics --runs 5000 --policy {policy}"))?;
    }
    Ok(())
}

fn cargo(arguments: &str) -> anyhow::Result<()> {
    check(cargo_command(arguments))
}

fn cargo_command(arguments: &str) -> Command {
    let mut command = Command::new("cargo");
    command.args(arguments.split_whitespace());
    command
}

/// Where builds go.
fn target_directory() -> anyhow::Result<PathBuf> {
    let directory = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    std::path::absolute(directory).context("the target directory has no path")
}

fn check(mut command: Command) -> anyhow::Result<()> {
    let shown: Vec<_> = command.get_args().map(|arg| arg.to_string_lossy()).collect();
    let program = command.get_program().to_string_lossy();
    let shown = format!("{program} {}", shown.join(" "));
    eprintln!("── {shown}");
    let status = command.status().with_context(|| format!("cannot start `{shown}`"))?;
    if !status.success() {
        bail!("`{shown}` failed");
    }
    Ok(())
}
