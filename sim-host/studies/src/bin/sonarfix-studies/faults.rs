//! `sonarfix-studies faults`: the effects of hardware faults.

use sonarfix_studies::{fault_search, fault_table};

use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of runs per fault.
    #[arg(long, default_value_t = 20)]
    runs: u32,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    let runs = Runs::new(args.runs.saturating_mul(fault_table::CASES + fault_search::CASES));
    let rows = fault_table::rows(args.runs, &runs)?;
    let searching = fault_search::rows(args.runs, &runs)?;
    let with_gyro = fault_table::gyro_rows(args.runs, &runs)?;
    runs.end()?;
    print!("{}", fault_table::markdown(&rows, &searching, &with_gyro));
    Ok(())
}
