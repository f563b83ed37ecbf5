//! `cargo xtask worst-poll`: the most expensive poll of the loop in many scenarios, and its limit.

use std::fmt::Write as _;
use std::thread;

use anyhow::{anyhow, ensure};

use crate::cargo;
use crate::pil;

/// The page with the table.
const PAGE: &str = "docs/worst-poll.md";

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Write docs/worst-poll.md.
    #[arg(long)]
    write: bool,
    /// Simulated seconds of each scenario.
    #[arg(long, default_value_t = SECONDS)]
    seconds: u32,
}

/// The default of `--seconds`.
const SECONDS: u32 = 20;

impl Args {
    /// What CI runs.
    pub const CHECK: Self = Self { write: false, seconds: SECONDS };
}

/// A core: its name, the value of `--machine`, and the limit of a poll, instructions.
const CORES: [(&str, &str, u64); 2] =
    [("Cortex-M4F", "m4f", 10_000), ("Cortex-M0+", "m0plus", 130_000)];

/// What runs, and the arguments of `sonarfix pil`; `C` is `classroom`, `T` the folder of the tests' scenarios.
const SCENARIOS: [(&str, &str); 26] = [
    ("one sonar, informative", "C"),
    ("nearest wall", "C --policy nearest"),
    ("the paper's robot", "paper --fidelity pins"),
    ("pings as fast as the sonar permits", "C --fix-period as-fast-as-possible"),
    ("range scale estimated", "C --range-error 0.01"),
    ("gyro, slipping wheels", "C --gyro mpu6050 --heading-slips 5"),
    ("compass", "C --absolute heading"),
    ("beacon", "C --absolute position"),
    ("camera", "C --absolute pose"),
    ("VL53L1X", "C --sensor vl53l1x"),
    ("VL53L0X", "C --sensor vl53l0x"),
    ("two servos", "T/classroom-two-servos.toml"),
    ("two fixed sonars", "T/classroom-ahead-left.toml"),
    ("two sonars in the paper's scenario", "T/paper-two-sonars.toml --fidelity pins"),
    (
        "all sensors",
        "T/classroom-two-servos.toml --gyro mpu6050 --absolute pose --range-error 0.01 --heading-slips 5",
    ),
    ("search", "C --start unknown"),
    ("search, pings as fast as possible", "C --start unknown --fix-period as-fast-as-possible"),
    ("search with light", "C --start unknown --sensor vl53l1x"),
    (
        "search, all sensors",
        "T/classroom-two-servos.toml --start unknown --gyro mpu6050 --absolute heading",
    ),
    ("lost and found", "C --start relocalize --heading-slips 5"),
    ("garbage on the link", "C --load garbage"),
    ("more garbage than a poll reads", "C --load saturated"),
    ("commands, a new pose while pinging", "C --load commands"),
    (
        "commands and all sensors",
        "T/classroom-two-servos.toml --load commands --gyro mpu6050 --absolute pose",
    ),
    ("commands during a search", "C --start unknown --load commands"),
    (
        "configuration of another robot, link unplugged",
        "C --robot tests/robots/coarse.toml --load unplugged",
    ),
];

/// The worst poll of each scenario on each core.
type Measured = Vec<Vec<u64>>;

/// Measures, and writes the page or compares with the limits.
pub fn run(args: Args) -> anyhow::Result<()> {
    cargo::run("build --quiet --release --bin sonarfix")?;
    let measured = thread::scope(|scope| {
        let cores = CORES.map(|(_, machine, _)| scope.spawn(move || on(machine, args.seconds)));
        let ended = cores.map(|core| core.join().map_err(|_| anyhow!("a measurement panicked"))?);
        ended.into_iter().collect::<anyhow::Result<Measured>>()
    })?;
    println!("{}", table(&measured));
    for ((core, _, limit), polls) in CORES.iter().zip(&measured) {
        let most = polls.iter().max().copied().unwrap_or_default();
        ensure!(most <= *limit, "a poll takes {most} instructions of {limit} on a {core}");
    }
    if args.write {
        std::fs::write(cargo::root().join(PAGE), page(&measured, args.seconds))?;
    }
    Ok(())
}

/// The worst poll of each scenario on a machine.
fn on(machine: &str, seconds: u32) -> anyhow::Result<Vec<u64>> {
    let worst = |(_, arguments): &(&str, &str)| {
        let arguments = arguments
            .replacen('C', "crates/sonarfix-map/scenarios/classroom.toml", 1)
            .replacen("T/", "tests/scenarios/", 1);
        pil::sonarfix(&format!("{arguments} --seconds {seconds} --machine {machine}"))
            .map(|tally| tally.worst_poll())
    };
    SCENARIOS.iter().map(worst).collect()
}

fn table(measured: &Measured) -> String {
    let mut text =
        "| scenario | Cortex-M4F | Cortex-M0+ | `sonarfix pil` |\n|---|---:|---:|---|\n".to_owned();
    // Writing to a string does not fail.
    for (n, (name, arguments)) in SCENARIOS.iter().enumerate() {
        let polls: Vec<String> =
            measured.iter().filter_map(|polls| Some(polls.get(n)?.to_string())).collect();
        let _ = writeln!(text, "| {name} | {} | `{arguments}` |", polls.join(" | "));
    }
    let worst: Vec<String> = measured
        .iter()
        .map(|polls| format!("**{}**", polls.iter().max().copied().unwrap_or_default()))
        .collect();
    let limits = CORES.map(|(_, _, limit)| limit.to_string());
    let _ = writeln!(text, "| **worst** | {} | |", worst.join(" | "));
    let _ = writeln!(text, "| limit in CI | {} | |", limits.join(" | "));
    text
}

fn page(measured: &Measured, seconds: u32) -> String {
    format!(
        "# The worst poll\n\
         Generated by `cargo xtask worst-poll --write`; change the code, not this page.\n\n\
         A poll is one call of the robot's loop with the application around it: encoders, servo, rangers, gyro, localizer, search,\n\
         telemetry and commands. The table lists the instructions of the most expensive poll in {seconds} s of each scenario on an\n\
         emulated microcontroller. The poll that starts the loop is not in it: [pil.md](pil.md) has its cost. `C` is\n\
         `crates/sonarfix-map/scenarios/classroom.toml`, `T` is `tests/scenarios`.\n\n{}",
        table(measured)
    )
}
