//! `sonarfix compare`: two runs side by side.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::ensure;
use serde::Serialize;
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::robot_text;
use sonarfix_report::Table;
use sonarfix_report::comparison::Comparison;
use sonarfix_terminal::output::check_folder;

use crate::provenance;
use crate::recorded::{Run, Sources};
use crate::run::Output;
use crate::statistics::Figures;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The first run: a log, which is replayed; a trace of `run --trace` or `replay --trace`; or a scenario, of which the first
    /// run is simulated (docs/formats.md).
    first: PathBuf,
    /// The second run, in the same way.
    second: PathBuf,
    /// The map of logs and traces, or the scenario of a trace; by default map.toml beside each. Given twice: that of the first
    /// and that of the second.
    #[arg(long, value_name = "MAP")]
    map: Vec<PathBuf>,
    /// The robot of logs; by default robot.toml beside each. Given twice: that of the first and that of the second.
    #[arg(long, value_name = "ROBOT.toml")]
    config: Vec<PathBuf>,
    #[command(flatten)]
    output: Output,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Compared<'a> {
    first: Side<'a>,
    second: Side<'a>,
    settings: &'a [Setting],
}

/// A run.
#[derive(Debug, Serialize)]
struct Side<'a> {
    name: &'a str,
    #[serde(flatten)]
    figures: Figures,
}

/// A key of the robot file with another value in each run.
#[derive(Debug, Serialize)]
struct Setting {
    key: String,
    first: Option<String>,
    second: Option<String>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if let Some(dir) = &args.output.out {
        check_folder("--out", dir)?;
    }
    let [first_map, second_map] = of_each("--map", &args.map)?;
    let [first_robot, second_robot] = of_each("--config", &args.config)?;
    let first = Run::read(&args.first, Sources { map: first_map, robot: first_robot })?;
    let second = Run::read(&args.second, Sources { map: second_map, robot: second_robot })?;
    let settings = first.robot.zip(second.robot).map(|(first, second)| settings(&first, &second));
    let figures = [&first, &second].map(|run| run.statistics.figures());
    let tables: Vec<_> =
        std::iter::once(differences(&figures)).chain(settings.as_deref().map(table)).collect();
    if args.output.json {
        let [one, other] = figures;
        sonarfix_terminal::json::print(&Compared {
            first: Side { name: &first.name, figures: one },
            second: Side { name: &second.name, figures: other },
            settings: settings.as_deref().unwrap_or_default(),
        })?;
    } else {
        let texts: Vec<_> = tables.iter().map(Table::text).collect();
        println!("{}", texts.join("\n\n"));
    }
    if let Some(dir) = &args.output.out {
        eprintln!("open {}", page(&first, &second, tables).write(dir)?.display());
    }
    Ok(())
}

/// The file for each run of an option that is given at most twice.
fn of_each<'a>(option: &str, given: &'a [PathBuf]) -> anyhow::Result<[Option<&'a Path>; 2]> {
    ensure!(given.len() <= 2, "{option} was given {} times, for two runs", given.len());
    let first = given.first().map(PathBuf::as_path);
    Ok([first, given.last().map(PathBuf::as_path)])
}

fn page<'a>(first: &'a Run, second: &'a Run, tables: Vec<Table>) -> Comparison<'a> {
    let maps = if first.trace.walls == second.trace.walls {
        "Both are on the same map."
    } else {
        "Their maps differ."
    };
    let mut files: Vec<&Path> = first.files.iter().map(PathBuf::as_path).collect();
    files.extend(
        second
            .files
            .iter()
            .map(PathBuf::as_path)
            .filter(|file| !first.files.iter().any(|other| other == file)),
    );
    Comparison {
        title: "Sonarfix: two runs side by side".to_owned(),
        subtitle: format!("{} and {}. {maps}", first.name, second.name),
        names: [first.name.clone(), second.name.clone()],
        runs: [&first.trace, &second.trace],
        tables,
        provenance: provenance::table(&files),
    }
}

/// A row of the differences: its name, its value, and the decimals that are shown.
type Row = (&'static str, fn(&Figures) -> Option<f64>, u8);

const MM: f64 = 1e3;
const PER_CENT: f64 = 100.0;

#[expect(clippy::cast_precision_loss, reason = "counts of a run")]
const ROWS: [Row; 23] = [
    ("duration (s)", |f| Some(f.duration), 1),
    ("distance by the encoders (m)", |f| Some(f.distance), 2),
    ("position error, RMS (mm)", |f| Some(f.position_rms? * MM), 1),
    ("position error, median (mm)", |f| Some(f.position_median? * MM), 1),
    ("position error, worst (mm)", |f| Some(f.position_max? * MM), 1),
    ("the same by the encoders alone, RMS (mm)", |f| Some(f.odometry_position_rms? * MM), 1),
    ("heading error, RMS (deg)", |f| Some(f.heading_rms?.to_degrees()), 2),
    ("heading error, worst (deg)", |f| Some(f.heading_max?.to_degrees()), 2),
    ("ranges accepted", |f| Some(f.fixes.accepted as f64), 0),
    ("ranges gated", |f| Some(f.fixes.gated as f64), 0),
    ("ranges refused", |f| Some(f.fixes.refused as f64), 0),
    ("verdict degraded (s)", |f| Some(f.health.degraded_seconds), 1),
    ("verdict lost (s)", |f| Some(f.health.lost_seconds), 1),
    ("first lost after (s)", |f| f.health.lost_at, 1),
    ("lost at the end", |f| Some(f.health.lost_at_end.into()), 0),
    ("deviation of x at the end (mm)", |f| Some(f.final_pose_deviation[0] * MM), 1),
    ("deviation of y at the end (mm)", |f| Some(f.final_pose_deviation[1] * MM), 1),
    (
        "deviation of the heading at the end (deg)",
        |f| Some(f.final_pose_deviation[2].to_degrees()),
        2,
    ),
    (
        "scale error of the right wheel at the end (%)",
        |f| Some(f.calibration.scale_right * PER_CENT),
        3,
    ),
    (
        "scale error of the left wheel at the end (%)",
        |f| Some(f.calibration.scale_left * PER_CENT),
        3,
    ),
    ("track width at the end (mm)", |f| Some(f.calibration.track_width * MM), 2),
    ("scale error of the ranges at the end (%)", |f| Some(f.calibration.range_scale * PER_CENT), 3),
    ("ranges accepted per metre", |f| per_metre(f), 2),
];

#[expect(clippy::cast_precision_loss, reason = "counts of a run")]
fn per_metre(figures: &Figures) -> Option<f64> {
    (figures.distance > 0.0).then(|| figures.fixes.accepted as f64 / figures.distance)
}

/// The figures of both runs, and the second less the first. A row that is unknown in both is left out.
fn differences([first, second]: &[Figures; 2]) -> Table {
    let row = |(name, value, decimals): Row| {
        let (one, other) = (value(first), value(second));
        let shown = usize::from(decimals);
        one.or(other)?;
        let cell = |value: Option<f64>| {
            value.map_or_else(|| "–".to_owned(), |value| format!("{value:.shown$}"))
        };
        // Adding zero turns −0 into 0.
        let scale = 10_f64.powi(decimals.into());
        let rounded = |value: f64| (value * scale).round() / scale + 0.0;
        let less = one.zip(other).map(|(one, other)| rounded(other - one));
        let less = less.map_or_else(|| "–".to_owned(), |value| format!("{value:+.shown$}"));
        Some(vec![name.to_owned(), cell(one), cell(other), less])
    };
    let has_truth = first.position_rms.or(second.position_rms).is_some();
    let note = if has_truth {
        "errors are those at the encoder ticks"
    } else {
        "the true pose is not known"
    };
    Table {
        title: "Differences".to_owned(),
        note: note.to_owned(),
        columns: ["", "first", "second", "second − first"].map(str::to_owned).to_vec(),
        rows: ROWS.into_iter().filter_map(row).collect(),
    }
}

/// The keys of the robot file with another value in each run.
fn settings(first: &RobotConfig, second: &RobotConfig) -> Vec<Setting> {
    let [first, second] = [first, second].map(keys);
    let mut names: Vec<&String> = first.keys().chain(second.keys()).collect();
    names.sort();
    names.dedup();
    let setting = |key: &String| {
        let (one, other) = (first.get(key), second.get(key));
        (one != other).then(|| Setting {
            key: key.clone(),
            first: one.cloned(),
            second: other.cloned(),
        })
    };
    names.into_iter().filter_map(setting).collect()
}

/// The keys of a robot, as in its file, with their values.
fn keys(robot: &RobotConfig) -> BTreeMap<String, String> {
    let table = robot_text(robot).parse::<toml::Table>().unwrap_or_default();
    let mut found = BTreeMap::new();
    flatten("", &table, &mut found);
    found
}

fn flatten(prefix: &str, table: &toml::Table, found: &mut BTreeMap<String, String>) {
    for (name, value) in table {
        let key = format!("{prefix}{name}");
        match value {
            toml::Value::Table(below) => flatten(&format!("{key}."), below, found),
            toml::Value::String(text) => _ = found.insert(key, text.clone()),
            other => _ = found.insert(key, other.to_string()),
        }
    }
}

fn table(settings: &[Setting]) -> Table {
    let cell = |value: &Option<String>| value.clone().unwrap_or_else(|| "–".to_owned());
    let row =
        |setting: &Setting| vec![setting.key.clone(), cell(&setting.first), cell(&setting.second)];
    let note = if settings.is_empty() { "the robot files have the same values" } else { "" };
    Table {
        title: "Settings of the robot that differ".to_owned(),
        note: note.to_owned(),
        columns: ["key", "first", "second"].map(str::to_owned).to_vec(),
        rows: settings.iter().map(row).collect(),
    }
}
