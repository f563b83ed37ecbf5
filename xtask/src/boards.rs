//! The boards that have firmware: the rows of `firmware/boards.toml`.

use std::fs;

use anyhow::Context;
use serde::Deserialize;

use crate::workspace::Workspace;

/// A row of the table.
#[derive(Deserialize)]
pub struct Board {
    /// The name on the command line.
    pub name: String,
    pub title: String,
    /// The package of its firmware.
    pub package: String,
    /// The target that it is built for.
    pub target: String,
    /// Where the baked files lie in its flash.
    pub config: Region,
    pub map: Region,
    /// The linker's memory map, from the top of the repository.
    pub memory: String,
    /// Where the board takes 5 V.
    pub feed: String,
    /// The resistors between echo and ground, upper and lower.
    pub divider: [String; 2],
    pub pins: Pins,
}

/// A region of flash.
#[derive(Deserialize)]
pub struct Region {
    pub address: u32,
}

/// The pin of each signal.
#[derive(Deserialize)]
pub struct Pins {
    pub right_a: String,
    pub right_b: String,
    pub left_a: String,
    pub left_b: String,
    pub servo: String,
    pub trigger: String,
    pub echo: String,
    pub enable: String,
    pub tx: String,
    pub rx: String,
}

/// All boards.
pub fn all() -> anyhow::Result<Vec<Board>> {
    #[derive(Deserialize)]
    struct Table {
        board: Vec<Board>,
    }

    let text = fs::read_to_string(Workspace::Firmware.folder().join("boards.toml"))?;
    let table: Table = toml::from_str(&text).context("firmware/boards.toml")?;
    Ok(table.board)
}
