//! `sonarfix-studies rooms`: consistency of the filter, and verdicts, in generated rooms.

use sonarfix_studies::rooms;

use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of rooms of each family, with one run of ten minutes each.
    #[arg(long, default_value_t = 40)]
    runs: u32,
    /// Seed of the first room of each family; the others count up from it. Parameters are chosen on seeds below 10000.
    #[arg(long, default_value_t = 10_000)]
    seed: u64,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    let progress = Runs::new(args.runs.saturating_mul(5));
    let results = rooms::run(args.seed, args.runs, &progress)?;
    progress.end()?;
    print!("{}", rooms::markdown(&results));
    Ok(())
}
