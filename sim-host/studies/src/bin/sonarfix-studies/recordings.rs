//! `sonarfix-studies recordings`: recordings in the project's own format.

use std::path::PathBuf;

use anyhow::Context;
use sonarfix_studies::recordings;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A folder with recordings, in folders of their own: `log.csv`, `robot.toml`, `map.toml`, `reference.csv`.
    data: PathBuf,
    /// Replays them with this half of the cone instead of the robot files', too, degrees; repeatable.
    #[arg(long, value_name = "DEGREES")]
    cone: Vec<f32>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let rows = recordings::rows(&args.data, &args.cone)
        .with_context(|| format!("cannot read the recordings in {}", args.data.display()))?;
    anyhow::ensure!(!rows.is_empty(), "{} has no recordings", args.data.display());
    print!("{}", recordings::markdown(&rows));
    Ok(())
}
