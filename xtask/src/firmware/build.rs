//! Builds the firmware.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};
use sonarfix_boards::Board;

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

/// Reads a linked file.
pub fn read(program: &Path) -> anyhow::Result<Vec<u8>> {
    std::fs::read(program).with_context(|| program.display().to_string())
}
