//! `sonarfix find`: searches for the pose of a robot without a start pose.

use std::io::BufReader;
use std::path::PathBuf;

use sonarfix_map::{MapFile, robot_file};
use sonarfix_replay::find::{Find, Found};
use sonarfix_report::Table;
use sonarfix_terminal::output::open;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A log (docs/formats.md).
    log: PathBuf,
    /// The map; by default map.toml beside the log.
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// The robot; by default robot.toml beside the log.
    #[arg(long, value_name = "ROBOT.toml")]
    config: Option<PathBuf>,
    /// Prints JSON instead of a table.
    #[arg(long)]
    json: bool,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let beside = |given: &Option<PathBuf>, name: &str| {
        given.clone().unwrap_or_else(|| args.log.with_file_name(name))
    };
    let map = beside(&args.map, "map.toml");
    let config = beside(&args.config, "robot.toml");
    let floor = MapFile::read(&map, None)?.floor;
    let robot = robot_file::read(&config)?;
    crate::warnings::show(&[&map, &config]);
    let walls = floor.walls();
    let file = open(&args.log)?;
    let found = Find { robot: &robot, walls: &walls }.run(BufReader::new(file))?;
    if args.json {
        return sonarfix_terminal::json::print(&found);
    }
    println!("{}", found_table(&found).text());
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
