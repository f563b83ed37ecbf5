//! What the form of a new robot saves, checked by the command.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, ensure};
use sonarfix_boards::image::Image;
use sonarfix_boards::uf2;

use crate::cargo;

/// The board that the form is filled in for.
const BOARD: &str = "pico2";
/// The file of the program.
const PROGRAM: &str = "program.uf2";
/// The archives, one for each colour scheme.
const ARCHIVES: [&str; 2] = ["light.zip", "dark.zip"];

/// Writes a program for [`BOARD`], which the form combines with a robot.
pub fn prepare(folder: &Path) -> anyhow::Result<()> {
    let board = sonarfix_boards::named(BOARD)?;
    let usb = board.uf2.as_ref().context("no USB drive")?;
    let mut image = Image::default();
    image.add("the program", board.start_of_flash(), &[0x5A; 5000])?;
    Ok(fs::write(folder.join(PROGRAM), uf2::write(&image, usb.family)?)?)
}

/// Checks the archives in a folder: the command accepts and simulates the files, and writes the same UF2.
pub fn check(folder: &Path) -> anyhow::Result<()> {
    let [light, dark] = ARCHIVES.map(|name| fs::read(folder.join(name)).context(name));
    ensure!(light? == dark?, "the form saves other bytes in another colour scheme");
    let robot = folder.join("robot");
    if robot.exists() {
        fs::remove_dir_all(&robot)?;
    }
    let mut extract = Command::new("python3");
    extract.args(["-m", "zipfile", "-e"]).arg(folder.join(ARCHIVES[0])).arg(folder);
    cargo::check(extract)?;
    let manifest = cargo::root().join("Cargo.toml");
    let sonarfix = |arguments: &str| {
        let mut command = cargo::command("run --quiet --bin sonarfix --manifest-path");
        command.arg(&manifest).arg("--").args(arguments.split(' ')).current_dir(folder);
        cargo::check(command)
    };
    sonarfix("check robot/robot.toml robot/map.toml robot/scenario.toml")?;
    sonarfix("run robot/scenario.toml --runs 1")?;
    sonarfix(&format!("flash robot --board {BOARD} --program {PROGRAM} --out robot/flash.uf2"))?;
    let [saved, flashed] = ["robot.uf2", "flash.uf2"].map(|name| fs::read(robot.join(name)));
    ensure!(saved? == flashed?, "`sonarfix flash` writes another UF2 than the form");
    Ok(())
}
