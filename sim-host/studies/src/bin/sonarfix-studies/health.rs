//! `sonarfix-studies health`: the reliability of the health verdict.

use std::path::PathBuf;

use sonarfix_studies::{health_page, kidnapped};

use sonarfix_terminal::output::check_file;
use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of runs of each scenario, and of trials with kidnapped robots.
    #[arg(long, default_value_t = 1_000)]
    runs: u32,
    /// Seed of the first run of each scenario, and of the first trial; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Only the trials with kidnapped robots.
    #[arg(long, conflicts_with = "figure")]
    kidnapped: bool,
    /// The figure of the detection time to write, as SVG.
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<PathBuf>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    if let Some(file) = &args.figure {
        check_file("--figure", file)?;
    }
    if args.kidnapped {
        return only_kidnapped(args);
    }
    let runs = Runs::new(args.runs.saturating_mul(health_page::SETS));
    let findings = health_page::findings(args.seed, args.runs, &runs)?;
    runs.end()?;
    if let Some(file) = &args.figure {
        let called_after: Vec<_> =
            findings.trials.iter().map(|outcome| outcome.called_after).collect();
        let svg = sonarfix_report::called_lost(&called_after)
            .map_err(|error| anyhow::anyhow!("cannot draw the figure: {error}"))?;
        sonarfix_files::write(file, svg)?;
    }
    print!("{}", health_page::markdown(&findings));
    Ok(())
}

/// Prints the section of the kidnapped robots alone.
fn only_kidnapped(args: &Args) -> anyhow::Result<()> {
    let runs = Runs::new(args.runs);
    let trials = kidnapped::trials(args.seed, args.runs.into(), &runs)?;
    runs.end()?;
    if !trials.is_empty() {
        print!("{}", health_page::kidnapped_section(&trials));
    }
    Ok(())
}
