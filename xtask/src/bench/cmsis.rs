//! The source of CMSIS-DSP: the package `cmsisdsp` of `PyPI`, at the version of `bench/cmsis/requirements.txt`.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::Context;

use crate::cargo;
use crate::workspace::Workspace;

/// Downloads and unpacks the source, if that has not been done.
pub fn fetch() -> anyhow::Result<()> {
    // `bench/.cargo/config.toml` has the path, for `bench/cmsis/build.rs`.
    let unpacked = cargo::root().join("target/bench/cmsisdsp");
    if unpacked.join("Source").exists() {
        return Ok(());
    }
    fs::create_dir_all(&unpacked)?;
    let mut pip = Command::new("python3");
    pip.args(["-m", "pip", "download", "--quiet", "--no-deps", "--no-binary", "cmsisdsp"]);
    pip.arg("--require-hashes").arg("--requirement").arg(requirements());
    pip.arg("--dest").arg(&unpacked);
    cargo::check(pip).context("the source of CMSIS-DSP cannot be downloaded")?;
    let mut tar = Command::new("tar");
    tar.args(["-xzf", &format!("cmsisdsp-{}.tar.gz", version()?), "--strip-components=1"]);
    tar.current_dir(&unpacked);
    cargo::check(tar)
}

/// The version of the package.
pub fn version() -> anyhow::Result<String> {
    let text = fs::read_to_string(requirements())?;
    let (_, pinned) = text.split_once("cmsisdsp==").context("the version is not pinned")?;
    Ok(pinned.split_whitespace().next().unwrap_or_default().to_owned())
}

fn requirements() -> PathBuf {
    Workspace::Bench.folder().join("cmsis/requirements.txt")
}
