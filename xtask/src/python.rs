//! The Python package: its wheel in an empty environment, its tests, types, style and notebooks.
//!
//! Everything is below `target/python`: `tools` is the environment of the checks, `empty` that of a user, `wheels` has the
//! wheel.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, ensure};

use crate::workspace::Workspace;
use crate::{cargo, symbols};

/// Largest wheel, bytes.
const MOST_BYTES: u64 = 15_000_000;
/// Longest time of the README's first lines in an empty environment, seconds.
const MOST_SECONDS: f64 = 10.0;

/// What is done with the notebooks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Keeps the outputs of the notebooks in docs/python.
    #[arg(long)]
    renew: bool,
}

impl Args {
    pub const CHECK: Self = Self { renew: false };
}

/// Builds the wheel, and runs everything of the package.
pub fn check(args: Args) -> anyhow::Result<()> {
    for task in ["fmt --all --check", "clippy --release -- -D warnings"] {
        cargo::check(Workspace::Python.cargo(task))?;
    }
    let tools = tools()?;
    let wheel = wheel(cargo::root())?;
    first_lines(&wheel)?;
    let install = ["install", "--quiet", "--no-deps", "--force-reinstall"];
    tools.run("pip", &install, &[&wheel])?;
    style_and_types(&tools)?;
    tests(&tools)?;
    notebooks(&tools, args)
}

/// The folder of the package.
fn source() -> PathBuf {
    Workspace::Python.folder()
}

fn folder() -> PathBuf {
    Workspace::Python.target_folder()
}

/// A virtual environment of Python.
struct Environment(PathBuf);

impl Environment {
    /// The environment of this name; created if it is missing.
    fn new(name: &str) -> anyhow::Result<Self> {
        let folder = folder().join(name);
        if !folder.join("bin/pip").exists() {
            let mut command = Command::new("python3");
            command.args(["-m", "venv"]).arg(&folder);
            cargo::check(command).context("Debian needs the package python3-venv")?;
        }
        Ok(Self(folder))
    }

    /// A program of the environment, which finds the others.
    fn command(&self, program: &str) -> anyhow::Result<Command> {
        let bin = self.0.join("bin");
        let mut command = Command::new(bin.join(program));
        let path = std::env::var_os("PATH").unwrap_or_default();
        let folders = std::iter::once(bin).chain(std::env::split_paths(&path));
        command.env("PATH", std::env::join_paths(folders)?).env("VIRTUAL_ENV", &self.0);
        // Without a display, and without bytecode in the sources.
        command.env("MPLBACKEND", "agg").env("PYTHONDONTWRITEBYTECODE", "1");
        command.current_dir(source());
        Ok(command)
    }

    fn run(&self, program: &str, arguments: &[&str], paths: &[&Path]) -> anyhow::Result<()> {
        let mut command = self.command(program)?;
        command.args(arguments).args(paths);
        cargo::check(command)
    }
}

/// The environment of the checks, with what they need.
fn tools() -> anyhow::Result<Environment> {
    let tools = Environment::new("tools")?;
    let requirements = source().join("requirements.txt");
    tools.run("pip", &["install", "--quiet", "--requirement"], &[&requirements])?;
    Ok(tools)
}

/// Builds the wheel of the sources in `root` for the oldest Linux that maturin supports, by zig as the linker. It replaces the last one.
pub fn wheel(root: &Path) -> anyhow::Result<PathBuf> {
    let wheels = folder().join("wheels");
    if wheels.exists() {
        std::fs::remove_dir_all(&wheels)?;
    }
    let mut command = tools()?.command("maturin")?;
    command.args(["build", "--release", "--locked", "--zig", "--compatibility", "manylinux2014"]);
    command.arg("--out").arg(&wheels).env("CARGO_TARGET_DIR", folder());
    command.current_dir(root.join(Workspace::Python.path()));
    cargo::reproducible(&mut command, root, &[])?;
    symbols::same_in_every_folder(&mut command, root)?;
    cargo::check(command)?;
    let found = std::fs::read_dir(&wheels)?.next().context("maturin has written no wheel")??;
    let bytes = found.metadata()?.len();
    println!("{}: {bytes} bytes", found.path().display());
    ensure!(bytes <= MOST_BYTES, "the limit is {MOST_BYTES} bytes");
    Ok(found.path())
}

/// Installs the wheel into an empty environment, and runs the README's first lines there, which draw a run.
fn first_lines(wheel: &Path) -> anyhow::Result<()> {
    let empty = folder().join("empty");
    if empty.exists() {
        std::fs::remove_dir_all(&empty)?;
    }
    let empty = Environment::new("empty")?;
    let with_plots = format!("{}[plot]", wheel.display());
    empty.run("pip", &["install", "--quiet", &with_plots], &[])?;
    let readme = std::fs::read_to_string(source().join("README.md"))?;
    let lines = readme.split("```python\n").nth(1).and_then(|rest| rest.split("```").next());
    let mut command = empty.command("python")?;
    command.arg("-c").arg(lines.context("the README has no Python")?).current_dir(folder());
    let start = Instant::now();
    cargo::check(command)?;
    let seconds = start.elapsed().as_secs_f64();
    println!("the README's first lines in an empty environment: {seconds:.1} s");
    ensure!(folder().join("paper.png").exists(), "the README's first lines have drawn nothing");
    ensure!(seconds <= MOST_SECONDS, "the limit is {MOST_SECONDS} s");
    Ok(())
}

fn style_and_types(tools: &Environment) -> anyhow::Result<()> {
    tools.run("ruff", &["check", "--no-cache", "."], &[])?;
    tools.run("ruff", &["format", "--no-cache", "--check", "."], &[])?;
    let cache = folder().join("mypy");
    let cache = format!("--cache-dir={}", cache.display());
    tools.run("mypy", &["--strict", &cache, "sonarfix", "examples"], &[])?;
    // In another folder: the stubs are compared with the installed package.
    let mut command = tools.command("stubtest")?;
    command.args(["sonarfix", "--mypy-config-file"]).arg(source().join("pyproject.toml"));
    command.current_dir(folder());
    cargo::check(command)
}

/// Runs the tests of the installed package against the command of the same sources.
fn tests(tools: &Environment) -> anyhow::Result<()> {
    cargo::run("build --release --bin sonarfix")?;
    let mut command = tools.command("pytest")?;
    // Beside the sources Python would import them in place of the installed package.
    command.current_dir(source().join("tests"));
    command.args(["-p", "no:cacheprovider", "--durations=5", "."]);
    command.env("SONARFIX_COMMAND", cargo::target_folder().join("release/sonarfix"));
    cargo::check(command)
}

/// Executes the notebooks from empty to end.
fn notebooks(tools: &Environment, args: Args) -> anyhow::Result<()> {
    let keep = if args.renew { ["notebooks.py", "--keep"].as_slice() } else { &["notebooks.py"] };
    tools.run("python", keep, &[])
}
