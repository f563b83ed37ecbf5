//! `sonarfix run`: any scenario, any number of times.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::Context;
use sonarfix_map::Scenario;

use super::overrides::Overrides;
use super::table::{self, Beside};
use crate::report::Report;
use crate::simulate::Simulation;
use crate::statistics::Summary;
use crate::trace::Trace;
use crate::{monte_carlo, trace_csv};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The scenario file (docs/formats.md).
    scenario: PathBuf,
    /// How many runs; the scenario's own number if not given.
    #[arg(long)]
    runs: Option<u32>,
    /// Seed of the first run; the others count up from it.
    #[arg(long)]
    seed: Option<u64>,
    /// Writes the first run's trace here, as CSV (docs/formats.md).
    #[arg(long, value_name = "FILE.csv")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    output: Output,
}

/// Where the answer goes.
#[derive(Debug, clap::Args)]
pub struct Output {
    /// Prints JSON instead of a table.
    #[arg(long)]
    pub json: bool,
    /// Writes report.html and its figures into this folder.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let mut scenario = Scenario::read(&args.scenario)?;
    args.overrides.apply(&mut scenario)?;
    let experiment = Experiment {
        runs: args.runs.unwrap_or(scenario.run.runs),
        seed: args.seed.unwrap_or(scenario.run.seed),
        simulation: Simulation::new(scenario),
        beside_paper: false,
    };
    if let Some(file) = &args.trace {
        write_trace(&experiment.trace()?, file)?;
    }
    experiment.conduct(&args.output)
}

fn write_trace(trace: &Trace, file: &Path) -> anyhow::Result<()> {
    let create = || -> anyhow::Result<()> {
        let out = BufWriter::new(File::create(file)?);
        Ok(trace_csv::write(trace, out)?)
    };
    create().with_context(|| format!("cannot write the trace {}", file.display()))
}

/// A scenario, and how often to run it.
#[derive(Debug)]
pub struct Experiment {
    pub simulation: Simulation,
    pub runs: u32,
    pub seed: u64,
    /// Whether the paper's figures belong beside ours.
    pub beside_paper: bool,
}

impl Experiment {
    /// Runs, and puts the answer where it was asked for.
    pub fn conduct(&self, output: &Output) -> anyhow::Result<()> {
        anyhow::ensure!(self.runs > 0, "--runs must be at least 1");
        let summary = monte_carlo::run(&self.simulation, self.seed, self.runs)?;
        if output.json {
            super::print_json(&summary)?;
        } else {
            println!("{}", table::text(&self.table(&summary)));
        }
        if let Some(dir) = &output.out {
            let page = self.report(&summary, &self.trace()?, dir)?;
            eprintln!("open {}", page.display());
        }
        Ok(())
    }

    /// The trace of the first run.
    fn trace(&self) -> anyhow::Result<Trace> {
        let mut trace = self.simulation.empty_trace();
        self.simulation.run(self.seed, &mut trace)?;
        Ok(trace)
    }

    fn table(&self, summary: &Summary) -> crate::report::Table {
        let t = &self.simulation.scenario.truth;
        let truth = [
            0.0,
            0.0,
            0.0,
            t.scale_right,
            t.scale_left,
            t.track_width,
            self.simulation.range_scale(),
        ];
        table::states(summary, &Beside { truth, paper: self.beside_paper })
    }

    fn report(&self, summary: &Summary, trace: &Trace, dir: &Path) -> anyhow::Result<PathBuf> {
        let scenario = &self.simulation.scenario;
        let report = Report {
            title: format!("Sonarfix: {}", scenario.name),
            subtitle: format!(
                "{}. The table is over {} runs; figures and player show the one with seed {}.",
                scenario.description.trim().trim_end_matches('.'),
                self.runs,
                self.seed
            ),
            tables: vec![self.table(summary)],
            trace,
        };
        Ok(report.write(dir)?)
    }
}
