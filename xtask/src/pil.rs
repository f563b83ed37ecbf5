//! Processor in the loop: the shipped loop on emulated microcontrollers, whole scenarios long and
//! compared with the PC bit by bit, and what it costs them.

use std::fmt::Write as _;

use anyhow::{Context, ensure};
use serde::Deserialize;

use crate::cargo;

/// A microcontroller of `sonarfix pil`.
struct Core {
    /// As `--machine` calls it.
    machine: &'static str,
    name: &'static str,
    /// A clock that such a core has, MHz.
    clock: u64,
    /// What a poll may take of an encoder tick's period at that clock, percent.
    bar: Option<u64>,
}

const CORES: [Core; 4] = [
    Core { machine: "m4f", name: "Cortex-M4F", clock: 16, bar: Some(5) },
    Core { machine: "m33", name: "Cortex-M33", clock: 150, bar: None },
    Core { machine: "m3", name: "Cortex-M3", clock: 72, bar: None },
    Core { machine: "m0plus", name: "Cortex-M0+", clock: 48, bar: Some(10) },
];

/// Microseconds of an encoder tick's period.
const TICK: u64 = 100_000;

const CLASSROOM: &str = "crates/sonarfix-map/scenarios/classroom.toml --seconds 60";

/// What was counted of calls of one kind.
#[derive(Debug, Clone, Copy, Deserialize)]
struct Cost {
    calls: u64,
    all: u64,
    most: u64,
}

impl Cost {
    fn shown(&self) -> String {
        let mean = self.all.checked_div(self.calls).unwrap_or(0);
        format!("{mean} / {}", self.most)
    }
}

/// What `sonarfix pil --json` prints.
#[derive(Debug, Deserialize)]
struct Tally {
    predict: Cost,
    aim: Cost,
    fix: Cost,
    poll: Cost,
    idle: Cost,
    per_tick: Cost,
    stack: u32,
}

/// Runs the scenarios on every core, a short one over the UART, and the loop for the whole of the
/// paper's on one; prints the table of costs.
pub fn check() -> anyhow::Result<()> {
    sonarfix("paper --carrier uart --seconds 60")?;
    // The shipped loop for as long as the paper's run: a million turns.
    sonarfix("paper --fidelity pins")?;
    let mut table = "| instructions, mean / worst".to_owned();
    let mut rows =
        ["predict", "aim", "fix", "poll with work", "poll without", "all polls of 100 ms"]
            .map(|name| format!("| {name}"));
    let mut shares = "| share of 100 ms, worst poll".to_owned();
    let mut stacks = "| stack of the deepest poll, bytes".to_owned();
    let mut missed = Vec::new();
    for core in &CORES {
        let paper = sonarfix(&format!("paper --machine {}", core.machine))?;
        let classroom = sonarfix(&format!("{CLASSROOM} --machine {}", core.machine))?;
        let costs = [
            paper.predict,
            paper.aim,
            paper.fix,
            classroom.poll,
            classroom.idle,
            classroom.per_tick,
        ];
        // Writing to a string does not fail.
        let _ = write!(table, " | {}", core.name);
        for (row, cost) in rows.iter_mut().zip(costs) {
            let _ = write!(row, " | {}", cost.shown());
        }
        let _ = write!(stacks, " | {}", classroom.stack);
        let tick = core.clock * TICK;
        let permille = (1_000 * classroom.poll.most + tick / 2) / tick;
        let _ = write!(shares, " | {}.{} % at {} MHz", permille / 10, permille % 10, core.clock);
        if core.bar.is_some_and(|bar| permille > 10 * bar) {
            missed.push(core.name);
        }
    }
    println!("{table} |\n|---|---:|---:|---:|---:|");
    for row in rows.iter().chain([&shares, &stacks]) {
        println!("{row} |");
    }
    ensure!(missed.is_empty(), "a poll takes too much of a tick on {}", missed.join(", "));
    Ok(())
}

fn sonarfix(arguments: &str) -> anyhow::Result<Tally> {
    eprintln!("── sonarfix pil {arguments}");
    let run = "run --quiet --release --package sonarfix-sim --bin sonarfix -- pil --json";
    let json = cargo::printed(cargo::command(&format!("{run} {arguments}")))?;
    serde_json::from_str(&json)
        .with_context(|| format!("`sonarfix pil {arguments}` printed {json}"))
}
