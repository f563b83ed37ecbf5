//! `sonarfix-studies surveys`: the accuracy of `sonarfix survey` on simulated robots.

use std::path::PathBuf;

use anyhow::Context;
use sonarfix_studies::surveys::{self, Place};

use sonarfix_terminal::progress::Runs;

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Site {
    /// A room without furniture.
    Room,
    /// The scenario `classroom` with its furniture.
    Classroom,
    /// Floor plans.
    Plans,
}

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Where the robots drive.
    #[arg(value_enum)]
    site: Site,
    /// Number of drives.
    #[arg(long, default_value_t = 20)]
    runs: u32,
    /// Seed of the first drive; the others count up from it.
    #[arg(long, default_value_t = 20_000)]
    seed: u64,
    /// Prints what the drives amount to, without a row for each.
    #[arg(long)]
    summary: bool,
    /// Writes log, robot file and true map of the first drive into a folder, and maps nothing.
    #[arg(long, value_name = "FOLDER")]
    record: Option<PathBuf>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let place = match args.site {
        Site::Room => Place::Room,
        Site::Classroom => Place::Classroom,
        Site::Plans => Place::Plans,
    };
    if let Some(folder) = &args.record {
        return surveys::record(place, args.seed, folder)
            .with_context(|| folder.display().to_string());
    }
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    let progress = Runs::new(args.runs);
    let trials = surveys::trials(place, args.seed, args.runs, &progress)?;
    progress.end()?;
    print!("{}", if args.summary { surveys::summary(&trials) } else { surveys::page(&trials) });
    Ok(())
}
