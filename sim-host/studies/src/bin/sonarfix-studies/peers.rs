//! `sonarfix-studies peers`: the localizer and the search beside a particle filter.

use std::path::PathBuf;

use anyhow::Context;
use sonarfix_map::Scenario;
use sonarfix_studies::floor_plan::Kind;
use sonarfix_studies::peers::page::{Page, Searched};
use sonarfix_studies::peers::{self, Row};
use sonarfix_studies::rooms::{Cell, Family, Objects, Robot, Sensor};
use sonarfix_studies::search_study::Plans;
use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A folder with recordings, too, as for `reality` and `recordings`.
    data: Option<PathBuf>,
    /// A scenario whose runs are compared.
    #[arg(long, default_value = "crates/sonarfix-map/scenarios/classroom.toml")]
    scenario: PathBuf,
    /// Runs of the scenario, and of each kind of room.
    #[arg(long, default_value_t = 10)]
    runs: u32,
    /// Floor plans and homes in which a start is searched, each.
    #[arg(long, default_value_t = 50)]
    trials: u32,
    /// Longest duration of a search, seconds.
    #[arg(long, default_value_t = 120.0)]
    seconds: f64,
    /// Seed of the first run and trial; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Prints JSON instead of the page.
    #[arg(long)]
    json: bool,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0 && args.trials > 0, "--runs and --trials must be at least 1");
    let rooms = Family::ALL.iter().flat_map(|family| {
        [Objects::Nothing, Objects::Clutter].map(|objects| Cell {
            family: *family,
            objects,
            sensor: Sensor::HcSr04,
            robot: Robot::NOMINAL,
        })
    });
    let rooms: Vec<Cell> = rooms.collect();
    let kinds = u32::try_from(rooms.len())? + 1;
    let progress = Runs::new(args.runs.saturating_mul(kinds).saturating_add(2 * args.trials));
    let seeds = (args.seed, args.runs);
    let scenario = Scenario::read(&args.scenario)?;
    let name = args.scenario.file_stem().unwrap_or_default().display().to_string();
    let mut known: Vec<Row> =
        vec![peers::scenario(&name, |_| Ok(scenario.clone()), seeds, &progress)?];
    for cell in &rooms {
        known.push(peers::rooms(cell, seeds, &progress)?);
    }
    let searched = [("all kinds", None), ("homes", Some(Kind::Home))].map(|(name, kind)| {
        let plans =
            Plans { first: args.seed, trials: args.trials, kind, walls: None, mistake: None };
        Ok::<_, peers::PeerError>(Searched {
            name,
            found: peers::search(&plans, args.seconds, &progress)?,
        })
    });
    let searched = searched.into_iter().collect::<Result<Vec<_>, _>>()?;
    progress.end()?;
    let recordings = match &args.data {
        Some(data) => peers::of_recordings(data)
            .with_context(|| format!("cannot read the recordings in {}", data.display()))?,
        None => Vec::new(),
    };
    let page = Page { known, recordings, searched };
    if args.json {
        return sonarfix_terminal::json::print(&page);
    }
    print!("{}", page.markdown());
    Ok(())
}
