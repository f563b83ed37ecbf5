//! The library as a WebAssembly module whose constants lie at a chosen address, and wasm2c's translation of it.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, ensure};

use crate::command::output;
use crate::library::built;

/// The version of wasm2c whose output is taken apart.
const WASM2C: &str = "1.0.32";

/// A translated module.
#[derive(Debug)]
pub struct Translation {
    /// What wasm2c writes.
    pub source: String,
    /// What `wasm-objdump --disassemble` prints.
    pub disassembly: String,
}

/// Builds the library with these features and translates it. Its constants begin at `base`.
///
/// # Errors
/// If a tool is missing or fails.
pub fn translate(workspace: &Path, features: &str, base: u32) -> Result<Translation> {
    let module = compile(workspace, features, base)?;
    let version = output(Command::new("wasm2c").arg("--version"))?;
    ensure!(version.trim() == WASM2C, "wasm2c is of version {version}, not {WASM2C}");
    let source = module.with_extension("c");
    output(Command::new("wasm2c").arg(&module).arg("-o").arg(&source))?;
    let disassembly = output(Command::new("wasm-objdump").arg("--disassemble").arg(&module))?;
    Ok(Translation { source: std::fs::read_to_string(source)?, disassembly })
}

/// Compiles the library. The module has no memory of its own: its addresses are those of the machine.
fn compile(workspace: &Path, features: &str, base: u32) -> Result<PathBuf> {
    let target = built(workspace).join("portable");
    let link = ["--no-stack-first", "--max-memory=4294967296", &format!("--global-base={base}")]
        .map(|argument| format!("-Clink-arg={argument}"));
    let flags = [&link[..], &["-Cstrip=none".to_owned()]].concat().join("\u{1f}");
    let mut cargo = Command::new("cargo");
    cargo.current_dir(workspace).env("CARGO_ENCODED_RUSTFLAGS", flags);
    cargo.args(["rustc", "--release", "--package", "sonarfix-staticlib", "--lib"]);
    cargo.args(["--crate-type", "cdylib", "--target", "wasm32-unknown-unknown"]);
    cargo.args(["--no-default-features", "--features", features]);
    output(cargo.arg("--target-dir").arg(&target))?;
    Ok(target.join("wasm32-unknown-unknown/release/sonarfix.wasm"))
}
