//! The packages of the C library for other builds, and the check that their users can build and run them.

use std::path::PathBuf;

use crate::cargo;
use crate::workspace::Workspace;

#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// The folder of the packages.
    #[arg(long, default_value = "target/dist")]
    out: PathBuf,
    /// Checks them, too.
    #[arg(long)]
    check: bool,
}

impl Args {
    /// Those of CI.
    pub fn check() -> Self {
        Self { out: PathBuf::from("target/dist"), check: true }
    }
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    cargo::check(Workspace::C.cargo("clippy --quiet --package sonarfix-dist -- -D warnings"))?;
    let mut command = Workspace::C.cargo("run --quiet --package sonarfix-dist -- packages");
    command.arg("--out").arg(cargo::root().join(&args.out));
    if args.check {
        command.arg("--check");
    }
    cargo::check(command)
}
