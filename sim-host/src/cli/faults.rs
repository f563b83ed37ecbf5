//! `sonarfix faults`: what every fault does to the robot in the classroom.

use crate::fault_table;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// How many runs for each fault.
    #[arg(long, default_value_t = 20)]
    runs: u64,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    print!("{}", fault_table::markdown(&fault_table::rows(args.runs)?));
    Ok(())
}
