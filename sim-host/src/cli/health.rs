//! `sonarfix health`: how far the verdict can be trusted.

use std::path::PathBuf;

use anyhow::Context;

use crate::{health_page, report};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// How many runs of each scenario, and how many robots that are carried off.
    #[arg(long, default_value_t = 1_000)]
    runs: u32,
    /// Writes the figure of how long it takes here, as SVG.
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<PathBuf>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    let findings = health_page::findings(args.runs)?;
    if let Some(file) = &args.figure {
        let svg = report::called_lost(&findings.trials)
            .map_err(|error| anyhow::anyhow!("cannot draw the figure: {error}"))?;
        std::fs::write(file, svg).with_context(|| format!("cannot write {}", file.display()))?;
    }
    print!("{}", health_page::markdown(&findings));
    Ok(())
}
