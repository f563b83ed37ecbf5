//! Runs cargo and other programs.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};
use serde::Deserialize;

/// Runs cargo with these arguments, none of which contains a space.
pub fn run(arguments: &str) -> anyhow::Result<()> {
    check(command(arguments))
}

/// A cargo command with these arguments.
pub fn command(arguments: &str) -> Command {
    let mut command = Command::new("cargo");
    command.args(arguments.split_whitespace());
    command.env("SONARFIX_SKIPPED", skipped_file());
    command
}

/// Installs a program of this version; does nothing if it is there. Without optimization, which would take longer than a check
/// that uses the program.
pub fn install(name: &str, version: &str) -> anyhow::Result<()> {
    let installed = printed(command("install --list"))?;
    let line = format!("{name} v{version}:");
    if installed.lines().any(|it| it == line) {
        return Ok(());
    }
    run(&format!("install {name} --version {version} --locked --quiet --debug"))
}

/// Where builds go, whatever folder cargo runs in.
pub fn target_folder() -> PathBuf {
    let chosen = std::env::var_os("CARGO_TARGET_DIR");
    chosen.map_or_else(|| root().join("target"), |chosen| root().join(chosen))
}

/// The file to which a check that is skipped adds a line. Tests of the crates get it in an environment variable.
pub fn skipped_file() -> PathBuf {
    target_folder().join("skipped.txt")
}

/// The root of the repository.
pub fn root() -> &'static Path {
    let xtask = Path::new(env!("CARGO_MANIFEST_DIR"));
    xtask.parent().unwrap_or(xtask)
}

/// Makes a build from the sources in `root` the same in every folder and at every time: neither that of the sources nor that of cargo is in
/// it, and the time of the build that Espressif's description of a program has is 1970.
/// `others` are further flags of the compiler.
pub fn reproducible(build: &mut Command, root: &Path, others: &[&str]) -> anyhow::Result<()> {
    let remap = |from: &Path, to| format!("--remap-path-prefix={}={to}", from.display());
    let remaps = [remap(root, "/sonarfix"), remap(&home()?, "/cargo")];
    let flags: Vec<&str> =
        remaps.iter().map(String::as_str).chain(others.iter().copied()).collect();
    build.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}")).env("SOURCE_DATE_EPOCH", "0");
    Ok(())
}

/// Where cargo keeps the sources of dependencies.
pub fn home() -> anyhow::Result<PathBuf> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    home.context("there is neither CARGO_HOME nor a home")
}

/// A package that another project publishes.
#[derive(Debug, Deserialize)]
pub struct Dependency {
    pub name: String,
    pub version: String,
    pub license: Option<String>,
    pub manifest_path: PathBuf,
    /// None for a package of this repository.
    source: Option<String>,
}

/// All dependencies in the metadata that a command prints.
pub fn dependencies(metadata: Command) -> anyhow::Result<Vec<Dependency>> {
    #[derive(Deserialize)]
    struct Metadata {
        packages: Vec<Dependency>,
    }
    let metadata: Metadata =
        serde_json::from_str(&printed(metadata)?).context("cannot read cargo's metadata")?;
    Ok(metadata.packages.into_iter().filter(|package| package.source.is_some()).collect())
}

/// Prints a command and runs it; fails if it fails.
pub fn check(mut command: Command) -> anyhow::Result<()> {
    let shown = shown(&command);
    eprintln!("── {shown}");
    let status = command.status().with_context(|| format!("cannot start `{shown}`"))?;
    if !status.success() {
        bail!("`{shown}` failed");
    }
    Ok(())
}

/// Runs a command and returns its standard output; its standard error goes to the terminal.
pub fn printed(mut command: Command) -> anyhow::Result<String> {
    let shown = shown(&command);
    command.stderr(std::process::Stdio::inherit());
    let output = command.output().with_context(|| format!("cannot start `{shown}`"))?;
    if !output.status.success() {
        bail!("`{shown}` failed");
    }
    Ok(String::from_utf8(output.stdout)?)
}

/// Runs a command and returns its standard output and standard error.
pub fn output(mut command: Command) -> anyhow::Result<String> {
    let shown = shown(&command);
    let output = command.output().with_context(|| format!("cannot start `{shown}`"))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let all = text(&output.stdout) + &text(&output.stderr);
    if !output.status.success() {
        bail!("`{shown}` failed: {}", all.trim());
    }
    Ok(all)
}

fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(std::ffi::OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}
