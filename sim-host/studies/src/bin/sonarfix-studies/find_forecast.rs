//! `sonarfix-studies find-forecast`: the forecast of `map check --starts` beside simulated searches.

use sonarfix_plan::anywhere::{FURNITURE, Settings, Times};
use sonarfix_report::Table;
use sonarfix_studies::find_forecast::{
    self, Agreement, Boards, Change, Compared, Comparison, Summary,
};
use sonarfix_studies::floor_plan::Kind;
use sonarfix_studies::search_study::Plans;
use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "flags of a command line")]
pub struct Args {
    /// Number of floor plans.
    #[arg(long, default_value_t = 20)]
    floor_plans: u32,
    /// Seed of the first plan; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Takes only homes.
    #[arg(long)]
    homes: bool,
    /// Simulated searches in each plan.
    #[arg(long, default_value_t = 40)]
    trials: u32,
    /// Starts of each forecast.
    #[arg(long, default_value_t = 40)]
    starts: u32,
    /// Longest duration of a search.
    #[arg(long, default_value_t = 60.0)]
    seconds: f64,
    /// Pieces of furniture on 10 m² that the forecast assumes.
    #[arg(long, default_value_t = FURNITURE)]
    furniture: f64,
    /// Proposes boards where many starts have no answer, and repeats the searches with them.
    #[arg(long)]
    boards: bool,
    /// Prints every plan.
    #[arg(long)]
    plans: bool,
    /// Prints JSON instead of a table.
    #[arg(long)]
    json: bool,
}

/// Seeds of the forecasts, from those of the plans.
const FORECAST: u64 = 50_000_000;

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.seconds > 0.0, "--seconds must be positive");
    anyhow::ensure!(
        args.trials > 0 && args.starts > 0 && args.floor_plans > 0,
        "--floor-plans, --trials and --starts must be at least 1"
    );
    let kind = args.homes.then_some(Kind::Home);
    let plans =
        Plans { first: args.seed, trials: args.floor_plans, kind, walls: None, mistake: None };
    let forecast = Settings {
        starts: args.starts,
        seconds: args.seconds,
        seed: args.seed.wrapping_add(FORECAST),
        furniture: args.furniture,
    };
    let runs = Runs::new(args.floor_plans);
    let comparison = Comparison { forecast, trials: args.trials, boards: args.boards };
    let compared = find_forecast::floor_plans(&plans, &comparison, &runs)?;
    runs.end()?;
    let summary = Summary::new(&compared);
    if args.json {
        let answer = serde_json::json!({ "summary": summary, "plans": compared });
        return sonarfix_terminal::json::print(&answer);
    }
    if args.plans {
        println!("{}\n", plan_table(&compared).text());
    }
    println!("{}", summary_table(&summary, args).text());
    Ok(())
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn times(times: &Times) -> String {
    let seconds = |time: Option<f64>| time.map_or("-".to_owned(), |time| format!("{time:.1}"));
    let (median, most) = (seconds(times.median_seconds), seconds(times.most_seconds));
    format!("{median}, {most} s, {}", percent(1.0 - times.right))
}

fn plan_table(plans: &[Compared]) -> Table {
    let row = |plan: &Compared| {
        let with = plan.landmarks.as_ref().map_or("-".to_owned(), |board| times(&board.times));
        let simulated = plan.with_boards.as_ref().map_or("-".to_owned(), times);
        vec![
            plan.seed.to_string(),
            plan.walls.to_string(),
            times(&plan.forecast),
            times(&plan.simulated),
            with,
            simulated,
        ]
    };
    Table {
        title: "Plans".to_owned(),
        note: "median, nine in ten, share without a right answer".to_owned(),
        columns: ["seed", "walls", "forecast", "simulated", "forecast with boards", "simulated"]
            .map(str::to_owned)
            .into(),
        rows: plans.iter().map(row).collect(),
    }
}

fn summary_table(summary: &Summary, args: &Args) -> Table {
    let agreement = |name: &str, of: &Agreement| {
        vec![
            name.to_owned(),
            format!("{:.1} s", of.forecast),
            format!("{:.1} s", of.simulated),
            percent(of.near),
            format!("{:.2}", of.rank_correlation),
        ]
    };
    let [forecast, simulated, correlation] = summary.without;
    let without = vec![
        "without a right answer, mean".to_owned(),
        percent(forecast),
        percent(simulated),
        String::new(),
        format!("{correlation:.2}"),
    ];
    let [forecast, simulated, both] = summary.hard;
    let hard = format!(
        "A tenth of the starts or more without a right answer: {forecast} plans forecast, {simulated} simulated, {both} in both."
    );
    let boards = summary.boards.as_ref().map(boards_note);
    let note = [Some(hard), boards].into_iter().flatten().collect::<Vec<_>>().join("\n");
    Table {
        title: format!("{} plans, searches of at most {} s", summary.plans, args.seconds),
        note,
        columns: ["", "forecast", "simulated", "within 30 %", "rank correlation"]
            .map(str::to_owned)
            .into(),
        rows: vec![
            agreement("median", &summary.median),
            agreement("nine in ten", &summary.most),
            without,
        ],
    }
}

fn boards_note(boards: &Boards) -> String {
    let change = |of: &Change, text: &dyn Fn(f64) -> String| {
        let ([forecast, simulated], [forecast_with, simulated_with]) =
            (of.before.map(text), of.after.map(text));
        format!("{simulated} to {simulated_with} (forecast {forecast} to {forecast_with})")
    };
    let seconds = |seconds: f64| format!("{seconds:.1} s");
    format!(
        "Boards in {} plans, better in {}: median {}, nine in ten {}, without a right answer {}.",
        boards.plans,
        boards.better,
        change(&boards.median, &seconds),
        change(&boards.most, &seconds),
        change(&boards.without, &percent),
    )
}
