//! `sonarfix-studies calibration`: the accuracy of `sonarfix calibrate` on simulated robots.

use sonarfix_studies::calibration::{self, Errors};

use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of robots.
    #[arg(long, default_value_t = 200)]
    runs: u32,
    /// Seed of the first robot; the others count up from it.
    #[arg(long, default_value_t = 60_000)]
    seed: u64,
    /// Distances driven, metres.
    #[arg(long, value_delimiter = ',', default_value = "10,20,60")]
    metres: Vec<f64>,
    /// Wheels 10 % wrong instead of 3 % and 2 %.
    #[arg(long)]
    gross: bool,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let errors = if args.gross { Errors::GROSS } else { Errors::BUILDER };
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    let sets = u32::try_from(args.metres.len())?;
    let progress = Runs::new(args.runs.saturating_mul(sets));
    let mut rows = Vec::new();
    for &metres in &args.metres {
        let trials = calibration::trials(args.seed, args.runs, metres, errors, &progress)?;
        // An interruption may come before the first trial of a distance.
        if !trials.is_empty() {
            rows.push((metres, trials));
        }
    }
    progress.end()?;
    print!("{}", calibration::page(&rows));
    Ok(())
}
