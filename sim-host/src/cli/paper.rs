//! `sonarfix paper`: the reference scenario, and the paper's Table 1 beside ours.

use sonarfix_map::Scenario;

use super::overrides::Overrides;
use super::run::{Experiment, Output};
use crate::simulate::Simulation;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// How many runs.
    #[arg(long, default_value_t = 50)]
    runs: u32,
    /// Seed of the first run; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Lets the true parameters walk as the filter assumes: the variant in which the filter is
    /// asked to be efficient and consistent.
    #[arg(long)]
    statistics: bool,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    output: Output,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let mut scenario = Scenario::paper()?;
    args.overrides.apply(&mut scenario)?;
    if args.statistics {
        scenario.name.push_str("-statistics");
        scenario.let_truth_walk_as_assumed();
    }
    let experiment = Experiment {
        simulation: Simulation::new(scenario),
        runs: args.runs,
        seed: args.seed,
        beside_paper: true,
    };
    experiment.conduct(&args.output)
}
