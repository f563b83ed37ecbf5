//! Sonarfix and its peers at the same work, measured on this machine and written to
//! `docs/benchmarks.md`.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;
use std::time::Duration;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

use crate::cargo;
use crate::elf::Program;
use crate::emulator::{self, Cost};
use crate::program::{M0PLUS, M3, M4F, M4F_SMALL, Target};

mod host;
mod page;

/// One filter of the table.
pub struct Subject {
    /// Its program in `bench-mcu`; that of ours in `bench-ours`.
    pub name: &'static str,
    /// As the table calls it.
    pub label: &'static str,
    /// The crate whose version is named.
    pub package: &'static str,
    /// How it corrects P.
    pub form: &'static str,
}

/// Ours first.
const SUBJECTS: [Subject; 11] = [
    subject("ours", "**Sonarfix**", "sonarfix", "Joseph, two passes"),
    subject("naive", "naive nalgebra", "nalgebra", "plain"),
    subject("naive_joseph", "naive nalgebra", "nalgebra", "Joseph"),
    subject("adskalman_symmetric", "adskalman", "adskalman", "symmetrised"),
    subject("adskalman", "adskalman", "adskalman", "Joseph"),
    subject("kfilter", "kfilter", "kfilter", "symmetrised"),
    subject("minikalman", "minikalman, arrays", "minikalman", "plain"),
    subject("minikalman_boxed", "minikalman, boxes", "minikalman", "plain"),
    subject("numeris", "numeris", "numeris", "Joseph"),
    subject("multicalc_passed_in", "multicalc, no trigonometry", "multicalc", "Joseph"),
    subject("multicalc", "multicalc, its own trigonometry", "multicalc", "Joseph"),
];

const fn subject(
    name: &'static str,
    label: &'static str,
    package: &'static str,
    form: &'static str,
) -> Subject {
    Subject { name, label, package, form }
}

/// What a filter costs on a microcontroller.
pub struct OnTarget {
    pub predict: Cost,
    pub update: Cost,
    /// Bytes of all functions that predict and update reach.
    pub text: u64,
}

impl OnTarget {
    /// Instructions of ten predicts and one update.
    pub fn ten_and_one(&self) -> f64 {
        10.0 * self.predict.mean() + self.update.mean()
    }
}

/// What a filter costs.
pub struct Figures {
    pub version: String,
    pub m4f: OnTarget,
    pub m4f_small: OnTarget,
    pub m3: OnTarget,
    pub m0plus: OnTarget,
    /// Instructions of ten predicts and one update on this machine.
    pub x86: f64,
    /// Nanoseconds of the same.
    pub nanoseconds: f64,
}

pub fn run() -> anyhow::Result<()> {
    for target in [M4F, M4F_SMALL, M3, M0PLUS] {
        target.build("bench-mcu", "--features peers")?;
        target.build("bench-ours", "")?;
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
            version: versions.get(subject.package).cloned().unwrap_or_default(),
            m4f: on_target(&M4F, name)?,
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
    let path = cargo::root().join("docs/benchmarks.md");
    fs::write(&path, page::written(rows, &tools()?)?)?;
    eprintln!("written: docs/benchmarks.md");
    Ok(())
}

fn on_target(target: &Target, name: &str) -> anyhow::Result<OnTarget> {
    let report = emulator::run(target, name)?;
    let text = Program::read(&target.program(name))?.reach("bench_")?.bytes();
    Ok(OnTarget { predict: report.cost("predict")?, update: report.cost("update")?, text })
}

/// Versions by package, from the lock file; where a package is there twice, the newer one.
fn versions() -> anyhow::Result<BTreeMap<String, String>> {
    let text = fs::read_to_string(cargo::root().join("bench/Cargo.lock"))?;
    let lock: toml::Table = toml::from_str(&text)?;
    let packages = lock.get("package").and_then(toml::Value::as_array);
    let text_of = |package: &toml::Value, key: &str| Some(package.get(key)?.as_str()?.to_owned());
    let packages = packages.into_iter().flatten();
    Ok(packages.filter_map(|p| Some((text_of(p, "name")?, text_of(p, "version")?))).collect())
}

/// What it was measured with.
fn tools() -> anyhow::Result<Vec<String>> {
    let first_line = |program: &str| -> anyhow::Result<String> {
        let mut command = Command::new(program);
        command.arg("--version");
        let said = cargo::output(command)?;
        Ok(said.lines().next().unwrap_or_default().to_owned())
    };
    ["rustc", "qemu-system-arm", "valgrind"].into_iter().map(first_line).collect()
}
