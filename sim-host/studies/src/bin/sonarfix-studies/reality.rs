//! `sonarfix-studies reality`: all recordings of a folder.

use std::path::PathBuf;

use anyhow::Context;
use sonarfix_studies::reality::{self, page};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder with the recordings.
    data: PathBuf,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let findings = reality::findings(&args.data)
        .with_context(|| format!("cannot read the recordings in {}", args.data.display()))?;
    anyhow::ensure!(!findings.rows.is_empty(), "{} has no recordings", args.data.display());
    print!("{}", page::markdown(&findings));
    Ok(())
}
