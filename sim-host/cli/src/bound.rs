//! `sonarfix bound`: the posterior Cramér–Rao bound of a run over time.

use std::path::PathBuf;

use sonarfix_map::Scenario;
use sonarfix_report::Table;
use sonarfix_sim::bound::Noise;
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

type States = std::collections::BTreeMap<&'static str, f64>;

/// The bound at one instant, SI units.
#[derive(Debug, serde::Serialize)]
struct Row {
    time: f64,
    #[serde(flatten)]
    states: States,
    /// The bound with the noise that the filter assumes, where that is another one.
    #[serde(skip_serializing_if = "Option::is_none")]
    with_filter_noise: Option<States>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let scenario = Scenario::read(&args.scenario)?;
    crate::warnings::show(&[&args.scenario]);
    let seed = args.seed.unwrap_or(scenario.run.seed);
    let every = args.every.unwrap_or(scenario.path.duration() / 24.0);
    anyhow::ensure!(every > 0.0, "--every must be positive");
    let simulation = Simulation::new(scenario);
    let [simulated, assumed] = [simulation.true_noise(), simulation.assumed_noise()];
    let ticks = |simulation: &Simulation| -> anyhow::Result<Vec<Tick>> {
        let mut trace = simulation.empty_trace();
        simulation.run(seed, &mut trace)?;
        Ok(spaced(&trace.ticks, every).copied().collect())
    };
    let bound = ticks(&simulation)?;
    // A run does not depend on its bound: these are the same measurements.
    let of_filter = (!simulated.is_close_to(&assumed))
        .then(|| ticks(&simulation.clone().bound_of_filter()))
        .transpose()?;
    if args.json {
        let of_filter = of_filter.iter().flatten().map(states).chain(std::iter::repeat(None));
        let rows = bound.iter().zip(of_filter).filter_map(|(tick, with_filter_noise)| {
            Some(Row { time: tick.time, states: states(tick)?, with_filter_noise })
        });
        return sonarfix_terminal::json::print(&rows.collect::<Vec<_>>());
    }
    let name = &simulation.scenario.name;
    let of = format!("for the measurements of the run with seed {seed}");
    let title = format!("Bound on the standard deviation of each state ({name})");
    let noise = text(&simulated);
    println!("{}", table(title, format!("{of}; noise of the simulation: {noise}"), &bound).text());
    if let Some(of_filter) = of_filter {
        let title = format!("The same with the noise that the filter assumes ({name})");
        let noise = text(&assumed);
        println!("{}", table(title, format!("{of}; {noise}"), &of_filter).text());
    }
    Ok(())
}

fn table(title: String, note: String, ticks: &[Tick]) -> Table {
    let columns = [
        "t (s)",
        "X (mm)",
        "Y (mm)",
        "heading (deg)",
        "S_R",
        "S_L",
        "track width (mm)",
        "range scale",
    ];
    let columns = columns.map(str::to_owned).to_vec();
    Table { title, note, columns, rows: ticks.iter().filter_map(cells).collect() }
}

/// A noise in words.
fn text(noise: &Noise) -> String {
    let Noise { wheel_noise, scale_walk, track_width_walk, .. } = noise;
    let pointing = noise
        .pointing
        .map_or_else(String::new, |pointing| format!(", beam {:.3} deg", pointing.to_degrees()));
    format!(
        "wheels {:.3} mm/sqrt(m), their scale {scale_walk:.1e} /sqrt(m), track width {:.4} mm/sqrt(m), \
         range {:.3} mm and {:.3} mm/m{pointing}",
        wheel_noise * 1e3,
        track_width_walk * 1e3,
        noise.range_noise * 1e3,
        noise.range_noise_per_metre * 1e3,
    )
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

fn states(tick: &Tick) -> Option<States> {
    Some(sonarfix_sim::STATES.into_iter().zip(tick.bound?).collect())
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
