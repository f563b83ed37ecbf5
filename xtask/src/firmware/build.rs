//! Builds the firmware.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};
use sonarfix_boards::Board;

use super::frames;
use crate::cargo;
use crate::workspace::Workspace;

const TARGET: &str = "thumbv7em-none-eabihf";
/// Its package, and the name of the program.
pub const NAME: &str = "sonarfix-stm32f405";

/// Builds the firmware of the reference board; returns the path of the linked file.
pub fn release() -> anyhow::Result<PathBuf> {
    let found = Command::new("flip-link").arg("--version").output();
    ensure!(
        found.is_ok(),
        "flip-link is missing: install it with `cargo install flip-link --locked`"
    );
    cargo::check(Workspace::Firmware.cargo("build --release"))?;
    Ok(Workspace::Firmware.target_folder().join(TARGET).join("release").join(NAME))
}

/// Builds the firmware of a board; returns the path of the linked file.
pub fn of(board: &Board) -> anyhow::Result<PathBuf> {
    if board.package == NAME {
        return release();
    }
    let firmware = Workspace::Firmware;
    let package = format!("build --release --package {} --target {}", board.package, board.target);
    cargo::check(firmware.cargo(&package))?;
    Ok(firmware.target_folder().join(&board.target).join("release").join(&board.package))
}

/// Builds the firmware with the compiler's own stack sizes in it; returns the path of the linked file, which is not
/// the one that ships.
pub fn with_stack_sizes() -> anyhow::Result<PathBuf> {
    let target = cargo::target_folder().join("firmware-stack-sizes");
    let mut command = Workspace::Firmware.cargo("build --release --config");
    command.arg(format!("target.{TARGET}.rustflags = ['{}']", frames::FLAG));
    command.env("CARGO_TARGET_DIR", &target).env("RUSTC_BOOTSTRAP", "1");
    cargo::check(command)?;
    Ok(target.join(TARGET).join("release").join(NAME))
}

/// Reads a linked file.
pub fn read(program: &Path) -> anyhow::Result<Vec<u8>> {
    std::fs::read(program).with_context(|| program.display().to_string())
}
