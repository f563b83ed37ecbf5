//! `sonarfix faults`: the effects of hardware faults.

use sonarfix_studies::{fault_search, fault_table};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of runs per fault.
    #[arg(long, default_value_t = 20)]
    runs: u64,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    let (rows, searching) = (fault_table::rows(args.runs)?, fault_search::rows(args.runs)?);
    print!("{}", fault_table::markdown(&rows, &searching));
    Ok(())
}
