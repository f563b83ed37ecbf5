//! Replays recordings of real robots, and writes `docs/reality.md`.

use std::path::PathBuf;

use anyhow::Context;

use crate::cargo;

/// The page that is written.
const PAGE: &str = "docs/reality.md";

#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// The folder with the recordings; by default that in the environment variable `SONARFIX_DATA`.
    data: Option<PathBuf>,
}

/// Replays all recordings and writes the page.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let data = args.data.clone().or_else(|| std::env::var_os("SONARFIX_DATA").map(PathBuf::from));
    let data = data.context(
        "no recordings: give their folder as an argument or in the environment variable SONARFIX_DATA",
    )?;
    anyhow::ensure!(data.is_dir(), "no recordings: {} is no folder", data.display());
    let mut command = cargo::command("run --quiet --release --bin sonarfix -- reality");
    command.arg(&data);
    let page = cargo::printed(command)?;
    print!("{page}");
    std::fs::write(cargo::root().join(PAGE), page).with_context(|| format!("cannot write {PAGE}"))
}
