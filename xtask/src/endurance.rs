//! `cargo xtask endurance`: random runs of the filter, by `tests/examples/endurance.rs`.

use crate::cargo;

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Smallest number of steps of the filter; CI runs a million.
    #[arg(long, default_value_t = 100_000_000)]
    steps: u64,
    /// Seed of the first run.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

impl Args {
    /// What CI runs.
    pub const SHORT: Self = Self { steps: 1_000_000, seed: 0 };
}

pub fn run(args: Args) -> anyhow::Result<()> {
    let Args { steps, seed } = args;
    let example = "run --release --package sonarfix-tests --example endurance --";
    cargo::run(&format!("{example} --steps {steps} --seed {seed}"))
}
