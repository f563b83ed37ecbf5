//! Makes the packages of the C library, and its portable C source.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};

mod check;
mod command;
mod header;
mod library;
mod package;
mod packages;
mod portable;
mod target;

#[derive(Debug, Parser)]
#[command(about = "Makes the packages of the C library")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Writes the portable C source; needs `wasm2c` (wabt).
    Portable {
        /// Features of the library, separated by commas.
        #[arg(long)]
        features: String,
        /// The file.
        #[arg(long)]
        out: PathBuf,
    },
    /// Makes all packages.
    Packages {
        /// The folder.
        #[arg(long)]
        out: PathBuf,
        /// Checks them, too: builds everything that a user would build, and drives the examples in the simulator.
        #[arg(long)]
        check: bool,
    },
}

fn main() -> Result<()> {
    let workspace = std::env::current_dir()?;
    match Arguments::parse().command {
        Command::Portable { features, out } => {
            let header = workspace.join("include/sonarfix.h");
            let header = std::fs::read_to_string(&header)
                .with_context(|| format!("{}: run this in the folder c", header.display()))?;
            let prototypes = header::prototypes(&header)?;
            let source = portable::source(&workspace, &features, &prototypes)?;
            Ok(std::fs::write(out, source)?)
        }
        Command::Packages { out, check } => {
            let packages = packages::make(&workspace, &out)?;
            if check {
                check::run(&workspace, &packages, &library::built(&workspace).join("check"))?;
            }
            Ok(())
        }
    }
}
