//! Pages that a command generates whole, and CI compares.

use std::fs;

use anyhow::ensure;

use crate::cargo;

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Writes the page instead of comparing it.
    #[arg(long)]
    write: bool,
}

impl Args {
    /// What CI runs.
    pub const CHECK: Self = Self { write: false };
}

/// Writes the page `path`, or compares it. `command` is the one that writes it.
pub fn update(args: Args, path: &str, text: &str, command: &str) -> anyhow::Result<()> {
    let file = cargo::root().join(path);
    if args.write {
        return Ok(fs::write(file, text)?);
    }
    let is_same = fs::read_to_string(file).is_ok_and(|committed| committed == text);
    ensure!(is_same, "{path} is not up to date: run `cargo xtask {command} --write`");
    Ok(())
}
