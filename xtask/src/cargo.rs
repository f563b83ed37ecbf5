//! Calling cargo and other programs.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};

/// Runs cargo with these arguments, which hold no spaces of their own.
pub fn run(arguments: &str) -> anyhow::Result<()> {
    check(command(arguments))
}

/// A cargo with these arguments.
pub fn command(arguments: &str) -> Command {
    let mut command = Command::new("cargo");
    command.args(arguments.split_whitespace());
    command
}

/// A cargo in the workspace `bench`, whose own configuration holds what its linker needs.
pub fn in_bench(arguments: &str) -> Command {
    let mut command = command(arguments);
    command.current_dir(root().join("bench")).env_remove("RUSTFLAGS");
    command.env("CARGO_TARGET_DIR", bench_target());
    command
}

/// Where builds go, whatever folder they start in.
pub fn target_directory() -> PathBuf {
    let chosen = std::env::var_os("CARGO_TARGET_DIR");
    chosen.map_or_else(|| root().join("target"), |chosen| root().join(chosen))
}

/// Where the workspace `bench` is built.
pub fn bench_target() -> PathBuf {
    target_directory().join("bench")
}

/// The project's root.
pub fn root() -> &'static Path {
    let xtask = Path::new(env!("CARGO_MANIFEST_DIR"));
    xtask.parent().unwrap_or(xtask)
}

/// Runs a command, shown to whoever watches, and fails if it does.
pub fn check(mut command: Command) -> anyhow::Result<()> {
    let shown = shown(&command);
    eprintln!("── {shown}");
    let status = command.status().with_context(|| format!("cannot start `{shown}`"))?;
    if !status.success() {
        bail!("`{shown}` failed");
    }
    Ok(())
}

/// What a command printed; its errors are shown to whoever watches.
pub fn printed(mut command: Command) -> anyhow::Result<String> {
    let shown = shown(&command);
    command.stderr(std::process::Stdio::inherit());
    let output = command.output().with_context(|| format!("cannot start `{shown}`"))?;
    if !output.status.success() {
        bail!("`{shown}` failed");
    }
    Ok(String::from_utf8(output.stdout)?)
}

/// What a command wrote, both to its output and to its errors.
pub fn output(mut command: Command) -> anyhow::Result<String> {
    let shown = shown(&command);
    let output = command.output().with_context(|| format!("cannot start `{shown}`"))?;
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let said = said(&output.stdout) + &said(&output.stderr);
    if !output.status.success() {
        bail!("`{shown}` failed: {}", said.trim());
    }
    Ok(said)
}

fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(std::ffi::OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}
