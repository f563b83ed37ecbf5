//! `sonarfix find`: searches for the pose of a robot without a start pose.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::Context;
use sonarfix_map::{MapFile, Scenario, robot_file, with_cabinet};
use sonarfix_replay::find::{Find, Found};
use sonarfix_report::Table;
use sonarfix_studies::floor_plan::Kind;
use sonarfix_studies::search_study::{self, Plans, Summary, Trial};

use crate::progress::Runs;
use crate::table;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A log (.csv) or a scenario (.toml); docs/formats.md.
    #[arg(required_unless_present = "floor_plans")]
    file: Option<PathBuf>,
    /// The map of a log; by default map.toml beside the log.
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// The robot of a log; by default robot.toml beside the log.
    #[arg(long, value_name = "ROBOT.toml")]
    config: Option<PathBuf>,
    /// Number of trials in a scenario.
    #[arg(long, default_value_t = 20)]
    runs: u32,
    /// Seed of the first trial; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Longest duration of a trial.
    #[arg(long, default_value_t = 120.0)]
    seconds: f64,
    /// Makes so many trials in random floor plans instead.
    #[arg(long, value_name = "TRIALS", conflicts_with = "file")]
    floor_plans: Option<u32>,
    /// Adds a mapped cabinet to a scenario, beside the wall that is nearest to this place.
    #[arg(long, value_name = "X,Y")]
    cabinet: Option<String>,
    /// Takes only homes among the floor plans.
    #[arg(long, requires = "floor_plans")]
    homes: bool,
    /// Walls of the map of each floor plan: those of other plans stand beside it, and a plan with more is left out.
    #[arg(long, requires = "floor_plans", value_parser = clap::value_parser!(u16).range(1..))]
    walls: Option<u16>,
    /// Prints every trial.
    #[arg(long)]
    trials: bool,
    /// Prints JSON instead of a table.
    #[arg(long)]
    json: bool,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.seconds > 0.0, "--seconds must be positive");
    let trials = match (&args.file, args.floor_plans) {
        (_, Some(trials)) => {
            let kind = args.homes.then_some(Kind::Home);
            let runs = Runs::new(trials);
            let walls = args.walls.map(usize::from);
            let plans = Plans { first: args.seed, trials, kind, walls };
            let found = search_study::floor_plans(&plans, args.seconds, &runs)?;
            runs.end()?;
            found
        }
        (Some(file), None) if file.extension().is_some_and(|end| end == "csv") => {
            return search_log(file, args);
        }
        (Some(file), None) => {
            let mut scenario = Scenario::read(file)?;
            if let Some(at) = &args.cabinet {
                let floor = with_cabinet(&scenario.floor, point(at)?);
                scenario.floor = floor.context("the map has no wall")?;
            }
            let runs = Runs::new(args.runs);
            let found =
                search_study::scenario(&scenario, args.seed, args.runs, args.seconds, &runs)?;
            runs.end()?;
            found
        }
        (None, None) => anyhow::bail!("a log or a scenario is needed"),
    };
    anyhow::ensure!(!trials.is_empty(), "at least 1 trial is needed");
    let summary = Summary::new(&trials);
    if args.json {
        return crate::json::print(&serde_json::json!({ "summary": summary, "trials": trials }));
    }
    if args.trials {
        println!("{}\n", table::text(&trial_table(&trials)));
    }
    println!("{}", table::text(&summary_table(&summary, args.seconds)));
    Ok(())
}

/// A point as `X,Y`, metres.
fn point(text: &str) -> anyhow::Result<[f64; 2]> {
    let (x, y) = text.split_once(',').context("--cabinet must be X,Y in metres")?;
    let number = |text: &str| text.trim().parse().context("--cabinet must be X,Y in metres");
    Ok([number(x)?, number(y)?])
}

fn search_log(log: &Path, args: &Args) -> anyhow::Result<()> {
    let beside = |given: &Option<PathBuf>, name: &str| {
        given.clone().unwrap_or_else(|| log.with_file_name(name))
    };
    let floor = MapFile::read(&beside(&args.map, "map.toml"), None)?.floor;
    let robot = robot_file::read(&beside(&args.config, "robot.toml"))?;
    let walls = floor.walls();
    let file = File::open(log).with_context(|| log.display().to_string())?;
    let found = Find { robot: &robot, walls: &walls }.run(BufReader::new(file))?;
    if args.json {
        return crate::json::print(&found);
    }
    println!("{}", table::text(&found_table(&found)));
    Ok(())
}

fn found_table(found: &Found) -> Table {
    let row = |(n, candidate): (usize, &sonarfix_replay::find::Candidate)| {
        let pose = &candidate.pose;
        vec![
            if n < found.answers { "answer".to_owned() } else { "hypothesis".to_owned() },
            format!("{:.3}", pose.x),
            format!("{:.3}", pose.y),
            format!("{:.1}", pose.heading.to_degrees()),
            format!("{:.3}", candidate.position_deviation),
            format!("{:.1}", candidate.heading_deviation.to_degrees()),
            format!("{:.2}", candidate.fit),
            format!("{:.0} %", 100.0 * candidate.explained),
        ]
    };
    let after = found.unique_after.map_or(String::new(), |s| format!(", unique after {s:.1} s"));
    Table {
        title: format!("{}{after}", found.answer),
        note: format!("{} pings, {} cycles", found.pings, found.cycles),
        columns: ["", "x (m)", "y (m)", "heading (deg)", "± m", "± deg", "fit", "explained"]
            .map(str::to_owned)
            .into(),
        rows: found.hypotheses.iter().enumerate().map(row).collect(),
    }
}

fn trial_table(trials: &[Trial]) -> Table {
    let row = |trial: &Trial| {
        let answer = match (trial.unique_after, trial.is_right) {
            (Some(after), true) => format!("right after {after:.1} s"),
            (Some(after), false) => format!("wrong after {after:.1} s"),
            (None, _) => format!("{} answers", trial.answers),
        };
        let rank = trial.rank.map_or("-".to_owned(), |rank| (rank + 1).to_string());
        vec![trial.seed.to_string(), trial.walls.to_string(), answer, rank]
    };
    Table {
        title: "Trials".to_owned(),
        note: "rank: place of the true pose in the bank".to_owned(),
        columns: ["seed", "walls", "unique", "rank"].map(str::to_owned).into(),
        rows: trials.iter().map(row).collect(),
    }
}

fn summary_table(summary: &Summary, seconds: f64) -> Table {
    let mean_time = if summary.mean_seconds.is_nan() {
        "none is unique".into()
    } else {
        format!("{:.1} s", summary.mean_seconds)
    };
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let twins = summary.with_all_twins.map_or("no symmetry".to_owned(), percent);
    Table {
        title: format!("{} trials of at most {seconds} s", summary.trials),
        note: String::new(),
        columns: ["", "value"].map(str::to_owned).into(),
        rows: vec![
            row("unique and right", percent(summary.unique_and_right)),
            row("the same within 45 s", percent(summary.right_within_45)),
            row("unique and wrong", percent(summary.unique_and_wrong)),
            row("true pose in the bank at the end", percent(summary.in_bank)),
            row("true pose and all twins among the answers", twins),
            row("true pose best at the end", percent(summary.best_is_right)),
            row("mean time to a unique answer", mean_time),
            row("evaluations of a cycle, mean", format!("{:.0}", summary.cycle)),
            row("the same by the walls", format!("{:.1}", summary.cycle_a_wall)),
            row("evaluations of the longest cycle", format!("{:.0}", summary.longest_cycle)),
            row("the same by the walls", format!("{:.1}", summary.longest_cycle_a_wall)),
            row(
                "position error, 95th percentile",
                format!("{:.1} cm", 100.0 * summary.position_error_95),
            ),
            row(
                "heading error, 95th percentile",
                format!("{:.1} deg", summary.heading_error_95.to_degrees()),
            ),
        ],
    }
}
