//! `sonarfix convert`: recordings of other formats, for `sonarfix replay`.

use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};

use crate::convert::carmen::Carmen;
use crate::convert::lego::{ENCODER_LAG, Lego, Nominal};
use crate::convert::{ConvertError, Converted};

/// Lines that are left out are told one by one up to this many.
const TOLD: u64 = 10;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    format: Format,
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
        /// The wheels that robot.toml has; robot-NAME.toml is written for each.
        #[arg(long, value_enum, default_value_t = NominalName::Fitted)]
        nominal: NominalName,
        /// What is added to the encoders' stamps, seconds, to make them those of the scans.
        #[arg(long, default_value_t = ENCODER_LAG, allow_negative_numbers = true)]
        encoder_lag: f64,
    },
    /// A log of the CARMEN toolkit, packed (.gz) or not.
    Carmen {
        /// The log.
        from: PathBuf,
        /// The walls, as CSV: x1, y1, x2, y2 in metres. Without them, no map.toml is written.
        #[arg(long, value_name = "WALLS.csv")]
        walls: Option<PathBuf>,
        /// The folder to write.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum NominalName {
    /// Fitted to the recording: 0.3255 and 0.3289 mm a tick, 170.2 mm.
    Fitted,
    /// Rounded: 0.327 mm a tick, 170 mm.
    Rounded,
    /// What the lectures use: 0.349 mm a tick, 150 mm.
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
    match &args.format {
        Format::Lego { from, out, nominal, encoder_lag } => {
            anyhow::ensure!(encoder_lag.is_finite(), "--encoder-lag must be finite");
            let nominal = (*nominal).into();
            let lego = Lego { from, to: out, nominal, encoder_lag: *encoder_lag };
            convert(out, |report| lego.convert(report))
        }
        Format::Carmen { from, walls, out } => {
            let carmen = Carmen { from, walls: walls.as_deref(), to: out };
            convert(out, |report| carmen.convert(report))
        }
    }
}

fn convert(
    out: &Path,
    run: impl FnOnce(&mut dyn FnMut(String)) -> Result<Converted, ConvertError>,
) -> anyhow::Result<()> {
    let mut told = 0_u64;
    let converted = run(&mut |complaint| {
        told += 1;
        if told <= TOLD {
            eprintln!("skipped: {complaint}");
        }
    })?;
    if told > TOLD {
        eprintln!("skipped: {} more lines", told - TOLD);
    }
    let Converted { encoders, scans, reference, stale, skipped } = converted;
    eprintln!(
        "{}: {encoders} encoder records ({stale} stale ones left out), {scans} scans, \
         {reference} rows of reference; {skipped} lines skipped",
        out.display()
    );
    Ok(())
}
