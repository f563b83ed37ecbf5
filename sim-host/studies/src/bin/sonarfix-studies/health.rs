//! `sonarfix-studies health`: the reliability of the health verdict.

use std::path::PathBuf;

use sonarfix_studies::health_page;

use sonarfix_terminal::output::check_file;
use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of runs of each scenario, and of trials with kidnapped robots.
    #[arg(long, default_value_t = 1_000)]
    runs: u32,
    /// The figure of the detection time to write, as SVG.
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<PathBuf>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    if let Some(file) = &args.figure {
        check_file("--figure", file)?;
    }
    let runs = Runs::new(args.runs.saturating_mul(health_page::SETS));
    let findings = health_page::findings(args.runs, &runs)?;
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
