//! Processor in the loop: runs the shipped loop on emulated microcontrollers for whole scenarios, compares it with the
//! PC bit by bit, and measures its cost.

use anyhow::{Context, ensure};
use serde::Deserialize;

use crate::cargo;

/// A microcontroller of `sonarfix pil`.
struct Core {
    /// The value of `--machine`.
    machine: &'static str,
    name: &'static str,
    /// A typical clock of such a core, MHz.
    clock: u64,
    /// Largest share of the encoder period for a poll at that clock, percent.
    bar: Option<u64>,
}

const CORES: [Core; 5] = [
    Core { machine: "m4f", name: "Cortex-M4F", clock: 16, bar: Some(5) },
    Core { machine: "m33", name: "Cortex-M33", clock: 150, bar: None },
    Core { machine: "m3", name: "Cortex-M3", clock: 72, bar: None },
    Core { machine: "m0plus", name: "Cortex-M0+", clock: 48, bar: Some(10) },
    Core { machine: "rv32", name: "RV32IMAC", clock: 160, bar: None },
];

/// The name of the core of this machine.
pub fn name_of(machine: &str) -> Option<&'static str> {
    CORES.iter().find(|core| core.machine == machine).map(|core| core.name)
}

/// Encoder period, microseconds.
const TICK: u64 = 100_000;

const CLASSROOM: &str = "crates/sonarfix-map/scenarios/classroom.toml --seconds 60";

/// The instructions of all calls of one kind.
#[derive(Debug, Clone, Copy, Deserialize)]
struct Cost {
    calls: u64,
    all: u64,
    most: u64,
}

impl Cost {
    #[expect(clippy::cast_precision_loss, reason = "a small number")]
    fn mean(&self) -> f64 {
        self.all as f64 / self.calls as f64
    }

    fn shown(&self) -> String {
        let mean = self.all.checked_div(self.calls).unwrap_or(0);
        format!("{mean} / {}", self.most)
    }
}

/// The output of `sonarfix pil --json`.
#[derive(Debug, Deserialize)]
pub struct Tally {
    predict: Cost,
    aim: Cost,
    fix: Cost,
    start: Cost,
    poll: Cost,
    idle: Cost,
    per_tick: Cost,
    stack: u32,
}

impl Tally {
    /// The most instructions of a poll, with work or without, that does not start the loop.
    pub fn worst_poll(&self) -> u64 {
        self.poll.most.max(self.idle.most)
    }
}

/// Faults of every device in turn, then of all of them, within a minute of `classroom`.
const DEAD_DEVICES: &str = r#"
faults = [
    { kind = "read_errors", wheel = "right", share = 1.0, from = "5 s", to = "8 s" },
    { kind = "read_errors", wheel = "left", share = 1.0, from = "13 s", to = "16 s" },
    { kind = "stuck_servo", from = "21 s", to = "24 s" },
    { kind = "dead_sonar", from = "29 s", to = "32 s" },
    { kind = "read_errors", wheel = "right", share = 1.0, from = "37 s", to = "41 s" },
    { kind = "read_errors", wheel = "left", share = 1.0, from = "37 s", to = "41 s" },
    { kind = "stuck_servo", from = "37 s", to = "41 s" },
    { kind = "dead_sonar", from = "37 s", to = "41 s" },
]
"#;

/// Runs the loop with fixes and telemetry under load: garbage and commands at the rate of the line, an unplugged link, dead
/// devices.
fn under_load() -> anyhow::Result<()> {
    for load in ["garbage", "commands", "unplugged"] {
        loaded(&format!("{CLASSROOM} --load {load}"))?;
    }
    let classroom = std::fs::read_to_string("crates/sonarfix-map/scenarios/classroom.toml")?;
    let dead = "target/dead-devices.toml";
    std::fs::write(
        dead,
        classroom.replacen("format = 1\n", &format!("format = 1\n{DEAD_DEVICES}"), 1),
    )?;
    for load in ["quiet", "garbage"] {
        loaded(&format!("{dead} --seconds 60 --load {load}"))?;
    }
    Ok(())
}

/// Runs and prints a minute of the loop, in which no deadline may be missed.
fn loaded(arguments: &str) -> anyhow::Result<()> {
    let run = "run --quiet --release --bin sonarfix -- pil";
    let text = cargo::printed(cargo::command(&format!("{run} {arguments}")))?;
    // The table of docs/pil.md is the standard output.
    eprintln!("── sonarfix pil {arguments}\n{text}");
    ensure!(text.contains("\n0 deadlines missed"), "a deadline was missed under load");
    Ok(())
}

/// Runs the scenarios on every core, a short one over the UART, and the loop for the whole reference scenario on one
/// core; prints the table of costs.
pub fn check() -> anyhow::Result<()> {
    sonarfix("paper --carrier uart --seconds 60")?;
    // For the files that are written below: with CARGO_TARGET_DIR, cargo makes no folder `target` here.
    std::fs::create_dir_all("target")?;
    // Two robots of one program: wheels, servo, encoder period and ping schedule differ.
    bake("firmware/robot.toml", "target/reference.bin")?;
    bake("tests/robots/coarse.toml", "target/coarse.bin")?;
    let robots = "--robot target/reference.bin --robot target/coarse.bin";
    sonarfix(&format!("{CLASSROOM} {robots}"))?;
    under_load()?;
    // The shipped loop for the whole reference scenario: a million polls.
    sonarfix("paper --fidelity pins")?;
    println!(
        "| core, mean / worst | predict | aim | fix | longest poll of the start | poll with work | poll without | all polls of 100 ms | \
         worst poll, share of 100 ms | all polls, share | stack of the deepest poll, bytes |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    );
    let mut missed = Vec::new();
    for core in &CORES {
        let paper = sonarfix(&format!("paper --machine {}", core.machine))?;
        let classroom = sonarfix(&format!("{CLASSROOM} --machine {}", core.machine))?;
        let costs = [paper.predict, paper.aim, paper.fix, classroom.start, classroom.poll];
        let costs = [&costs[..], &[classroom.idle, classroom.per_tick]].concat();
        let costs: Vec<String> = costs.iter().map(Cost::shown).collect();
        let tick = core.clock * TICK;
        let permille = (1_000 * classroom.poll.most + tick / 2) / tick;
        let all = 1e2 * classroom.per_tick.mean() / tick_instructions(core);
        let worst = format!("{}.{} % at {} MHz", permille / 10, permille % 10, core.clock);
        let (costs, stack) = (costs.join(" | "), classroom.stack);
        println!("| {} | {costs} | {worst} | {all:.2} % | {stack} |", core.name);
        if core.bar.is_some_and(|bar| permille > 10 * bar) {
            missed.push(core.name);
        }
    }
    ensure!(
        missed.is_empty(),
        "a poll takes too much of the encoder period on {}",
        missed.join(", ")
    );
    Ok(())
}

/// Instructions of a core in an encoder period, at one a cycle.
#[expect(clippy::cast_precision_loss, reason = "a small number")]
fn tick_instructions(core: &Core) -> f64 {
    (core.clock * TICK) as f64
}

/// Bakes a robot file.
fn bake(robot: &str, image: &str) -> anyhow::Result<()> {
    let run = "run --quiet --release --bin sonarfix -- config bake";
    cargo::run(&format!("{run} {robot} --out {image}"))
}

/// Runs the command `sonarfix pil`; returns the instructions.
pub fn sonarfix(arguments: &str) -> anyhow::Result<Tally> {
    eprintln!("── sonarfix pil {arguments}");
    let run = "run --quiet --release --bin sonarfix -- pil --json";
    let json = cargo::printed(cargo::command(&format!("{run} {arguments}")))?;
    serde_json::from_str(&json)
        .with_context(|| format!("`sonarfix pil {arguments}` printed {json}"))
}
