//! `sonarfix run`: runs a scenario a number of times.

use std::path::{Path, PathBuf};

use cpu_time::ProcessTime;
use sonarfix_exchange::trace_csv;
use sonarfix_map::Scenario;
use sonarfix_monitor::simulated;
use sonarfix_plan::overrides::Overrides;
use sonarfix_report::Report;
use sonarfix_rows::{Plan, Shard};
use sonarfix_sim::monte_carlo;
use sonarfix_sim::row::Row;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::spread::Spread;
use sonarfix_sim::statistics::Summary;
use sonarfix_sim::trace::Trace;

use crate::provenance;
use crate::recorded::Sources;
use crate::rows::{self, Counted};
use crate::serve::{self, PacedArgs};
use crate::sweep_values::Sweep;
use crate::table::{self, Beside, Measured};
use crate::warnings::{self, Warned, Warning};
use sonarfix_terminal::output::{check_file, check_folder};
use sonarfix_terminal::progress::{Runs, is_interrupted};

/// Most runs whose spread is in a report: they are computed again, with all their ticks.
const MOST_SPREAD: u32 = 100;
/// The same after Ctrl-C, when the command should end within a second.
const LAST_SPREAD: u32 = 10;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The scenario file (docs/formats.md).
    pub scenario: PathBuf,
    /// Number of runs; by default that of the scenario.
    #[arg(long)]
    pub runs: Option<u32>,
    /// Seed of the first run; the others count up from it.
    #[arg(long)]
    pub seed: Option<u64>,
    /// Writes the trace of the first run as CSV (docs/formats.md).
    #[arg(long, value_name = "FILE.csv")]
    trace: Option<PathBuf>,
    /// Writes the log that the robot of the first run would have recorded, and beside it reference.csv with the true poses,
    /// robot.toml and map.toml. Needs the fidelity "pins".
    #[arg(long, value_name = "LOG.csv")]
    record: Option<PathBuf>,
    /// Replaces files that exist by the recording.
    #[arg(long, requires = "record")]
    force: bool,
    /// Runs the scenario with several values of a key of the scenario or robot file: KEY=A,B,… or KEY=A..B:N, like
    /// sonar.noise=2mm..10mm:5. With several sweeps, all combinations.
    #[arg(long, value_name = "KEY=VALUES", conflicts_with_all = ["trace", "worst", "record"])]
    pub sweep: Vec<Sweep>,
    #[command(flatten)]
    pub rows: rows::RowsArgs,
    #[command(flatten)]
    pub overrides: Overrides,
    #[command(flatten)]
    pub paced: PacedArgs,
    #[command(flatten)]
    pub output: Output,
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
    let warnings = warnings::show(&[&args.scenario]);
    args.overrides.apply(&mut scenario)?;
    let experiment = Experiment {
        runs: args.runs.unwrap_or(scenario.run.runs),
        seed: args.seed.unwrap_or(scenario.run.seed),
        simulation: Simulation::new(scenario),
        beside_paper: false,
        provenance: provenance::of_scenario(&args.scenario),
        warnings,
    };
    anyhow::ensure!(experiment.runs > 0, "--runs must be at least 1");
    let scenario = &experiment.simulation.scenario;
    let title = format!("Sonarfix: {}, seed {}", scenario.name, experiment.seed);
    let mut scene = serve::scene(title, "simulation", &scenario.floor, &scenario.robot);
    scene.obstacles = experiment.simulation.empty_trace().obstacles;
    if let Some(mut paced) =
        args.paced.start(&scene, Sources { map: Some(&args.scenario), robot: None })?
    {
        experiment.simulation.run(experiment.seed, &mut paced)?;
        paced.end();
    }
    if let Some(dir) = &args.output.out {
        check_folder("--out", dir)?;
    }
    if let Some(dir) = &args.rows.traces {
        check_folder("--traces", dir)?;
    }
    if let Some(file) = &args.rows.rows {
        check_file("--rows", file)?;
    }
    if let Some(file) = &args.record {
        check_file("--record", file)?;
    }
    if let Some(file) = &args.trace {
        check_file("--trace", file)?;
        write_trace(&experiment.trace()?, file)?;
    }
    if let Some(file) = &args.record {
        simulated::record(&experiment.simulation, experiment.seed, file, None, args.force)?;
    }
    let counted = experiment.counted(&args.rows)?;
    experiment.show(&counted.measured, &args.output)?;
    experiment.show_worst(&counted.worst, args)
}

fn write_trace(trace: &Trace, file: &Path) -> anyhow::Result<()> {
    sonarfix_files::write_with(file, |out| trace_csv::write(trace, out))
}

/// A scenario and a number of runs.
#[derive(Debug)]
pub struct Experiment {
    pub simulation: Simulation,
    pub runs: u32,
    pub seed: u64,
    /// Whether to show the paper's values.
    pub beside_paper: bool,
    /// Where the report comes from.
    pub provenance: sonarfix_report::Table,
    /// Improbable values of its files.
    pub warnings: Vec<Warning>,
}

impl Experiment {
    /// Runs the scenario and writes the output.
    pub fn conduct(&self, output: &Output) -> anyhow::Result<()> {
        anyhow::ensure!(self.runs > 0, "--runs must be at least 1");
        if let Some(dir) = &output.out {
            check_folder("--out", dir)?;
        }
        self.show(&self.measure(0)?.measured, output)
    }

    fn show(&self, measured: &Measured, output: &Output) -> anyhow::Result<()> {
        if output.json {
            let warned = Warned { result: measured, warnings: &self.warnings };
            sonarfix_terminal::json::print(&warned)?;
        } else {
            println!("{}", self.table(measured).text());
        }
        self.explain_losses(&measured.summary);
        if let Some(dir) = &output.out {
            let page = self.report(measured, &self.trace()?, dir)?;
            eprintln!("open {}", page.display());
        }
        Ok(())
    }

    /// Says that runs ended lost, and why as far as the scenario shows it.
    fn explain_losses(&self, summary: &Summary) {
        let Summary { lost_runs, runs, .. } = summary;
        if *lost_runs == 0 {
            return;
        }
        let scenario = &self.simulation.scenario;
        let symmetries = sonarfix_map::symmetries(&scenario.floor).unwrap_or_default();
        let reason = match symmetries.first() {
            _ if !scenario.robot.start.is_unknown() => {
                "`--out report` shows where, `--start relocalize` lets a lost robot search, and `sonarfix check` names \
                 improbable values"
                    .to_owned()
            }
            Some(symmetry) => format!(
                "{symmetry}. Its search finds several poses there and no unique one: `sonarfix map check` proposes an \
                 addition to the room, or give `start_region` in the robot file"
            ),
            None => "no pose was unique until the end of the path: drive longer, past more corners, and nearer to the walls \
                     (`sonarfix plan --starts` forecasts how far)"
                .to_owned(),
        };
        eprintln!("warning: {lost_runs} of {runs} runs ended lost: {reason}");
    }

    /// The runs, through a file of rows if one is requested.
    fn counted(&self, args: &rows::RowsArgs) -> anyhow::Result<Counted> {
        let most = args.worst.unwrap_or(0);
        let Some(file) = &args.rows else {
            return self.measure(most);
        };
        let shard = args.shard.unwrap_or(Shard::ALL);
        let plan = Plan::new(&self.simulation.scenario, self.seed, self.runs, shard);
        anyhow::ensure!(plan.part().1 > 0, "shard {shard} of {} runs has no run", self.runs);
        rows::compute(&self.simulation, &plan, file, most)
    }

    fn measure(&self, most: usize) -> anyhow::Result<Counted> {
        let start = ProcessTime::now();
        let runs = Runs::new(self.runs);
        let rows = monte_carlo::rows(&self.simulation, self.seed, self.runs, &runs);
        runs.end()?;
        let rows = rows?;
        let (summary, worst) =
            rows::summary(|| Ok(Box::new(rows.clone().into_iter().map(Ok))), most)?;
        let measured = Measured { summary, cpu_seconds: start.elapsed().as_secs_f64() };
        Ok(Counted { measured, worst })
    }

    /// Lists the runs with the largest errors, and writes their traces.
    fn show_worst(&self, worst: &[Row], args: &Args) -> anyhow::Result<()> {
        if !worst.is_empty() && !args.output.json {
            println!("\n{}", rows::worst_table(worst).text());
        }
        let Some(dir) = &args.rows.traces else {
            return Ok(());
        };
        for row in worst {
            let file = dir.join(format!("seed-{}.csv", row.seed));
            write_trace(&self.trace_of(row.seed)?, &file)?;
        }
        Ok(())
    }

    /// The trace of the first run.
    fn trace(&self) -> anyhow::Result<Trace> {
        self.trace_of(self.seed)
    }

    fn trace_of(&self, seed: u64) -> anyhow::Result<Trace> {
        let mut trace = self.simulation.empty_trace();
        self.simulation.run(seed, &mut trace)?;
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
        let most = if is_interrupted() { LAST_SPREAD } else { MOST_SPREAD };
        let spread = Spread::of(&self.simulation, self.seed, self.runs.min(most))?;
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
            spread: Some(&spread),
            provenance: self.provenance.clone(),
            of_paper: self.beside_paper,
        };
        Ok(report.write(dir)?)
    }
}
