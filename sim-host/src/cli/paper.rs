//! `sonarfix paper`: the reference scenario, and the paper's Table 1 beside ours.

use clap::ValueEnum;
use sonarfix::aim::Policy;
use sonarfix_map::Scenario;

use super::run::{Experiment, FidelityName, Output};
use crate::simulate::Simulation;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// How many runs.
    #[arg(long, default_value_t = 50)]
    runs: u32,
    /// Seed of the first run; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Which wall the sonar looks at.
    #[arg(long, value_enum, default_value_t = PolicyName::Nearest)]
    policy: PolicyName,
    /// Lets the true parameters walk as the filter assumes: the variant in which the filter is
    /// asked to be efficient and consistent.
    #[arg(long)]
    statistics: bool,
    /// What is simulated between world and localizer.
    #[arg(long, value_enum, default_value_t = FidelityName::Ideal)]
    fidelity: FidelityName,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PolicyName {
    /// The nearest, as in the paper.
    Nearest,
    /// The one that lowers the variance of the position most.
    Informative,
}

impl From<PolicyName> for Policy {
    fn from(name: PolicyName) -> Self {
        match name {
            PolicyName::Nearest => Self::Nearest,
            PolicyName::Informative => Self::Informative,
        }
    }
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let mut scenario = Scenario::paper()?;
    scenario.robot.config.policy = args.policy.into();
    scenario.fidelity = args.fidelity.into();
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
