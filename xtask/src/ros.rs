//! The ROS 2 node: its own checks, a client over Eclipse Cyclone DDS in a network of its own, and its figures.
//!
//! Everything is below `target/ros`; `tools` is the environment of the client.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, ensure};

use crate::cargo;
use crate::workspace::Workspace;

/// The page with the table of parameters.
const PAGE: &str = "docs/ros.md";
const BEGIN: &str = "<!-- parameters -->\n";
const END: &str = "<!-- end of parameters -->";
/// The measured figures, which `docs/figures.toml` reads.
const FIGURES: &str = "ros/figures.toml";

/// What is done with the node.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Writes the table of parameters into docs/ros.md.
    #[arg(long)]
    write: bool,
    /// Measures the figures with an optimized program, and writes ros/figures.toml (minutes).
    #[arg(long)]
    measure: bool,
    /// How long the node runs at ten times the speed for its figures, seconds.
    #[arg(long, default_value_t = 120)]
    seconds: u32,
}

impl Args {
    pub const CHECK: Self = Self { write: false, measure: false, seconds: 0 };
}

/// Checks the node, or writes what is measured or made of it.
pub fn run(args: &Args) -> anyhow::Result<()> {
    if args.measure {
        return measure(args.seconds);
    }
    for task in ["fmt --all --check", "clippy --all-targets -- -D warnings", "test"] {
        cargo::check(Workspace::Ros.cargo(task))?;
    }
    cargo::check(Workspace::Ros.cargo("build --bins --examples"))?;
    parameters(args.write)?;
    let python = Python::new()?;
    for task in [["check", "--no-cache"].as_slice(), &["format", "--no-cache", "--check"]] {
        let mut command = Command::new(python.tool("ruff"));
        command.args(task).arg(".").current_dir(python.folder());
        cargo::check(command)?;
    }
    python.in_a_network("debug", &["-m", "pytest", "-p", "no:cacheprovider", "--durations=5", "."])
}

/// Compares the table of parameters with the page, or writes it.
fn parameters(writes: bool) -> anyhow::Result<()> {
    let table = cargo::printed(Workspace::Ros.cargo("run --quiet -- parameters"))?;
    let path = cargo::root().join(PAGE);
    let page = fs::read_to_string(&path).context(PAGE)?;
    let parts =
        page.split_once(BEGIN).and_then(|(head, rest)| Some((head, rest.split_once(END)?.1)));
    let (head, tail) = parts.with_context(|| format!("{PAGE} has no place for the parameters"))?;
    let renewed = format!("{head}{BEGIN}{table}{END}{tail}");
    if writes {
        return Ok(fs::write(&path, renewed)?);
    }
    ensure!(
        page == renewed,
        "the parameters in {PAGE} are not those of the node: cargo xtask ros --write"
    );
    Ok(())
}

/// Measures the optimized program.
fn measure(seconds: u32) -> anyhow::Result<()> {
    cargo::check(Workspace::Ros.cargo("build --release --bins --examples"))?;
    let python = Python::new()?;
    let out = cargo::root().join(FIGURES);
    let (out, seconds) = (out.display().to_string(), seconds.to_string());
    python.in_a_network("release", &["measure.py", &out, &seconds])
}

/// The environment of the client.
struct Python(PathBuf);

impl Python {
    /// The environment with what the client needs; created if it is missing.
    fn new() -> anyhow::Result<Self> {
        let python = Self(Workspace::Ros.target_folder().join("tools"));
        if !python.tool("pip").exists() {
            let mut command = Command::new("python3");
            command.args(["-m", "venv"]).arg(&python.0);
            cargo::check(command).context("Debian needs the package python3-venv")?;
        }
        let mut pip = Command::new(python.tool("pip"));
        pip.args(["install", "--quiet", "--requirement"])
            .arg(python.folder().join("requirements.txt"));
        cargo::check(pip)?;
        Ok(python)
    }

    fn tool(&self, name: &str) -> PathBuf {
        self.0.join("bin").join(name)
    }

    #[expect(clippy::unused_self, reason = "beside `tool`")]
    fn folder(&self) -> PathBuf {
        Workspace::Ros.folder().join("tests/python")
    }

    /// Runs Python in a network that has nothing but a loopback interface, so that no other node is in the graph.
    fn in_a_network(&self, profile: &str, arguments: &[&str]) -> anyhow::Result<()> {
        let script = "ip link set lo up && ip link set lo multicast on && exec \"$@\"";
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--net", "bash", "-c", script, "network"]);
        command.arg(self.tool("python")).args(arguments).current_dir(self.folder());
        command.env("SONARFIX_ROS_PROGRAMS", Workspace::Ros.target_folder().join(profile));
        command.env("PYTHONDONTWRITEBYTECODE", "1");
        cargo::check(command).context("the client in a network of its own")
    }
}
