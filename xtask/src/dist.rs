//! What a release consists of: archives of the command, programs of the boards, the site, and the packages of the C library; and
//! the check that their users can run and build them.

mod firmware;
mod licences;
mod program;
mod ros;
mod site;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::ensure;

use crate::workspace::Workspace;
use crate::{cargo, python};

#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "flags of a command line")]
pub struct Args {
    /// The folder of the packages.
    #[arg(long, default_value = "target/dist")]
    out: PathBuf,
    /// Checks them, too.
    #[arg(long)]
    check: bool,
    /// Only the archives of the command and the programs of the boards.
    #[arg(long, group = "part")]
    program: bool,
    /// Only the archive of the site.
    #[arg(long, group = "part")]
    site: bool,
    /// Only the archives of the ROS 2 node.
    #[arg(long, group = "part")]
    ros: bool,
    /// Only the wheel of the Python package for this PC.
    #[arg(long, group = "part")]
    wheel: bool,
}

impl Args {
    /// Those of CI.
    pub fn check() -> Self {
        Self {
            out: PathBuf::from("target/dist"),
            check: true,
            program: false,
            site: false,
            ros: false,
            wheel: false,
        }
    }
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let out = cargo::root().join(&args.out);
    fs::create_dir_all(&out)?;
    if args.site {
        site(args, &out)?;
    } else if args.ros {
        ros::archives(&out)?;
        if args.check {
            of_copy(|copy| ros::check(&out, copy))?;
        }
    } else if args.wheel {
        wheel(args, &out)?;
    } else {
        let firmware = firmware::programs(&out)?;
        program::archives(&out, &firmware)?;
        if args.check {
            of_copy(|copy| {
                program::check(&out, copy)?;
                firmware::check(&out, copy)
            })?;
        }
        if !args.program {
            packages(args)?;
        }
    }
    checksums(&out)
}

fn site(args: &Args, out: &Path) -> anyhow::Result<()> {
    let archive = site::archive(out, cargo::root())?;
    if args.check { of_copy(|copy| site::check(&archive, copy)) } else { Ok(()) }
}

/// Writes the wheel. The check of what it does is `cargo xtask python`.
fn wheel(args: &Args, out: &Path) -> anyhow::Result<()> {
    let built = python::wheel(cargo::root())?;
    let wheel = out.join(built.file_name().unwrap_or_default());
    fs::copy(&built, &wheel)?;
    if args.check {
        of_copy(|copy| {
            let second = fs::read(python::wheel(copy)?)?;
            ensure!(fs::read(&wheel)? == second, "the wheel of another folder has other bytes");
            Ok(())
        })?;
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
    files.retain(|file| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let is_archive = name.contains(concat!("-", env!("CARGO_PKG_VERSION")))
            && [".tar.gz", ".zip", ".whl"].iter().any(|ending| name.ends_with(ending));
        file.is_file() && (is_archive || file.parent() != Some(out))
    });
    files.sort();
    let mut sums = Command::new("sha256sum");
    sums.current_dir(out).args(files.iter().filter_map(|file| file.strip_prefix(out).ok()));
    Ok(fs::write(out.join("SHA256SUMS"), cargo::printed(sums)?)?)
}

/// Passes a copy of the committed sources in another folder to a check.
fn of_copy(check: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let copy = copy()?;
    check(&copy)?;
    Ok(fs::remove_dir_all(copy)?)
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
