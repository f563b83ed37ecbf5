//! Builds the compiled libraries.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;

use crate::command::output;

/// The compositions, by the names of their features in `c/Cargo.toml`, and what is added to the name of the library.
pub const COMPOSITIONS: [(&str, &str); 2] = [("full", ""), ("small", "_small")];

/// Builds the library of a composition for a target and strips its debug information by the tools with this prefix; returns its file.
///
/// Paths of this computer are left out, so that two folders give the same bytes.
///
/// # Errors
/// If cargo fails.
pub fn build(
    workspace: &Path,
    triple: &str,
    rustflags: &str,
    tools: &str,
    composition: &str,
) -> Result<PathBuf> {
    let root = workspace.canonicalize()?.join("..").canonicalize()?;
    let home = std::env::var("CARGO_HOME")
        .or_else(|_| std::env::var("HOME").map(|home| format!("{home}/.cargo")))?;
    let mut flags: Vec<String> = rustflags.split_whitespace().map(str::to_owned).collect();
    flags.push(format!("--remap-path-prefix={}=sonarfix", root.display()));
    flags.push(format!("--remap-path-prefix={home}=cargo"));
    let target = folder(workspace, triple, rustflags);
    let mut cargo = Command::new("cargo");
    cargo.current_dir(workspace).env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}"));
    cargo.args(["build", "--quiet", "--release", "--package", "sonarfix-staticlib"]);
    cargo.args(["--target", triple, "--no-default-features", "--features", composition]);
    output(cargo.arg("--target-dir").arg(&target))?;
    let built = target.join(triple).join("release/libsonarfix.a");
    let stripped = file(workspace, triple, rustflags, composition);
    let mut strip = Command::new(format!("{tools}strip"));
    strip.args(["--strip-debug", "--enable-deterministic-archives", "-o"]);
    output(strip.arg(&stripped).arg(built))?;
    Ok(stripped)
}

/// The library that [`build`] has built.
pub fn file(workspace: &Path, triple: &str, rustflags: &str, composition: &str) -> PathBuf {
    folder(workspace, triple, rustflags).join(format!("libsonarfix_{composition}.a"))
}

/// Where it is built. Each set of flags has a folder of its own: cargo would build all again at each change of them.
fn folder(workspace: &Path, triple: &str, rustflags: &str) -> PathBuf {
    let name = format!("dist/{triple}{}", rustflags.replace(['=', '+', ' '], ""));
    built(workspace).join(name)
}

/// The folder in which cargo builds this workspace.
pub fn built(workspace: &Path) -> PathBuf {
    let chosen = std::env::var_os("CARGO_TARGET_DIR");
    workspace.join(chosen.unwrap_or_else(|| "target".into()))
}
