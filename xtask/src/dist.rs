//! What a release consists of: archives of the command, programs of the boards, and the packages of the C library; and the
//! check that their users can run and build them.

mod firmware;
mod licences;
mod program;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

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
    /// Only the archives of the command and the programs of the boards.
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
    fs::create_dir_all(&out)?;
    let firmware = firmware::programs(&out)?;
    let archives = program::archives(&out, &firmware)?;
    checksums(&out, &[archives, firmware].concat())?;
    if args.check {
        let copy = copy()?;
        program::check(&out, &copy)?;
        firmware::check(&out, &copy)?;
        fs::remove_dir_all(copy)?;
    }
    if args.program { Ok(()) } else { packages(args) }
}

/// The sums of the files, as `sha256sum --check` reads them.
fn checksums(out: &Path, files: &[PathBuf]) -> anyhow::Result<()> {
    let mut sums = Command::new("sha256sum");
    sums.current_dir(out).args(files.iter().filter_map(|file| file.strip_prefix(out).ok()));
    Ok(fs::write(out.join("SHA256SUMS"), cargo::printed(sums)?)?)
}

/// A copy of the committed sources in another folder.
fn copy() -> anyhow::Result<PathBuf> {
    let copy = cargo::target_folder().join("another folder");
    if copy.exists() {
        fs::remove_dir_all(&copy)?;
    }
    let mut clone = Command::new("git");
    clone.args(["clone", "--quiet"]).arg(cargo::root()).arg(&copy);
    cargo::check(clone)?;
    Ok(copy)
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
