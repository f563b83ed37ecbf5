//! What a release consists of: archives of the command, programs of the boards, the site, and the packages of the C library; and
//! the check that their users can run and build them.

mod firmware;
mod licences;
mod program;
mod site;

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
    /// Only the archive of the site.
    #[arg(long, conflicts_with = "program")]
    site: bool,
}

impl Args {
    /// Those of CI.
    pub fn check() -> Self {
        Self { out: PathBuf::from("target/dist"), check: true, program: false, site: false }
    }
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let out = cargo::root().join(&args.out);
    fs::create_dir_all(&out)?;
    if args.site {
        return site(args, &out);
    }
    let firmware = firmware::programs(&out)?;
    program::archives(&out, &firmware)?;
    checksums(&out)?;
    if args.check {
        let copy = copy()?;
        program::check(&out, &copy)?;
        firmware::check(&out, &copy)?;
        fs::remove_dir_all(copy)?;
    }
    if args.program { Ok(()) } else { packages(args) }
}

fn site(args: &Args, out: &Path) -> anyhow::Result<()> {
    let archive = site::archive(out, cargo::root())?;
    checksums(out)?;
    if args.check {
        let copy = copy()?;
        site::check(&archive, &copy)?;
        fs::remove_dir_all(copy)?;
    }
    Ok(())
}

/// The sums of all archives of this version and of the programs of the boards, as `sha256sum --check` reads them.
fn checksums(out: &Path) -> anyhow::Result<()> {
    let mut files = Vec::new();
    for folder in [out.to_owned(), out.join(firmware::FOLDER)] {
        let entries = fs::read_dir(folder).into_iter().flatten();
        files.extend(entries.filter_map(|entry| Some(entry.ok()?.path())));
    }
    let own = format!("sonarfix-{}-", env!("CARGO_PKG_VERSION"));
    files.retain(|file| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let is_archive = name.starts_with(&own) && name.ends_with(".tar.gz");
        file.is_file() && (is_archive || file.parent() != Some(out))
    });
    files.sort();
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
