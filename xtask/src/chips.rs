//! `cargo xtask chips`: the firmware of the Raspberry Pi Pico on an emulated RP2040 (`firmware/chips`), with a robot in a room.

use std::process::Command;

use anyhow::{Context, ensure};
use sonarfix_boards::image::Image;
use sonarfix_boards::uf2;

use crate::firmware::build;
use crate::{cargo, ci};

/// The board whose chip is emulated.
const BOARD: &str = "pico";

/// Tests the emulated chip, then runs the scenarios of `crates/sonarfix-app/tests/chips` with the ELF, and one with the UF2 of a release.
pub fn check() -> anyhow::Result<()> {
    for tool in ["node", "npm"] {
        if Command::new(tool).arg("--version").output().is_err() {
            ci::skip(&format!("the Pico on an emulated chip: {tool} is not there"));
            return Ok(());
        }
    }
    let folder = cargo::root().join("firmware/chips");
    let mut install = Command::new("npm");
    install.args(["ci", "--no-audit", "--no-fund", "--silent"]).current_dir(&folder);
    cargo::check(install).context("cannot install the emulator")?;
    let mut test = Command::new("node");
    test.arg("--test").current_dir(&folder);
    cargo::check(test)?;

    let board = sonarfix_boards::named(BOARD)?;
    let elf = build::of(&board)?;
    let usb = board.uf2.as_ref().context("the board takes no UF2")?;
    let uf2 = cargo::target_folder().join("chips.uf2");
    let bytes = uf2::write(&Image::of_elf(&build::read(&elf)?)?, usb.family)?;
    ensure!(uf2::is_uf2(&bytes), "what is written is no UF2");
    std::fs::write(&uf2, bytes)?;
    // One after another: each takes a processor, and another step of CI the second one.
    let tests =
        "test --package sonarfix-app --test chips -- --ignored --nocapture --test-threads 1";
    let mut command = cargo::command(tests);
    command.env("SONARFIX_PICO_ELF", elf).env("SONARFIX_PICO_UF2", uf2);
    cargo::check(command)
}
