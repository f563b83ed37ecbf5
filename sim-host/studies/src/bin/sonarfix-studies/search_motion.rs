//! `sonarfix-studies search-motion`: robots that move by themselves while they search for their pose.

use clap::ValueEnum;
use sonarfix_hal::config::SearchMotionKind;
use sonarfix_report::Table;
use sonarfix_studies::floor_plan::Kind;
use sonarfix_studies::search_motion::{self, Summary, Trial};
use sonarfix_studies::search_study::Plans;
use sonarfix_terminal::progress::Runs;

use crate::output::{self, Output};

/// The motions, as in a robot file.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Motion {
    None,
    Spin,
    Ahead,
}

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of trials, each in a floor plan of its own.
    #[arg(long, default_value_t = 20)]
    runs: u32,
    /// Seed of the first plan; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Longest duration of a trial, which ends with the first pose.
    #[arg(long, default_value_t = 60.0)]
    seconds: f64,
    /// The motion.
    #[arg(long, value_enum, default_value = "ahead")]
    motion: Motion,
    /// Takes only homes among the floor plans.
    #[arg(long)]
    homes: bool,
    #[command(flatten)]
    output: Output,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.seconds > 0.0, "--seconds must be positive");
    anyhow::ensure!(args.runs > 0, "at least 1 trial is needed");
    let kind = match args.motion {
        Motion::None => None,
        Motion::Spin => Some(SearchMotionKind::Spin),
        Motion::Ahead => Some(SearchMotionKind::Ahead),
    };
    let only = args.homes.then_some(Kind::Home);
    let plans =
        Plans { first: args.seed, trials: args.runs, kind: only, walls: None, mistake: None };
    let runs = Runs::new(args.runs);
    let trials = search_motion::floor_plans(&plans, kind, args.seconds, &runs)?;
    runs.end()?;
    let summary = Summary::new(&trials);
    let table = |summary: &_| summary_table(summary, args.seconds);
    args.output.print(("summary", &summary), &trials, table, trial_table)
}

fn trial_table(trials: &[Trial]) -> Table {
    let row = |trial: &Trial| {
        let found = output::found(trial.found_after, trial.is_right);
        vec![
            trial.seed.to_string(),
            found,
            format!("{:.1} m", trial.metres),
            format!("{:.0} cm", 100.0 * trial.nearest),
        ]
    };
    Table {
        title: "Trials".to_owned(),
        note: String::new(),
        columns: ["seed", "found after", "driven", "nearest obstacle"].map(str::to_owned).into(),
        rows: trials.iter().map(row).collect(),
    }
}

fn summary_table(summary: &Summary, seconds: f64) -> Table {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let time = |after: Option<f64>| after.map_or("-".to_owned(), |after| format!("{after:.1} s"));
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    Table {
        title: format!("{} trials of at most {seconds} s", summary.trials),
        note: String::new(),
        columns: ["", "value"].map(str::to_owned).into(),
        rows: vec![
            row("found, right", percent(summary.right)),
            row("found, wrong", percent(summary.found.wrong)),
            row("half of the trials within", time(summary.found.half)),
            row("80 % within", time(summary.found.four_fifths)),
            row("driven, mean", format!("{:.1} m", summary.metres)),
            row("came nearer than 10 cm to an obstacle", percent(summary.touched)),
        ],
    }
}
