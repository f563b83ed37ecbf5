//! Archives of the ROS 2 node for a PC without ROS and without Rust: a static program, its page, licences.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::ensure;

use super::licences;
use super::program::{self, HOST, Program, TARGETS};
use crate::cargo;
use crate::workspace::Workspace;

const NODE: Program = Program {
    workspace: Workspace::Ros,
    package: "sonarfix-ros",
    profile: "release",
    file: "sonarfix-ros",
    flags: &[],
};

/// Writes an archive for each target into a folder.
pub fn archives(out: &Path) -> anyhow::Result<()> {
    for target in TARGETS {
        let folder = folder(out, target);
        if folder.exists() {
            fs::remove_dir_all(&folder)?;
        }
        fs::create_dir_all(&folder)?;
        fs::copy(program::build(&NODE, target, cargo::root())?, folder.join(NODE.file))?;
        for file in ["docs/ros.md", "LICENSE-MIT", "LICENSE-APACHE"] {
            let from = cargo::root().join(file);
            fs::copy(&from, folder.join(from.file_name().unwrap_or_default()))?;
        }
        let packages = format!("--package {} --target {target}", NODE.package);
        fs::write(folder.join("LICENSES.txt"), licences::of(NODE.workspace, &packages)?)?;
        let packed = out.join(format!("{}.tar.gz", name(target)));
        program::pack(out, &name(target), &packed)?;
        eprintln!("{}: {} bytes", packed.display(), fs::metadata(&packed)?.len());
    }
    Ok(())
}

fn name(target: &str) -> String {
    format!("{}-{}-{target}", NODE.file, env!("CARGO_PKG_VERSION"))
}

fn folder(out: &Path, target: &str) -> PathBuf {
    out.join(name(target))
}

/// Checks the archive of this PC: the program runs in a root that has nothing else, and a build of the same sources in another
/// folder has the same bytes.
pub fn check(out: &Path, copy: &Path) -> anyhow::Result<()> {
    let folder = folder(out, HOST);
    program::alone(&folder, "/sonarfix-ros", &["parameters"])?;
    let first = fs::read(folder.join(NODE.file))?;
    let second = fs::read(program::build(&NODE, HOST, copy)?)?;
    ensure!(first == second, "the program of another folder has other bytes");
    Ok(())
}
