//! What the longest poll of the loop costs, by part, and the fix of the localizer.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use anyhow::Context;

use crate::cargo;
use crate::elf::Program;
use crate::profile::{self, LOGGED, Pipe, Profile};
use crate::program::{M0PLUS, M4F_SMALL};
use crate::workspace::Workspace;

/// What is profiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// The worst fix of the probe on the Cortex-M0+ instead of the worst poll on the Cortex-M4F.
    #[arg(long)]
    fix: bool,
}

/// The scenario of the polls.
const RUN: &str = "run --quiet --release --bin sonarfix -- pil crates/sonarfix-map/scenarios/classroom.toml --seconds 60";
/// A poll of the application.
const POLL: &str = "sonarfix_app::app::App<F>::poll";
/// What executes a command: the polls that start the loop.
const START: &str = "sonarfix_app::app::command::<impl sonarfix_app::app::App<F>>::answer";

/// Parts by the beginning of a function's path, the first that matches. What matches none (library routines, sine and cosine)
/// belongs to its caller.
const PARTS: [(&str, &str); 23] = [
    ("sonarfix::filter::ekf::prediction", "prediction: state"),
    ("sonarfix::filter::covariance::propagation", "prediction: P"),
    ("sonarfix::filter::covariance", "correction"),
    ("sonarfix::filter::ekf::Ekf::predict_measurement", "gate: innovation"),
    ("sonarfix::filter::ekf::Ekf::innovation", "gate: innovation"),
    ("sonarfix::filter::ekf", "correction"),
    ("sonarfix::association::visibility", "expected range and its visibility"),
    ("sonarfix::sensor::range", "expected range and its visibility"),
    ("sonarfix::map", "expected range and its visibility"),
    ("sonarfix::association::echo", "echo model: association and evidence"),
    ("sonarfix::association::alternatives", "other reflectors"),
    ("sonarfix::association::reflector", "other reflectors"),
    ("sonarfix::aim", "choice of the wall"),
    ("sonarfix::health", "health"),
    ("sonarfix_search::search", "search"),
    ("sonarfix::", "localizer: the rest"),
    ("sonarfix_hal::ranger", "drivers"),
    ("sonarfix_hal::servo", "drivers"),
    ("sonarfix_hal::encoder", "drivers"),
    ("sonarfix_hal", "loop"),
    ("sonarfix_link::", "telemetry"),
    ("sonarfix_app::app::wire", "telemetry"),
    ("sonarfix_app", "application"),
];

/// Prints the parts of the worst poll, or of the worst fix.
pub fn run(args: Args) -> anyhow::Result<()> {
    let profile = if args.fix { worst_fix()? } else { worst_poll()? };
    print!("{}", table(&profile));
    Ok(())
}

/// The worst fix of the localizer on a Cortex-M0+.
fn worst_fix() -> anyhow::Result<Profile> {
    M0PLUS.build(Workspace::Emulated, "emulated-probe")?;
    let path = M0PLUS.program(Workspace::Emulated, "localizer");
    let pipe = Pipe::create("probe.pipe")?;
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-machine", M0PLUS.board, "-icount", "shift=7", "-display", "none"]);
    qemu.args(["-monitor", "none", "-serial", "none"]);
    qemu.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(&path);
    qemu.args(LOGGED).arg(pipe.path());
    profiled(qemu, &pipe, &Program::read(&path)?, "probe_fix", &[])
}

/// The worst poll on a Cortex-M4F, without those that start the loop.
fn worst_poll() -> anyhow::Result<Profile> {
    M4F_SMALL.build(Workspace::Emulated, "emulated-pil")?;
    let path = M4F_SMALL.program(Workspace::Emulated, "pil");
    let pipe = Pipe::create("poll.pipe")?;
    // `sonarfix pil` starts the emulator that is found first: a script that adds the log.
    let scripts = cargo::target_folder().join("logged");
    std::fs::create_dir_all(&scripts)?;
    let mut which = Command::new("which");
    which.arg("qemu-system-arm");
    let real = cargo::output(which)?;
    let script = scripts.join("qemu-system-arm");
    let (options, log) = (LOGGED.join(" "), pipe.path().display());
    std::fs::write(&script, format!("#!/bin/sh\nexec {} \"$@\" {options} {log}\n", real.trim()))?;
    executable(&script)?;
    let mut pil = cargo::command(RUN);
    pil.arg("--firmware").arg(&path);
    let known = std::env::var("PATH").unwrap_or_default();
    pil.env("PATH", format!("{}:{known}", scripts.display()));
    let profile = profiled(pil, &pipe, &Program::read(&path)?, POLL, &[START]);
    std::fs::remove_file(&script)?;
    profile
}

#[cfg(unix)]
fn executable(script: &Path) -> anyhow::Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    Ok(std::fs::set_permissions(script, std::fs::Permissions::from_mode(0o755))?)
}

#[cfg(not(unix))]
fn executable(_: &Path) -> anyhow::Result<()> {
    anyhow::bail!("the log of the emulator needs a named pipe")
}

fn profiled(
    mut command: Command,
    pipe: &Pipe,
    program: &Program,
    root: &str,
    skipped: &[&str],
) -> anyhow::Result<Profile> {
    command.stdout(std::process::Stdio::null());
    let mut child = command.spawn().context("cannot start the emulator")?;
    let profile = profile::most_expensive(pipe.path(), program, root, skipped);
    child.wait()?;
    profile
}

fn part_of<'n>(mut stack: impl Iterator<Item = &'n str>) -> &'static str {
    let part = |name: &str| {
        // `<sonarfix::… as …>::…` and `sonarfix::…::<impl …>::…`.
        let path = name.trim_start_matches('<');
        PARTS.iter().find(|(prefix, _)| path.starts_with(prefix)).map(|(_, part)| *part)
    };
    stack.find_map(part).unwrap_or("the rest")
}

/// The parts by their instructions, and [`routines`].
fn table(profile: &Profile) -> String {
    let mut parts: BTreeMap<&str, u64> = BTreeMap::new();
    for (at, node) in profile.nodes.iter().enumerate() {
        *parts.entry(part_of(profile.stack(at))).or_default() += node.own;
    }
    let all = profile.instructions();
    let mut parts: Vec<_> = parts.into_iter().collect();
    parts.sort_by_key(|&(_, instructions)| std::cmp::Reverse(instructions));
    let mut text = "| part | instructions | % |\n|---|---:|---:|\n".to_owned();
    // Writing to a string does not fail, here and below.
    for (part, instructions) in parts {
        let share = (100 * instructions + all / 2) / all;
        let _ = writeln!(text, "| {part} | {instructions} | {share} |");
    }
    let _ = writeln!(text, "| all | {all} | 100 |");
    text + &routines(profile)
}

/// The routines that compute in floating point where the core cannot: how often they are called, and what a call takes.
fn routines(profile: &Profile) -> String {
    let mut routines: BTreeMap<&str, (u64, u64)> = BTreeMap::new();
    for (at, node) in profile.nodes.iter().enumerate() {
        let mut stack = profile.stack(at);
        let name = stack.next().unwrap_or_default();
        // A difference calls the sum, and counts with it.
        let is_within = stack.next().is_some_and(|caller| caller.starts_with("__aeabi_f"));
        if name.starts_with("__aeabi_f") && !is_within {
            let (calls, instructions) = routines.entry(name).or_default();
            *calls += node.calls;
            *instructions += profile.inclusive(at);
        }
    }
    let mut text = String::new();
    if !routines.is_empty() {
        text += "\n| routine | calls | instructions of a call | together |\n|---|---:|---:|---:|\n";
    }
    for (name, (calls, instructions)) in routines {
        let mean = instructions.checked_div(calls).unwrap_or_default();
        let _ = writeln!(text, "| {name} | {calls} | {mean} | {instructions} |");
    }
    text
}
