//! `sonarfix sonar-model`: the simulated NXT sonar beside the recorded one.

use std::path::PathBuf;

use crate::sonar_model::{self, page};
use crate::world::sensor::SensorModel;

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
