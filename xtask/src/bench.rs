//! Measures Sonarfix and its peers on the same task, on this machine, and prints the tables of `docs/benchmarks.md`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::process::Command;
use std::time::Duration;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

use crate::cargo;
use crate::elf::Program;
use crate::emulator;
use crate::program::{M0PLUS, M3, M4F, M4F_FUSED, M4F_SMALL, Target};
use crate::workspace::Workspace;

pub mod cmsis;
mod host;
mod subjects;
mod table;

use subjects::{CMSIS, Figures, OnTarget, SUBJECTS};

pub fn run() -> anyhow::Result<()> {
    cmsis::fetch()?;
    for target in [M4F, M4F_FUSED, M4F_SMALL, M3, M0PLUS] {
        target.build(Workspace::Bench, "bench-mcu --features peers,crazyflie")?;
        target.build(Workspace::Bench, "bench-ours")?;
    }
    host::build()?;
    let times = host::times(SUBJECTS.iter().map(|subject| subject.name))?;
    let versions = versions()?;

    let bar = ProgressBar::new(SUBJECTS.len() as u64).with_style(ProgressStyle::with_template(
        "counting {msg:32} {bar:24} {pos}/{len}, {eta} to go",
    )?);
    bar.enable_steady_tick(Duration::from_millis(200));
    let mut rows = Vec::new();
    for subject in SUBJECTS {
        bar.set_message(subject.label);
        let name = subject.name;
        let figures = Figures {
            version: if subject.package == CMSIS {
                cmsis::version()?
            } else {
                versions.get(subject.package).cloned().unwrap_or_default()
            },
            m4f: on_target(&M4F, name)?,
            m4f_fused: on_target(&M4F_FUSED, name)?,
            m4f_small: on_target(&M4F_SMALL, name)?,
            m3: on_target(&M3, name)?,
            m0plus: on_target(&M0PLUS, name)?,
            x86: 10.0 * host::instructions(name, "predict")? + host::instructions(name, "update")?,
            nanoseconds: times.get(name).copied().context("criterion has not measured it")?,
        };
        rows.push((subject, figures));
        bar.inc(1);
    }
    bar.finish_and_clear();
    println!("{}\n{}", table::of(rows)?, tools()?);
    Ok(())
}

/// The entry points of a filter, and the function that kfilter calls through a pointer.
const ROOTS: [&str; 3] =
    ["bench_predict", "bench_update", "bench_workload::filters::kfilter::step"];

fn on_target(target: &Target, name: &str) -> anyhow::Result<OnTarget> {
    let report = emulator::run(target, Workspace::Bench, name)?;
    let text = Program::read(&target.program(Workspace::Bench, name))?.reach(&ROOTS)?.bytes();
    Ok(OnTarget { predict: report.cost("predict")?, update: report.cost("update")?, text })
}

/// Versions by package, from the lock file; of several versions the newest.
fn versions() -> anyhow::Result<BTreeMap<String, String>> {
    let text = fs::read_to_string(cargo::root().join("bench/Cargo.lock"))?;
    let lock: toml::Table = toml::from_str(&text)?;
    let packages = lock.get("package").and_then(toml::Value::as_array);
    let text_of = |package: &toml::Value, key: &str| Some(package.get(key)?.as_str()?.to_owned());
    let packages = packages.into_iter().flatten();
    Ok(packages.filter_map(|p| Some((text_of(p, "name")?, text_of(p, "version")?))).collect())
}

/// The versions of the tools, as a table.
fn tools() -> anyhow::Result<String> {
    let mut table = "| measured with |\n|---|\n".to_owned();
    for program in ["rustc", "arm-none-eabi-gcc", "qemu-system-arm", "valgrind"] {
        let mut command = Command::new(program);
        command.arg("--version");
        let version = cargo::output(command)?;
        writeln!(table, "| {} |", version.lines().next().unwrap_or_default())?;
    }
    Ok(table)
}
