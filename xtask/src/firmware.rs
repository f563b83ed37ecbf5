//! The shipped firmware: that it cannot panic through our code, that it boots and obeys, how
//! large it is and how deep its stack can go.
//!
//! All of it is read from the very file that is flashed. One file each:
//! - `frames`: whether the frames of the stack are read rightly;
//! - `lines`: from which line an instruction was made;
//! - `memory`: that there is no allocator, and where the stack is;
//! - `panics`: which lines can panic;
//! - `size`: flash and RAM;
//! - `stack`: how deep it can be.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};

use crate::{cargo, pico};

mod frames;
mod lines;
mod memory;
pub mod panics;
mod size;
mod stack;

const TARGET: &str = "thumbv7em-none-eabihf";
const NAME: &str = "sonarfix-stm32f405";

/// Builds the firmware, checks the linked file, and runs it in an emulator.
pub fn test() -> anyhow::Result<()> {
    for check in ["fmt --all --check", "clippy --release -- -D warnings"] {
        cargo::check(in_firmware(check))?;
    }
    let program = build()?;
    let bytes = read(&program)?;
    memory::check(&bytes)?;
    panics::check(&bytes)?;
    size::check(&bytes)?;
    let deepest = stack::check(&bytes)?;
    let tests = "test --package sonarfix-app --test emulated -- --ignored --nocapture";
    let mut command = cargo::command(tests);
    command.env("SONARFIX_FIRMWARE", &program).env("SONARFIX_STACK", deepest.to_string());
    cargo::check(command)?;
    pico::check()
}

/// Flash and RAM of the linked file, by crate.
pub fn size() -> anyhow::Result<()> {
    size::check(&read(&build()?)?)
}

/// How the stack is looked at.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct StackArgs {
    /// Compares the frames that are read from instructions with those that a compiler says it
    /// made, in a build of its own (a minute).
    #[arg(long)]
    ask_compiler: bool,
}

/// The deepest that the stack of the linked file can be.
pub fn stack(args: &StackArgs) -> anyhow::Result<()> {
    if args.ask_compiler {
        return frames::check(&read(&build_with_stack_sizes()?)?);
    }
    stack::check(&read(&build()?)?).map(drop)
}

pub fn read(program: &Path) -> anyhow::Result<Vec<u8>> {
    std::fs::read(program).with_context(|| program.display().to_string())
}

/// Builds the firmware; gives the linked file.
fn build() -> anyhow::Result<PathBuf> {
    let found = Command::new("flip-link").arg("--version").output();
    ensure!(
        found.is_ok(),
        "flip-link is missing: install it with `cargo install flip-link --locked`"
    );
    cargo::check(in_firmware("build --release"))?;
    Ok(target().join(TARGET).join("release").join(NAME))
}

/// Builds the firmware, together with the stack sizes that its compiler says; gives the linked
/// file, which is not the one that ships.
fn build_with_stack_sizes() -> anyhow::Result<PathBuf> {
    let target = cargo::target_directory().join("firmware-stack-sizes");
    let mut command = in_firmware("build --release --config");
    command.arg(format!("target.{TARGET}.rustflags = ['{}']", frames::FLAG));
    command.env("CARGO_TARGET_DIR", &target).env("RUSTC_BOOTSTRAP", "1");
    cargo::check(command)?;
    Ok(target.join(TARGET).join("release").join(NAME))
}

/// A cargo in the workspace `firmware`, whose own configuration holds what its linker needs.
pub fn in_firmware(arguments: &str) -> Command {
    let mut command = cargo::command(arguments);
    command.current_dir(cargo::root().join("firmware")).env_remove("RUSTFLAGS");
    command.env("CARGO_TARGET_DIR", target());
    command
}

/// Where the workspace `firmware` is built.
pub fn target() -> PathBuf {
    cargo::target_directory().join("firmware")
}
