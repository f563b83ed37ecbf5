//! `sonarfix-studies find-standing`: robots that stand and sweep, without a start pose.

use sonarfix_report::Table;
use sonarfix_studies::find_standing::{self, Summary};
use sonarfix_studies::floor_plan::Kind;
use sonarfix_studies::rooms::Family;
use sonarfix_studies::search_study::Plans;
use sonarfix_terminal::progress::Runs;

use crate::find::{bound_table, trial_table};
use crate::output::Output;
use crate::rooms::named;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of trials, each in a room or floor plan of its own.
    #[arg(long, default_value_t = 20)]
    runs: u32,
    /// Seed of the first; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Longest duration of a trial.
    #[arg(long, default_value_t = 5.0)]
    seconds: f64,
    /// Empty rooms of this family, by its name in docs/rooms.md, instead of furnished floor plans; each trial has the bound of its pings.
    #[arg(long)]
    family: Option<String>,
    /// Takes only homes among the floor plans.
    #[arg(long, conflicts_with = "family")]
    homes: bool,
    #[command(flatten)]
    output: Output,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.seconds > 0.0, "--seconds must be positive");
    anyhow::ensure!(args.runs > 0, "at least 1 trial is needed");
    let family = args.family.as_ref().map(|wanted| named(wanted, &Family::ALL, Family::name));
    let family = family.transpose()?;
    let runs = Runs::new(args.runs);
    let table = |summary: &_| summary_table(summary, args.seconds);
    if let Some(family) = family {
        let trials = find_standing::rooms(family, args.seed, args.runs, args.seconds, &runs)?;
        runs.end()?;
        let summary = Summary::bounded(&trials);
        return args.output.print(("summary", &summary), &trials, table, bound_table);
    }
    let kind = args.homes.then_some(Kind::Home);
    let (first, trials) = (args.seed, args.runs);
    let plans = Plans { first, trials, kind, walls: None, mistake: None };
    let trials = find_standing::floor_plans(&plans, args.seconds, &runs)?;
    runs.end()?;
    args.output.print(("summary", &Summary::new(&trials)), &trials, table, trial_table)
}

fn summary_table(summary: &Summary, seconds: f64) -> Table {
    let row = |name: &str, share: f64| vec![name.to_owned(), format!("{:.1} %", 100.0 * share)];
    let mut rows = vec![
        row("right within 3 s", summary.right_within_3),
        row("right", summary.right),
        row("wrong", summary.wrong),
        row("best hypothesis right at the end", summary.best_is_right),
    ];
    rows.extend(summary.possible_within_3.map(|share| row("possible within 3 s", share)));
    rows.extend(summary.possible_wrong.map(|share| row("possible, but wrong", share)));
    Table {
        title: format!("{} trials of at most {seconds} s", summary.trials),
        note: String::new(),
        columns: ["", "value"].map(str::to_owned).into(),
        rows,
    }
}
