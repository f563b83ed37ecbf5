//! `cargo xtask search-windows`: random windows of pings for the search, by `tests/examples/search_windows.rs`.

use crate::cargo;

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Number of windows; CI takes 5,000.
    #[arg(long, default_value_t = 1_000_000)]
    windows: u64,
    /// Seed of the first window.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

impl Args {
    /// What CI runs.
    pub const SHORT: Self = Self { windows: 5_000, seed: 0 };
}

pub fn run(args: Args) -> anyhow::Result<()> {
    let Args { windows, seed } = args;
    let example = "run --release --package sonarfix-tests --example search_windows --";
    cargo::run(&format!("{example} --windows {windows} --seed {seed}"))
}
