//! `sonarfix-studies reality`: all recordings of a folder.

use std::path::PathBuf;

use anyhow::Context;
use sonarfix_replay::scan::MOST_PINGS_PER_SCAN;
use sonarfix_studies::reality::{self, page};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder with the recordings.
    data: PathBuf,
    /// Takes up to N ranges of a scan while the pose is known, each at another wall, as a sonar that sweeps has time for.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_PINGS_PER_SCAN)))]
    pings_per_scan: u32,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let findings = reality::findings(&args.data, args.pings_per_scan)
        .with_context(|| format!("cannot read the recordings in {}", args.data.display()))?;
    anyhow::ensure!(!findings.rows.is_empty(), "{} has no recordings", args.data.display());
    print!("{}", page::markdown(&findings));
    Ok(())
}
