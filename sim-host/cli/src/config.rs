//! `sonarfix config`: the configuration image of a robot.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use sonarfix_hal::config::{Feature, RobotConfig};
use sonarfix_link::baked;
use sonarfix_map::{robot_file, robot_text};
use sonarfix_new_robot::flash;

use crate::warnings;
use sonarfix_terminal::output::check_file;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Writes the configuration image of a robot file.
    Bake {
        /// The robot file (docs/formats.md).
        robot: PathBuf,
        /// The image to write.
        #[arg(long, value_name = "CONFIG.bin")]
        out: PathBuf,
        /// The board that gets the image: refuses a robot that its firmware cannot drive.
        #[arg(long, value_name = "NAME")]
        board: Option<String>,
        /// The features of a program of your own, separated by commas: refuses a robot that needs another one. The released
        /// programs have all.
        #[arg(long, value_delimiter = ',', value_parser = feature)]
        features: Option<Vec<Feature>>,
    },
    /// Checks a configuration image.
    Check {
        /// The image: written by `bake`, or read from flash.
        config: PathBuf,
    },
    /// Prints the configuration in an image.
    Show {
        /// The image: written by `bake`, or read from flash.
        config: PathBuf,
    },
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    match &args.what {
        What::Bake { robot, out, board, features } => {
            check_file("--out", out)?;
            let baked = bake(robot, features.as_deref(), board.as_deref())?;
            sonarfix_files::write(out, &baked.bytes)?;
            println!(
                "{}: {} bytes, checksum {:08x}",
                out.display(),
                baked.bytes.len(),
                baked.checksum
            );
        }
        What::Check { config: file } => {
            println!("{}: valid configuration, {}", file.display(), checksum(&read(file)?));
        }
        What::Show { config: file } => {
            let config = read(file)?;
            println!("# {}, {}\n{}", file.display(), checksum(&config), robot_text(&config));
        }
    }
    Ok(())
}

/// A configuration image, and the checksum that a robot reports for it.
#[derive(Debug)]
pub struct Baked {
    pub bytes: Vec<u8>,
    pub checksum: u32,
}

/// The configuration image of a robot file. Refuses a robot that needs another feature than these, or that the firmware of
/// the board cannot drive.
///
/// # Errors
/// What is wrong with the file, or which of these it is.
pub fn bake(
    robot: &Path,
    features: Option<&[Feature]>,
    board: Option<&str>,
) -> anyhow::Result<Baked> {
    let config = robot_file::read(robot)?;
    warnings::show(&[robot]);
    if let Some(features) = features {
        config.check_features(|feature| features.contains(&feature)).map_err(|lacks| {
            anyhow!("the robot needs `{}`, which --features does not name", lacks.0.name())
        })?;
    }
    if let Some(board) = board {
        flash::check_board(&sonarfix_boards::named(board)?, &config)?;
    }
    Ok(Baked { bytes: flash::configuration(&config)?, checksum: baked::checksum(&config) })
}

fn feature(name: &str) -> anyhow::Result<Feature> {
    let names = Feature::ALL.map(Feature::name).join(", ");
    let found = Feature::ALL.into_iter().find(|feature| feature.name() == name);
    found.with_context(|| format!("no such feature; there are {names}"))
}

fn read(file: &Path) -> anyhow::Result<RobotConfig> {
    let bytes = sonarfix_map::read_bytes(file)
        .with_context(|| format!("cannot read {}", file.display()))?;
    let name = file.display().to_string();
    let config = baked::read(&bytes).with_context(|| name.clone())?;
    robot_file::check(&config, &name)?;
    Ok(config)
}

/// A robot from a robot file or from a baked configuration.
///
/// # Errors
/// What is wrong with the file.
pub fn read_robot(file: &Path) -> anyhow::Result<RobotConfig> {
    let is_baked = file.extension().is_some_and(|extension| extension == "bin");
    if is_baked { read(file) } else { Ok(robot_file::read(file)?) }
}

/// The checksum that a robot reports for this configuration.
fn checksum(config: &RobotConfig) -> String {
    format!("checksum {:08x}", baked::checksum(config))
}
