//! Drives a simulated robot by a program for Arduino: its `setup` and `loop` run on this PC, on the pins of the simulation.
//!
//! `c/arduino/host` has what such a program is compiled with: pins, interrupts, servo and serial port, which it exchanges with this
//! command over its standard input and output.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Parser;
use sonarfix_plan::edit::{self, Edit};
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
    /// Sets a key of the scenario or of its robot; repeatable.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_and_value)]
    set: Vec<(String, Edit)>,
    #[command(flatten)]
    overrides: Overrides,
}

/// A key, and its value as in a file or as a text.
fn key_and_value(text: &str) -> Result<(String, Edit)> {
    let (key, value) = text.split_once('=').context("no `=`")?;
    let table: Result<toml::Table, _> = format!("value = {value}").parse();
    let given = table.ok().and_then(|mut table| table.remove("value"));
    Ok((key.to_owned(), given.map_or_else(|| Edit::Text(value.to_owned()), Edit::Value)))
}

/// Position errors of some runs.
#[derive(Debug, Default)]
struct Errors {
    /// Sums over the runs of the mean square along the path, and of the square at the end of those that are not lost.
    along: f64,
    at_end: f64,
    runs: u32,
    lost: u32,
}

impl Errors {
    fn add(&mut self, result: &RunResult) {
        self.along += result.path.position_mean_square();
        self.runs += 1;
        if result.lost {
            self.lost += 1;
        } else {
            let [x, y, ..]: [f64; 7] = result.error.into();
            self.at_end += x * x + y * y;
        }
    }

    fn summary(&self) -> serde_json::Value {
        let rms = |sum: f64, runs: u32| (sum / f64::from(runs)).sqrt();
        serde_json::json!({
            "lost": self.lost,
            "rms_along": rms(self.along, self.runs),
            "rms_at_end": rms(self.at_end, self.runs - self.lost),
        })
    }
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let file = &arguments.scenario;
    let text = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
    let mut scenario = edit::scenario(file, &text, &arguments.set, "--set ")?;
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
        "runs": arguments.runs, "program": program.summary(), "firmware": firmware.summary(),
    });
    println!("{summary}");
    Ok(())
}
