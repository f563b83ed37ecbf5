//! `sonarfix-studies relocalize`: robots that lose their pose, or start without one, in random floor plans.

use sonarfix_report::Table;
use sonarfix_studies::relocalization::{self, Summary, Trial, Upset};

use sonarfix_terminal::progress::Runs;

use crate::output::Output;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of trials, each in a floor plan of its own.
    #[arg(long, default_value_t = 20)]
    runs: u32,
    /// Seed of the first trial; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Duration after the start, the kidnapping or the slip.
    #[arg(long, default_value_t = 60.0)]
    seconds: f64,
    /// Starts with a pose, and carries the robot so far after 30 s; without it the robot starts without a pose.
    #[arg(long, value_name = "METRES")]
    kidnapped: Option<f64>,
    /// Starts with a pose, and lets a wheel slip after 30 s, which turns the odometry by so much.
    #[arg(long, value_name = "DEGREES", conflicts_with = "kidnapped")]
    slipped: Option<f64>,
    #[command(flatten)]
    output: Output,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.seconds > 0.0, "--seconds must be positive");
    let upset = match (args.kidnapped, args.slipped) {
        (Some(metres), _) => Upset::Kidnapped(metres),
        (None, Some(degrees)) => Upset::Slipped(degrees.to_radians()),
        (None, None) => Upset::UnknownStart,
    };
    let runs = Runs::new(args.runs);
    let trials = relocalization::trials(args.seed, args.runs, upset, args.seconds, &runs)?;
    runs.end()?;
    anyhow::ensure!(!trials.is_empty(), "no floor plan of these seeds is large enough");
    let summary = Summary::new(&trials);
    let table = |summary: &_| summary_table(summary, args.seconds);
    args.output.print(("summary", &summary), &trials, table, trial_table)
}

fn trial_table(trials: &[Trial]) -> Table {
    let seconds = |time: Option<f64>| time.map_or("-".to_owned(), |time| format!("{time:.1}"));
    let row = |trial: &Trial| {
        let hand_overs = trial.hand_overs.iter().map(|hand_over| {
            let word = if hand_over.is_right { "right" } else { "wrong" };
            format!("{word} after {:.1} s", hand_over.after)
        });
        let end = match (trial.is_back, trial.is_wrong_and_tracking) {
            (true, _) => "right",
            (_, true) => "wrong and Tracking",
            _ => "no pose",
        };
        let hand_overs: Vec<String> = hand_overs.collect();
        vec![
            trial.seed.to_string(),
            trial.walls.to_string(),
            seconds(trial.searched_after),
            hand_overs.join(", "),
            end.to_owned(),
        ]
    };
    Table {
        title: "Trials".to_owned(),
        note: String::new(),
        columns: ["seed", "walls", "searched after (s)", "hand-overs", "at the end"]
            .map(str::to_owned)
            .into(),
        rows: trials.iter().map(row).collect(),
    }
}

fn summary_table(summary: &Summary, seconds: f64) -> Table {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    Table {
        title: format!("{} trials of {seconds} s", summary.trials),
        note: String::new(),
        columns: ["", "value"].map(str::to_owned).into(),
        rows: vec![
            row("loss noticed", percent(summary.searched)),
            row("first hand-over right", percent(summary.first_right)),
            row("first hand-over wrong", percent(summary.first_wrong)),
            row("right and Tracking before", summary.was_tracking.map_or("-".to_owned(), percent)),
            row("right and Tracking 20 pings later", percent(summary.right_later)),
            row("wrong pose confirmed", percent(summary.confirmed_wrong)),
            row("right pose at the end", percent(summary.back)),
            row("right pose at the end without a search", percent(summary.kept)),
            row("wrong and Tracking at the end", percent(summary.wrong_and_tracking)),
            row("mean time to the first hand-over", format!("{:.1} s", summary.mean_seconds)),
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
