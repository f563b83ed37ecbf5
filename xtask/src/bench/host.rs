//! The filters on this machine: instructions by callgrind, time by criterion.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use anyhow::Context;

use crate::cargo;
use crate::workspace::Workspace;

/// Vectorisation is off, because no microcontroller here has vector instructions.
const SCALAR: &str = "-C no-vectorize-loops -C no-vectorize-slp";

/// Builds the program that callgrind runs.
pub fn build() -> anyhow::Result<()> {
    let mut command = Workspace::Bench
        .cargo("build --release --package bench-host --features crazyflie --bin callgrind");
    command.env("RUSTFLAGS", SCALAR);
    cargo::check(command)
}

/// Instructions of a call, on average over the drive.
pub fn instructions(name: &str, call: &str) -> anyhow::Result<f64> {
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    command.arg(format!("--toggle-collect=*bench_{call}*"));
    command.arg(Workspace::Bench.target_folder().join("release/callgrind")).arg(name);
    let text = cargo::output(command).context("is `valgrind` installed?")?;
    let number = |key: &str| -> anyhow::Result<f64> {
        let (_, rest) = text.split_once(key).with_context(|| format!("no `{key}` in: {text}"))?;
        Ok(rest.lines().next().unwrap_or_default().trim().parse()?)
    };
    Ok(number("Collected : ")? / number(&format!("{call} "))?)
}

/// Nanoseconds of ten predicts and one update, by filter: criterion's median.
pub fn times<'a>(names: impl Iterator<Item = &'a str>) -> anyhow::Result<BTreeMap<&'a str, f64>> {
    let bench = "bench --package bench-host --features crazyflie --bench filters -- --noplot --warm-up-time 1 --measurement-time 2";
    cargo::check(Workspace::Bench.cargo(bench))?;
    names.map(|name| Ok((name, median(name)?))).collect()
}

fn median(name: &str) -> anyhow::Result<f64> {
    let path =
        Workspace::Bench.target_folder().join("criterion").join(name).join("new/estimates.json");
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let estimates: serde_json::Value = serde_json::from_str(&text)?;
    let median = estimates.pointer("/median/point_estimate").and_then(serde_json::Value::as_f64);
    median.context("criterion wrote no median")
}
