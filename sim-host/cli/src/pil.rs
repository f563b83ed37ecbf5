//! `sonarfix pil`: the robot's software on an emulated microcontroller.

use std::path::PathBuf;

use anyhow::Context;
use sonarfix_map::Scenario;
use sonarfix_pil_host::golden;
use sonarfix_pil_host::machine::{Carrier, Machine};
use sonarfix_pil_host::pair::Pair;
use sonarfix_pil_host::progress::Progress;
use sonarfix_pil_host::tally::Tally;
use sonarfix_pil_host::{Emulated, Load};
use sonarfix_plan::overrides::Overrides;
use sonarfix_sim::simulate::Simulation;

use sonarfix_terminal::output::check_file;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A scenario file, `paper`, or a golden trace (`.golden`) to replay.
    scenario: PathBuf,
    /// A robot file or a baked configuration, in place of the scenario's robot. Several run one after
    /// another on the same program.
    #[arg(long = "robot", value_name = "ROBOT")]
    robots: Vec<PathBuf>,
    /// The microcontroller.
    #[arg(long, value_enum, default_value_t = Machine::M4f)]
    machine: Machine,
    /// The channel of the messages.
    #[arg(long, value_enum, default_value_t = Carrier::Semihosting)]
    carrier: Carrier,
    /// The program to run there; built first if not given.
    #[arg(long, value_name = "ELF")]
    firmware: Option<PathBuf>,
    /// Ends the run after a number of simulated seconds.
    #[arg(long)]
    seconds: Option<f64>,
    /// Seed of the run; by default that of the scenario.
    #[arg(long)]
    seed: Option<u64>,
    /// What arrives over the robot's link, at the fidelity `pins`: bytes at the rate of 115,200 baud.
    #[arg(long, value_enum, default_value_t = Traffic::Quiet)]
    load: Traffic,
    /// Writes a golden trace here.
    #[arg(long, value_name = "FILE.golden")]
    record: Option<PathBuf>,
    /// Prints the instruction counts as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overrides: Overrides,
}

/// A load on the link.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Traffic {
    /// Nothing arrives.
    Quiet,
    /// Random bytes.
    Garbage,
    /// Valid commands.
    Commands,
    /// Random bytes, more than a poll reads.
    Saturated,
    /// Nothing arrives, and telemetry is lost.
    Unplugged,
}

impl From<Traffic> for Load {
    fn from(traffic: Traffic) -> Self {
        match traffic {
            Traffic::Quiet => Self::Quiet,
            Traffic::Garbage => Self::Garbage,
            Traffic::Commands => Self::Commands,
            Traffic::Saturated => Self::Saturated,
            Traffic::Unplugged => Self::Unplugged,
        }
    }
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if let Some(file) = &args.record {
        check_file("--record", file)?;
    }
    if args.scenario.extension().is_some_and(|extension| extension == "golden") {
        return replay(args);
    }
    let mut scenario = if args.scenario.as_os_str() == "paper" {
        Scenario::paper()?
    } else {
        Scenario::read(&args.scenario)?
    };
    args.overrides.apply(&mut scenario)?;
    let seed = args.seed.unwrap_or(scenario.run.seed);
    let name = scenario.name.clone();
    let seconds = prepared(args, &scenario).seconds();
    let mut pair = start(args, seconds)?;
    pair.recorded = args.record.as_ref().map(|_| Vec::new());
    if args.robots.is_empty() {
        run(args, &name, seed, &scenario, &mut pair)?;
    }
    for path in &args.robots {
        scenario.robot = crate::config::read_robot(path)?;
        let name = format!("{name} with {}", path.display());
        run(args, &name, seed, &scenario, &mut pair)?;
    }
    if let (Some(path), Some(recorded)) = (&args.record, &pair.recorded) {
        let words = format!("{name}, seed {seed}, {seconds:.0} s; renewed by `cargo xtask bless`");
        golden::write(path, &words, recorded)?;
    }
    if args.json {
        return sonarfix_terminal::json::print(&pair.tally);
    }
    print(&pair.tally);
    Ok(())
}

fn prepared(args: &Args, scenario: &Scenario) -> Simulation {
    let simulation = Simulation::new(scenario.clone());
    match args.seconds {
        Some(seconds) => simulation.shortened(seconds),
        None => simulation,
    }
}

/// Runs one robot on both, and prints its result.
fn run(
    args: &Args,
    name: &str,
    seed: u64,
    scenario: &Scenario,
    pair: &mut Pair,
) -> anyhow::Result<()> {
    let simulation = prepared(args, scenario);
    let seconds = simulation.seconds();
    let before = pair.requests();
    let mut computer = Emulated::new(&simulation, pair)?.under(args.load.into());
    let result = simulation.run_on(&mut computer, seed, &mut ())?;
    pair.end()?;
    if args.json {
        return Ok(());
    }
    let (requests, verdict) = (pair.requests() - before, verdict(args.machine));
    println!("{name}, seed {seed}, {seconds:.0} s: {requests} requests, {verdict}");
    let fixes = &result.fixes;
    println!(
        "{} ranges accepted, {} gated, {} refused",
        fixes.accepted, fixes.gated, fixes.refused
    );
    let (faults, integrity) = (&result.faults, &result.integrity);
    println!(
        "{} deadlines missed; outside of the ellipse and Tracking for at most {:.1} s, blind and Tracking for at most {:.1} s",
        faults.deadlines,
        integrity.longest_undetected(),
        integrity.longest_blind()
    );
    Ok(())
}

fn replay(args: &Args) -> anyhow::Result<()> {
    let exchanges = golden::read(&args.scenario)?;
    let mut pair = start(args, 0.0)?;
    golden::replay(&exchanges, &mut pair)
        .with_context(|| format!("{} is not reproduced", args.scenario.display()))?;
    println!("{}: {} requests, all answers as recorded", args.scenario.display(), pair.requests());
    print(&pair.tally);
    Ok(())
}

/// The conclusion of a complete run.
fn verdict(machine: Machine) -> &'static str {
    match machine {
        Machine::Host => "answered by this PC alone",
        _ => "all answers of microcontroller and PC are equal to the bit",
    }
}

fn start(args: &Args, seconds: f64) -> anyhow::Result<Pair> {
    let emulator = args.machine.start(args.carrier, args.firmware.as_deref())?;
    Ok(Pair::new(emulator, Progress::of(seconds)))
}

fn print(tally: &Tally) {
    let mut rows = tally.rows().peekable();
    if rows.peek().is_none() {
        return;
    }
    println!("\n| instructions of | calls | mean | worst |\n|---|---:|---:|---:|");
    for (name, cost) in rows {
        println!("| {name} | {} | {} | {} |", cost.calls, cost.mean().unwrap_or(0), cost.most);
    }
    println!("\nstack of the deepest call: {} bytes", tally.stack);
}
