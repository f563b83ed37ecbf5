//! `sonarfix pil`: the robot's software on an emulated microcontroller.

use std::path::PathBuf;

use anyhow::Context;
use sonarfix_map::Scenario;

use super::overrides::Overrides;
use crate::pil::Emulated;
use crate::pil::golden;
use crate::pil::machine::{Carrier, Machine};
use crate::pil::pair::Pair;
use crate::pil::progress::Progress;
use crate::pil::tally::Tally;
use crate::simulate::Simulation;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A scenario file, `paper`, or a golden trace (`.golden`) to ask again.
    scenario: PathBuf,
    /// Which microcontroller.
    #[arg(long, value_enum, default_value_t = Machine::M4f)]
    machine: Machine,
    /// What carries the messages.
    #[arg(long, value_enum, default_value_t = Carrier::Semihosting)]
    carrier: Carrier,
    /// The program to run there; built first if not given.
    #[arg(long, value_name = "ELF")]
    firmware: Option<PathBuf>,
    /// Ends the run after so many simulated seconds.
    #[arg(long)]
    seconds: Option<f64>,
    /// Seed of the run; the scenario's own if not given.
    #[arg(long)]
    seed: Option<u64>,
    /// Writes a golden trace here.
    #[arg(long, value_name = "FILE.golden")]
    record: Option<PathBuf>,
    /// Prints what was counted as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overrides: Overrides,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
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
    let mut simulation = Simulation::new(scenario);
    if let Some(seconds) = args.seconds {
        simulation = simulation.shortened(seconds);
    }
    let seconds = simulation.seconds();
    let mut pair = start(args, seconds)?;
    pair.recorded = args.record.as_ref().map(|_| Vec::new());
    let mut computer = Emulated::new(&simulation, &mut pair)?;
    let result = simulation.run_on(&mut computer, seed, &mut ())?;
    pair.end()?;
    if let (Some(path), Some(recorded)) = (&args.record, &pair.recorded) {
        let words = format!("{name}, seed {seed}, {seconds:.0} s; renewed by `cargo xtask bless`");
        golden::write(path, &words, recorded)?;
    }
    let (asked, verdict) = (pair.questions(), verdict(args.machine));
    if args.json {
        return super::print_json(&pair.tally);
    }
    println!("{name}, seed {seed}, {seconds:.0} s: {asked} questions, {verdict}");
    let fixes = &result.fixes;
    println!("{} ranges taken, {} gated, {} refused", fixes.accepted, fixes.gated, fixes.refused);
    print(&pair.tally);
    Ok(())
}

fn replay(args: &Args) -> anyhow::Result<()> {
    let exchanges = golden::read(&args.scenario)?;
    let mut pair = start(args, 0.0)?;
    golden::replay(&exchanges, &mut pair)
        .with_context(|| format!("{} is not reproduced", args.scenario.display()))?;
    println!(
        "{}: {} questions, every answer as recorded",
        args.scenario.display(),
        pair.questions()
    );
    print(&pair.tally);
    Ok(())
}

/// What a run to its end shows.
fn verdict(machine: Machine) -> &'static str {
    match machine {
        Machine::Host => "answered by this PC alone",
        _ => "every answer of the microcontroller the PC's to the bit",
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
