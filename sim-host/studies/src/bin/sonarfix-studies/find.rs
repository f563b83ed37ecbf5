//! `sonarfix-studies find`: simulated robots that search for their pose without a start pose.

use std::path::PathBuf;

use anyhow::Context;
use sonarfix_map::{Scenario, with_cabinet};
use sonarfix_plan::trial::Trial;
use sonarfix_report::Table;
use sonarfix_studies::floor_plan::Kind;
use sonarfix_studies::quantiles::Quantiles;
use sonarfix_studies::search_bound::{self, Bounded, Times};
use sonarfix_studies::search_study::{self, Mistake, Plans, Summary};
use sonarfix_terminal::progress::Runs;

use crate::output::{self, Output};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A scenario (docs/formats.md).
    #[arg(required_unless_present = "floor_plans")]
    file: Option<PathBuf>,
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
    /// A mistake in the map or the robot file of each floor plan.
    #[arg(long, requires = "floor_plans", conflicts_with = "walls")]
    mistake: Option<Mistake>,
    /// Computes for each trial how soon its pings allow to find the pose: a grid of poses, with exact odometry and with that of the
    /// encoders.
    #[arg(long, requires = "floor_plans", conflicts_with = "mistake")]
    bound: bool,
    #[command(flatten)]
    output: Output,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.seconds > 0.0, "--seconds must be positive");
    let runs = Runs::new(args.floor_plans.unwrap_or(args.runs));
    let trials = match (&args.file, args.floor_plans) {
        (_, Some(trials)) => {
            let kind = args.homes.then_some(Kind::Home);
            let walls = args.walls.map(usize::from);
            let mistake = args.mistake;
            let plans = Plans { first: args.seed, trials, kind, walls, mistake };
            if args.bound {
                return bound(&plans, args, runs);
            }
            search_study::floor_plans(&plans, args.seconds, &runs)?
        }
        (Some(file), None) => {
            let mut scenario = Scenario::read(file)?;
            if let Some(at) = &args.cabinet {
                let floor = with_cabinet(&scenario.floor, point(at)?);
                scenario.floor = floor.context("the map has no wall")?;
            }
            search_study::scenario(&scenario, args.seed, args.runs, args.seconds, &runs)?
        }
        (None, None) => anyhow::bail!("a scenario is needed"),
    };
    runs.end()?;
    anyhow::ensure!(!trials.is_empty(), "at least 1 trial is needed");
    let summary = Summary::new(&trials);
    let table = |summary: &_| summary_table(summary, args.seconds);
    args.output.print(("summary", &summary), &trials, table, trial_table)
}

/// The trials, each with its bound.
fn bound(plans: &Plans, args: &Args, runs: Runs) -> anyhow::Result<()> {
    let trials = search_bound::floor_plans(plans, args.seconds, &runs)?;
    runs.end()?;
    anyhow::ensure!(!trials.is_empty(), "at least 1 trial is needed");
    let times = Times::new(&trials);
    let table = |times: &_| times_table(times, args.seconds);
    args.output.print(("times", &times), &trials, table, bound_table)
}

pub fn bound_table(trials: &[Bounded]) -> Table {
    let row = |bounded: &Bounded| {
        let bounds = [bounded.exact, bounded.measured];
        let [exact, measured] = bounds.map(|bound| output::found(bound.after, bound.is_right));
        let found = output::found(bounded.trial.unique_after, true);
        vec![bounded.trial.seed.to_string(), exact, measured, found]
    };
    Table {
        title: "Trials".to_owned(),
        note: String::new(),
        columns: ["seed", "possible after, exact odometry", "by the encoders", "found after"]
            .map(str::to_owned)
            .into(),
        rows: trials.iter().map(row).collect(),
    }
}

/// A time until an answer, if there is one.
fn time(after: Option<f64>) -> String {
    after.map_or("-".to_owned(), |after| format!("{after:.1} s"))
}

fn times_table(times: &Times, seconds: f64) -> Table {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let row = |share: &str, of: &Quantiles| {
        let times = [of.half, of.four_fifths, of.nineteen_twentieths].map(time);
        [vec![share.to_owned()], times.into(), vec![percent(of.wrong)]].concat()
    };
    let ratio = |of: Option<f64>| of.map_or("-".to_owned(), |ratio| format!("{ratio:.2}"));
    let [exact, measured] = [times.ratio_exact, times.ratio_measured].map(ratio);
    Table {
        title: format!("{} trials of at most {seconds} s", times.trials),
        note: format!(
            "time of the search over the bound, median: {exact} with exact odometry, {measured} by the encoders"
        ),
        columns: ["", "50 %", "80 %", "95 %", "wrong"].map(str::to_owned).into(),
        rows: vec![
            row("bound, exact odometry", &times.exact),
            row("bound, by the encoders", &times.measured),
            row("search", &times.found),
        ],
    }
}

/// A point as `X,Y`, metres.
fn point(text: &str) -> anyhow::Result<[f64; 2]> {
    let (x, y) = text.split_once(',').context("--cabinet must be X,Y in metres")?;
    let number = |text: &str| text.trim().parse().context("--cabinet must be X,Y in metres");
    Ok([number(x)?, number(y)?])
}

pub fn trial_table(trials: &[Trial]) -> Table {
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
            row("half of them within", time(summary.found.half)),
            row("80 % within", time(summary.found.four_fifths)),
            row("95 % within", time(summary.found.nineteen_twentieths)),
            row("unique and wrong", percent(summary.found.wrong)),
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
