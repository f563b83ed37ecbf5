//! `sonarfix config`: the configuration image of a robot.

use std::path::{Path, PathBuf};

use anyhow::Context;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::baked;
use sonarfix_map::{robot_file, robot_text};

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
        What::Bake { robot, out } => {
            check_file("--out", out)?;
            let config = robot_file::read(robot)?;
            let mut buffer = [0; baked::LENGTH_MAX];
            let bytes = baked::write(&config, &mut buffer)?;
            sonarfix_files::write(out, bytes)?;
            println!("{}: {} bytes, {}", out.display(), bytes.len(), checksum(&config));
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
