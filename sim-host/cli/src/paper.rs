//! `sonarfix paper`: the reference scenario, with the results beside the paper's Table 1.

use sonarfix_map::Scenario;
use sonarfix_plan::overrides::Overrides;
use sonarfix_sim::simulate::Simulation;

use crate::provenance;
use crate::run::{Experiment, Output};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of runs.
    #[arg(long, default_value_t = 50)]
    runs: u32,
    /// Seed of the first run; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Gives the true parameters the random walk that the filter assumes: the variant for tests of
    /// efficiency and consistency.
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
        provenance: provenance::table(&[]),
        warnings: Vec::new(),
    };
    experiment.conduct(&args.output)
}
