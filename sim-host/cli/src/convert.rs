//! `sonarfix convert`: converts recordings of other formats for `sonarfix replay`.

use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};
use serde::Serialize;

use sonarfix_replay::convert::carmen::Carmen;
use sonarfix_replay::convert::lego::{ENCODER_LAG, Lego, Nominal};
use sonarfix_replay::convert::nxt::Nxt;
use sonarfix_replay::convert::{ConvertError, Converted};

use sonarfix_terminal::output::check_folder;

use crate::convert_rosbag;

/// Maximum number of skipped or implausible lines that are printed.
const SHOWN: u64 = 10;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    format: Format,
    /// Prints the counts as JSON.
    #[arg(long, global = true)]
    json: bool,
}

/// What was converted, as JSON.
#[derive(Debug, Serialize)]
struct Json<'a> {
    out: &'a Path,
    #[serde(flatten)]
    converted: Converted,
}

#[derive(Debug, Subcommand)]
enum Format {
    /// A LEGO robot with a laser scanner in an arena (C. Brenner's SLAM lectures).
    Lego {
        /// The folder with *_motors.txt, *_scan.txt and the derived walls and reference.
        from: PathBuf,
        /// The folder to write.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// The wheel parameters of robot.toml; robot-NAME.toml is written for each choice.
        #[arg(long, value_enum, default_value_t = NominalName::Fitted)]
        nominal: NominalName,
        /// Offset from the encoders' time stamps to those of the scans, seconds.
        #[arg(long, default_value_t = ENCODER_LAG, allow_negative_numbers = true)]
        encoder_lag: f64,
    },
    /// A log of the CARMEN toolkit, packed (.gz) or not.
    Carmen {
        /// The log.
        from: PathBuf,
        /// The walls as CSV: x1, y1, x2, y2 in metres. Without them no map.toml is written.
        #[arg(long, value_name = "WALLS.csv")]
        walls: Option<PathBuf>,
        /// The folder to write.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// A bag of ROS 2 (rosbag2): MCAP or `SQLite`, a folder or a file.
    Rosbag(Box<convert_rosbag::Args>),
    /// Sweeps of a LEGO NXT's rotating sonar (the data set `nxt_rotating_sonar`), for `find`.
    Nxt {
        /// The folder with sweeps.csv, `walls_cm.csv` and sweeps.
        from: PathBuf,
        /// The folder to write: a folder in it for each sweep.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum NominalName {
    /// Fitted to the recording: 0.3255 and 0.3289 mm per tick, 170.2 mm.
    Fitted,
    /// Rounded: 0.327 mm per tick, 170 mm.
    Rounded,
    /// The values of the lectures: 0.349 mm per tick, 150 mm.
    Course,
}

impl From<NominalName> for Nominal {
    fn from(name: NominalName) -> Self {
        match name {
            NominalName::Fitted => Self::Fitted,
            NominalName::Rounded => Self::Rounded,
            NominalName::Course => Self::Course,
        }
    }
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let json = args.json;
    match &args.format {
        Format::Lego { from, out, nominal, encoder_lag } => {
            anyhow::ensure!(encoder_lag.is_finite(), "--encoder-lag must be finite");
            let nominal = (*nominal).into();
            let lego = Lego { from, to: out, nominal, encoder_lag: *encoder_lag };
            convert(out, json, |report| lego.convert(report))
        }
        Format::Carmen { from, walls, out } => {
            let carmen = Carmen { from, walls: walls.as_deref(), to: out };
            convert(out, json, |report| carmen.convert(report))
        }
        Format::Rosbag(args) => {
            args.check()?;
            convert(args.out(), json, |report| args.convert(report))
        }
        Format::Nxt { from, out } => convert(out, json, |_| Nxt { from, to: out }.convert()),
    }
}

fn convert(
    out: &Path,
    json: bool,
    run: impl FnOnce(&mut dyn FnMut(String)) -> Result<Converted, ConvertError>,
) -> anyhow::Result<()> {
    check_folder("--out", out)?;
    let mut reported = 0_u64;
    let converted = run(&mut |complaint| {
        reported += 1;
        if reported <= SHOWN {
            eprintln!("{complaint}");
        }
    })?;
    if reported > SHOWN {
        eprintln!("{} more such lines", reported - SHOWN);
    }
    if json {
        return sonarfix_terminal::json::print(&Json { out, converted });
    }
    let Converted { encoders, ranges, scans, reference, repeated, skipped, restamped, bridged } =
        converted;
    eprintln!(
        "{}: {encoders} encoder records ({repeated} repeated ones left out), {ranges} ranges, {scans} scans, \
         {reference} rows of reference;\n{skipped} lines or messages skipped, {restamped} stamps repaired, \
         {bridged} steps of implausible odometry replaced",
        out.display()
    );
    Ok(())
}
