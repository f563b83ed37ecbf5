//! `sonarfix run --sweep`: a scenario with several values of some of its keys.

use std::path::{Path, PathBuf};

use anyhow::Context;
use serde::Serialize;
use sonarfix_map::Scenario;
use sonarfix_plan::edit::{self, Edit};
use sonarfix_report::Table;
use sonarfix_report::sweep::{Line, Picture};
use sonarfix_rows::{Plan, Shard};
use sonarfix_sim::monte_carlo;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::Summary;

use crate::rows;
use crate::run::{Args, Output};
use crate::sweep_values::{self, Sweep};
use sonarfix_terminal::output::check_folder;
use sonarfix_terminal::progress::Runs;

/// The picture's file.
const PICTURE: &str = "sweep.svg";

/// A combination of values, with the statistics of its runs.
#[derive(Debug, Serialize)]
struct Point {
    /// Each key with its value.
    values: Vec<(String, String)>,
    #[serde(flatten)]
    summary: Summary,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let text = sonarfix_map::read_text(&args.scenario)
        .with_context(|| format!("{} cannot be read", args.scenario.display()))?;
    let combinations = sweep_values::combinations(&args.sweep);
    // Before the work: a value that cannot be read is found at once.
    let scenarios = combinations.iter().map(|values| {
        let values: Vec<_> =
            values.iter().map(|(key, value)| (key.clone(), Edit::Text(value.clone()))).collect();
        let mut scenario = edit::scenario(&args.scenario, &text, &values, "--sweep ")?;
        args.overrides.apply(&mut scenario)?;
        Ok(scenario)
    });
    let scenarios = scenarios.collect::<anyhow::Result<Vec<_>>>()?;
    if let Some(dir) = &args.output.out {
        check_folder("--out", dir)?;
    }
    let mut points = Vec::new();
    for (number, (values, scenario)) in combinations.into_iter().zip(scenarios).enumerate() {
        let summary = measured(args, scenario, number + 1)?;
        points.push(Point { values, summary });
    }
    show(&points, &args.sweep, &args.output)
}

fn measured(args: &Args, scenario: Scenario, number: usize) -> anyhow::Result<Summary> {
    let runs = args.runs.unwrap_or(scenario.run.runs);
    let seed = args.seed.unwrap_or(scenario.run.seed);
    if let Some(file) = &args.rows.rows {
        let plan = Plan::new(&scenario, seed, runs, args.rows.shard.unwrap_or(Shard::ALL));
        let file = numbered(file, number);
        return Ok(rows::compute(&Simulation::new(scenario), &plan, &file, 0)?.measured.summary);
    }
    let bar = Runs::new(runs);
    let results = monte_carlo::results(&Simulation::new(scenario), seed, runs, &bar);
    bar.end()?;
    Ok(Summary::of(&results?))
}

/// The rows of one combination: `rows.csv` becomes `rows.1.csv`.
fn numbered(file: &Path, number: usize) -> PathBuf {
    let ending = file.extension().map(|ending| ending.to_string_lossy().into_owned());
    file.with_extension(match ending {
        Some(ending) => format!("{number}.{ending}"),
        None => number.to_string(),
    })
}

fn show(points: &[Point], sweeps: &[Sweep], output: &Output) -> anyhow::Result<()> {
    if output.json {
        sonarfix_terminal::json::print(&points)?;
    } else {
        println!("{}", as_table(points, sweeps).text());
    }
    if let Some(dir) = &output.out {
        let file = dir.join(PICTURE);
        let svg = picture(points, sweeps).svg().map_err(|error| anyhow::anyhow!("{error}"))?;
        sonarfix_files::write(&file, svg)?;
        eprintln!("open {}", file.display());
    }
    Ok(())
}

fn millimetres(summary: &Summary) -> f64 {
    1e3 * summary.rms_path.x.hypot(summary.rms_path.y)
}

fn as_table(points: &[Point], sweeps: &[Sweep]) -> Table {
    let keys = sweeps.iter().map(|sweep| sweep.key.clone());
    let figures =
        ["position (mm)", "heading (°)", "lost", "falsely lost", "undetected (s)", "NEES/n", "NIS"];
    let row = |Point { values, summary }: &Point| {
        let mut row: Vec<String> = values.iter().map(|(_, value)| value.clone()).collect();
        let states = f64::from(u32::try_from(summary.nees_states).unwrap_or(u32::MAX));
        row.extend([
            format!("{:.2}", millimetres(summary)),
            format!("{:.3}", summary.rms_path.heading.to_degrees()),
            summary.lost_runs.to_string(),
            summary.false_alarms.to_string(),
            format!("{:.1}", summary.undetected_error),
            format!("{:.3}", summary.nees_mean / states),
            format!("{:.3}", summary.nis_mean),
        ]);
        row
    };
    let runs = points.first().map_or(0, |point| point.summary.runs);
    Table {
        title: "Errors along the path (RMS) by the values of the sweep".to_owned(),
        note: format!("{runs} runs each, with the same seeds"),
        columns: keys.chain(figures.map(str::to_owned)).collect(),
        rows: points.iter().map(row).collect(),
    }
}

/// The position error over the values of the first key, with a line for each combination of the others.
fn picture(points: &[Point], sweeps: &[Sweep]) -> Picture {
    let first = sweeps.first();
    let mut lines: Vec<Line> = Vec::new();
    for Point { values, summary } in points {
        let others: Vec<&str> = values.iter().skip(1).map(|(_, value)| value.as_str()).collect();
        let label = if others.is_empty() { "position".to_owned() } else { others.join(", ") };
        let value = values.first().map_or("", |(_, value)| value.as_str());
        let x = first.map_or(0.0, |sweep| sweep.place(value));
        let at = (x, millimetres(summary));
        match lines.iter_mut().find(|line| line.label == label) {
            Some(line) => line.points.push(at),
            None => lines.push(Line { label, points: vec![at] }),
        }
    }
    Picture { x_label: first.map_or_else(String::new, Sweep::label), lines }
}
