//! `sonarfix bound`: the posterior Cramér–Rao bound of a run over time.

use std::path::PathBuf;

use sonarfix_map::Scenario;
use sonarfix_report::Table;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Tick;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The scenario file (docs/formats.md).
    scenario: PathBuf,
    /// Seed of the run; by default that of the scenario.
    #[arg(long)]
    seed: Option<u64>,
    /// Seconds between rows; by default a 24th of the run.
    #[arg(long)]
    every: Option<f64>,
    /// Prints JSON instead of a table.
    #[arg(long)]
    json: bool,
}

/// The bound at one instant, SI units.
#[derive(Debug, serde::Serialize)]
struct Row {
    time: f64,
    #[serde(flatten)]
    states: std::collections::BTreeMap<&'static str, f64>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let scenario = Scenario::read(&args.scenario)?;
    crate::warnings::show(&[&args.scenario]);
    let seed = args.seed.unwrap_or(scenario.run.seed);
    let every = args.every.unwrap_or(scenario.path.duration() / 24.0);
    anyhow::ensure!(every > 0.0, "--every must be positive");
    let simulation = Simulation::new(scenario);
    let mut trace = simulation.empty_trace();
    simulation.run(seed, &mut trace)?;
    let ticks = spaced(&trace.ticks, every);
    if args.json {
        return sonarfix_terminal::json::print(&ticks.filter_map(row).collect::<Vec<_>>());
    }
    let table = Table {
        title: format!(
            "Bound on the standard deviation of each state ({})",
            simulation.scenario.name
        ),
        note: format!("for the measurements of the run with seed {seed}"),
        columns: [
            "t (s)",
            "X (mm)",
            "Y (mm)",
            "heading (deg)",
            "S_R",
            "S_L",
            "track width (mm)",
            "range scale",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: ticks.filter_map(cells).collect(),
    };
    println!("{}", table.text());
    Ok(())
}

/// Ticks at least `every` seconds apart, including the last one.
fn spaced(ticks: &[Tick], every: f64) -> impl Iterator<Item = &Tick> {
    let last = ticks.last().map(|tick| tick.time);
    let mut due = 0.0;
    ticks.iter().filter(move |tick| {
        let shown = tick.time >= due || Some(tick.time) == last;
        if shown {
            due = tick.time + every - 1e-9;
        }
        shown
    })
}

fn row(tick: &Tick) -> Option<Row> {
    let states = sonarfix_sim::STATES.into_iter().zip(tick.bound?).collect();
    Some(Row { time: tick.time, states })
}

fn cells(tick: &Tick) -> Option<Vec<String>> {
    let [x, y, heading, right, left, width, range] = tick.bound?;
    Some(vec![
        format!("{:.0}", tick.time),
        format!("{:.2}", x * 1e3),
        format!("{:.2}", y * 1e3),
        format!("{:.3}", heading.to_degrees()),
        format!("{right:.2e}"),
        format!("{left:.2e}"),
        format!("{:.3}", width * 1e3),
        format!("{range:.2e}"),
    ])
}
