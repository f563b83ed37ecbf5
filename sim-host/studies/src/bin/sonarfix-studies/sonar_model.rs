//! `sonarfix-studies sonar-model`: compares the simulated NXT sonar with recorded sweeps.

use std::path::PathBuf;

use sonarfix_sim::world::sensor::SensorModel;
use sonarfix_studies::sonar_model::{self, page};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder `nxt_rotating_sonar` with the recorded sweeps.
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let comparison = sonar_model::compare(&args.data, &SensorModel::nxt())?;
    print!("{}", page::markdown(&comparison));
    Ok(())
}
