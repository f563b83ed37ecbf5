//! `sonarfix run`: runs a scenario a number of times.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::Context;
use cpu_time::ProcessTime;
use sonarfix_map::Scenario;
use sonarfix_report::Report;
use sonarfix_report::trace_csv;
use sonarfix_sim::monte_carlo;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::Summary;
use sonarfix_sim::trace::Trace;

use crate::overrides::Overrides;
use crate::progress::Runs;
use crate::table::{self, Beside, Measured};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The scenario file (docs/formats.md).
    scenario: PathBuf,
    /// Number of runs; by default that of the scenario.
    #[arg(long)]
    runs: Option<u32>,
    /// Seed of the first run; the others count up from it.
    #[arg(long)]
    seed: Option<u64>,
    /// Writes the trace of the first run as CSV (docs/formats.md).
    #[arg(long, value_name = "FILE.csv")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    output: Output,
}

/// The output.
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

/// A scenario and a number of runs.
#[derive(Debug)]
pub struct Experiment {
    pub simulation: Simulation,
    pub runs: u32,
    pub seed: u64,
    /// Whether to show the paper's values.
    pub beside_paper: bool,
}

impl Experiment {
    /// Runs the scenario and writes the output.
    pub fn conduct(&self, output: &Output) -> anyhow::Result<()> {
        anyhow::ensure!(self.runs > 0, "--runs must be at least 1");
        if let Some(dir) = &output.out {
            // Before the work: what cannot be written is not worth computing.
            std::fs::create_dir_all(dir).with_context(|| format!("--out {}", dir.display()))?;
        }
        let measured = self.measure()?;
        if output.json {
            crate::json::print(&measured)?;
        } else {
            println!("{}", table::text(&self.table(&measured)));
        }
        if let Some(dir) = &output.out {
            let page = self.report(&measured, &self.trace()?, dir)?;
            eprintln!("open {}", page.display());
        }
        Ok(())
    }

    fn measure(&self) -> anyhow::Result<Measured> {
        let start = ProcessTime::now();
        let runs = Runs::new(self.runs);
        let results = monte_carlo::results(&self.simulation, self.seed, self.runs, &runs);
        runs.end()?;
        let summary = Summary::of(&results?);
        Ok(Measured { summary, cpu_seconds: start.elapsed().as_secs_f64() })
    }

    /// The trace of the first run.
    fn trace(&self) -> anyhow::Result<Trace> {
        let mut trace = self.simulation.empty_trace();
        self.simulation.run(self.seed, &mut trace)?;
        Ok(trace)
    }

    fn table(&self, measured: &Measured) -> sonarfix_report::Table {
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
        table::states(measured, &Beside { truth, paper: self.beside_paper })
    }

    fn report(&self, measured: &Measured, trace: &Trace, dir: &Path) -> anyhow::Result<PathBuf> {
        let scenario = &self.simulation.scenario;
        let report = Report {
            title: format!("Sonarfix: {}", scenario.name),
            subtitle: format!(
                "{}. The table is for {} runs; figures and player show the run with seed {}.",
                scenario.description.trim().trim_end_matches('.'),
                measured.summary.runs,
                self.seed
            ),
            tables: vec![self.table(measured)],
            trace,
        };
        Ok(report.write(dir)?)
    }
}
