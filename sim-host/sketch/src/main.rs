//! Drives a simulated robot by a program for Arduino: its `setup` and `loop` run on this PC, on the pins of the simulation.
//!
//! `c/arduino/host` has what such a program is compiled with: pins, interrupts, servo and serial port, which it exchanges with this
//! command over its standard input and output.

use std::path::PathBuf;

use anyhow::Result;
use clap::Parser;
use sonarfix_map::Scenario;
use sonarfix_plan::overrides::Overrides;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::RunResult;

mod estimate;
mod program;
mod wire;

use program::Program;

#[derive(Debug, Parser)]
#[command(
    about = "Drives a simulated robot by a program for Arduino, and by the loop of the firmware"
)]
struct Arguments {
    /// The program, compiled for this PC.
    program: PathBuf,
    /// The scenario, of the fidelity "pins".
    scenario: PathBuf,
    /// The seed of the first run.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The number of runs.
    #[arg(long, default_value_t = 1)]
    runs: u64,
    /// Seconds of a run, if it shall be shorter than the scenario.
    #[arg(long)]
    seconds: Option<f64>,
    #[command(flatten)]
    overrides: Overrides,
}

/// The root mean square of the position errors of some runs, metres, and how many of them were lost.
#[derive(Debug, Default)]
struct Errors {
    mean_squares: f64,
    lost: u64,
    runs: u32,
}

impl Errors {
    fn add(&mut self, result: &RunResult) {
        self.mean_squares += result.path.position_mean_square();
        self.lost += u64::from(result.lost);
        self.runs += 1;
    }

    fn rms(&self) -> f64 {
        (self.mean_squares / f64::from(self.runs)).sqrt()
    }
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let mut scenario = Scenario::read(&arguments.scenario)?;
    arguments.overrides.apply(&mut scenario)?;
    let mut simulation = Simulation::new(scenario);
    if let Some(seconds) = arguments.seconds {
        simulation = simulation.shortened(seconds);
    }
    let (mut program, mut firmware) = (Errors::default(), Errors::default());
    for seed in arguments.seed..arguments.seed + arguments.runs {
        let mut computer = Program::new(&simulation, &arguments.program);
        program.add(&simulation.run_on(&mut computer, seed, &mut ())?);
        firmware.add(&simulation.run(seed, &mut ())?);
    }
    let summary = serde_json::json!({
        "runs": arguments.runs,
        "program_rms": program.rms(),
        "program_lost": program.lost,
        "firmware_rms": firmware.rms(),
        "firmware_lost": firmware.lost,
    });
    println!("{summary}");
    Ok(())
}
