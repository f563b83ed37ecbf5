//! What a release consists of: archives of the command, and the packages of the C library; and the check that their users can
//! run and build them.

mod program;

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
    /// Only the archives of the command.
    #[arg(long)]
    program: bool,
}

impl Args {
    /// Those of CI.
    pub fn check() -> Self {
        Self { out: PathBuf::from("target/dist"), check: true, program: false }
    }
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let out = cargo::root().join(&args.out);
    std::fs::create_dir_all(&out)?;
    let archives = program::archives(&out)?;
    program::checksums(&out, &archives)?;
    if args.check {
        program::check(&out)?;
    }
    if args.program { Ok(()) } else { packages(args) }
}

fn packages(args: &Args) -> anyhow::Result<()> {
    cargo::check(Workspace::C.cargo("clippy --quiet --package sonarfix-dist -- -D warnings"))?;
    let mut command = Workspace::C.cargo("run --quiet --package sonarfix-dist -- packages");
    command.arg("--out").arg(cargo::root().join(&args.out));
    if args.check {
        command.arg("--check");
    }
    cargo::check(command)
}
