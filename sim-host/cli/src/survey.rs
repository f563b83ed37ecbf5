//! `sonarfix survey`: a map of walls from a recording.

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use anyhow::Context;
use sonarfix_batch::log;
use sonarfix_map::{MapFile, NamedWall, robot_file};
use sonarfix_report::Table;
use sonarfix_survey::comparison::{alignment, counterpart};
use sonarfix_survey::drawing::{draw, name};
use sonarfix_survey::map_text::map_text;
use sonarfix_survey::problem::Robot;
use sonarfix_survey::survey::{Survey, survey};
use sonarfix_survey::walls::MappedWall;

use sonarfix_terminal::output::check_file;

/// Accuracy from which on a wall should be driven along again, metres.
const POOR: f64 = 0.03;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The log (docs/formats.md) of a drive with a sweeping sonar.
    log: PathBuf,
    /// The robot; by default robot.toml beside the log.
    #[arg(long, value_name = "ROBOT.toml")]
    robot: Option<PathBuf>,
    /// The map file to write.
    #[arg(long, value_name = "MAP.toml")]
    out: Option<PathBuf>,
    /// The drawing of walls, path, echoes and residuals to write.
    #[arg(long, value_name = "FILE.svg")]
    drawing: Option<PathBuf>,
    /// Measured length of a wall of the map, for example "wall 3=6.00 m": the map is scaled to it.
    #[arg(long, value_name = "WALL=LENGTH")]
    measured: Option<String>,
    /// A map in the frame of the start pose, with which the walls are compared.
    #[arg(long, value_name = "MAP.toml")]
    compare: Option<PathBuf>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    for (option, file) in [("--out", &args.out), ("--drawing", &args.drawing)] {
        if let Some(file) = file {
            check_file(option, file)?;
        }
    }
    let measured = args.measured.as_deref().map(Measured::parse).transpose()?;
    let map = args.compare.as_deref().map(|file| MapFile::read(file, None)).transpose()?;
    let robot_path = args.robot.clone().unwrap_or_else(|| args.log.with_file_name("robot.toml"));
    let robot = robot_file::read(&robot_path)?;
    let file = File::open(&args.log).with_context(|| args.log.display().to_string())?;
    let read =
        log::read(BufReader::new(file), &robot).with_context(|| args.log.display().to_string())?;
    for (line, reason) in read.skipped.iter().take(10) {
        eprintln!("skipped: log line {line}: {reason}");
    }
    let nominal = log::nominal(&robot, !read.has_scans);
    let mut found = survey(&read.recording, Robot::of(&nominal))
        .with_context(|| args.log.display().to_string())?;
    if let Some(measured) = &measured {
        let estimated = measured.wall(&found)?.length();
        found.scale(measured.length / estimated);
    }
    if let Some(out) = &args.out {
        sonarfix_files::write(out, map_text(&found))?;
    }
    if let Some(out) = &args.drawing {
        sonarfix_files::write(out, draw(&found))?;
    }
    println!("{}", walls(&found).text());
    if let Some(map) = &map {
        println!("\n{}", comparison(&found, map).text());
    }
    println!("\n{}", verdict(&found));
    Ok(())
}

/// What `--measured` states.
struct Measured<'a> {
    name: &'a str,
    /// Metres.
    length: f64,
}

impl<'a> Measured<'a> {
    fn parse(text: &'a str) -> anyhow::Result<Self> {
        let form =
            "--measured must be a wall and its length with a unit, for example \"wall 3=6.00 m\"";
        let (name, length) = text.split_once('=').context(form)?;
        let length = length.trim();
        let units = [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];
        let (number, unit) = units
            .iter()
            .find_map(|(unit, scale)| length.strip_suffix(unit).map(|number| (number, scale)))
            .context(form)?;
        let length = number.trim().parse::<f64>().context(form)? * unit;
        let is_positive = length.is_finite() && length > 0.0;
        anyhow::ensure!(is_positive, "--measured: the length must be positive");
        Ok(Self { name: name.trim(), length })
    }

    /// The wall of the map.
    fn wall<'m>(&self, found: &'m Survey) -> anyhow::Result<&'m MappedWall> {
        let mut walls = found.walls.iter().enumerate();
        let wall = walls.find(|(index, _)| name(*index) == self.name).map(|(_, wall)| wall);
        let wall = wall.with_context(|| {
            format!(
                "--measured: the map has no \"{}\"; its walls are wall 1 to wall {}",
                self.name,
                found.walls.len()
            )
        })?;
        anyhow::ensure!(
            wall.corners == [true, true],
            "--measured: \"{}\" does not end in a corner at both ends, so that its length in the map is not that of the wall",
            self.name
        );
        Ok(wall)
    }
}

fn walls(found: &Survey) -> Table {
    let row = |(index, wall): (usize, &MappedWall)| {
        let end = |is_corner: bool| if is_corner { "corner" } else { "open" };
        let [from, to] = wall.corners;
        vec![
            name(index),
            format!("({:.2}, {:.2})", wall.from.x, wall.from.y),
            format!("({:.2}, {:.2})", wall.to.x, wall.to.y),
            format!("{:.2}", wall.length()),
            format!("{:.0}", 1e3 * wall.accuracy),
            wall.echoes.to_string(),
            format!("{}, {}", end(from), end(to)),
            if wall.is_confirmed { "" } else { "one direction only" }.to_owned(),
        ]
    };
    Table {
        title: "Walls".to_owned(),
        note: "metres in the frame of the start pose; accuracy: standard deviation of the distance, mm".to_owned(),
        columns: ["", "from", "to", "length", "accuracy", "echoes", "ends", ""]
            .map(str::to_owned)
            .to_vec(),
        rows: found.walls.iter().enumerate().map(row).collect(),
    }
}

/// Each wall of the survey beside that of a map, as it is and after the motion that fits best; the note counts those without one.
fn comparison(found: &Survey, map: &MapFile) -> Table {
    let named = map.floor.named_walls();
    let ends: Vec<_> = named.iter().map(|wall| [wall.from().into(), wall.to().into()]).collect();
    let motion = alignment(&found.walls, &ends);
    let moved = |wall: &MappedWall| MappedWall {
        from: motion.of(&wall.from),
        to: motion.of(&wall.to),
        ..*wall
    };
    let matches: Vec<_> = found.walls.iter().map(|wall| counterpart(wall, &ends)).collect();
    let is_found = |index: usize| matches.iter().flatten().any(|found| found.index == index);
    let row = |(index, wall): (usize, &MappedWall)| {
        let its = counterpart(wall, &ends);
        let wall_of_map = its.and_then(|its| named.get(its.index)).map_or("", NamedWall::name);
        let mut row = vec![name(index), wall_of_map.to_owned()];
        for its in [its, counterpart(&moved(wall), &ends)] {
            row.extend(its.map_or_else(<[String; 2]>::default, |its| {
                [format!("{:.1}", 1e3 * its.offset), format!("{:.2}", its.angle.to_degrees())]
            }));
        }
        row
    };
    Table {
        title: format!("Compared with {}", map.name()),
        note: format!(
            "{} of {} walls of the map are found, {} other walls; offset in mm, angle in degrees, both also after the \
             motion of the survey that fits best, {:+.0} mm, {:+.0} mm and {:+.2}°",
            (0..named.len()).filter(|&index| is_found(index)).count(),
            named.len(),
            matches.iter().filter(|found| found.is_none()).count(),
            1e3 * motion.shift.x,
            1e3 * motion.shift.y,
            motion.turn.to_degrees()
        ),
        columns: ["", "wall of the map", "offset", "angle", "offset moved", "angle moved"]
            .map(str::to_owned)
            .to_vec(),
        rows: found.walls.iter().enumerate().map(row).collect(),
    }
}

/// The verdict, and what to drive again.
fn verdict(found: &Survey) -> String {
    let (fitting, all) = found.explained;
    let [difference, track] = found.drive;
    let mut lines = vec![format!(
        "{:.1} m; {fitting} of {all} echoes fit a wall; paths forwards and backwards in time differ by at most {:.1} cm; \
         wheels differ by {:+.2} %, track width {:+.1} %",
        found.distance,
        100.0 * found.differs,
        100.0 * difference,
        100.0 * track
    )];
    if found.is_sure() {
        lines.push("The map is sure.".to_owned());
    } else {
        for reason in &found.reasons {
            lines.push(format!("UNSURE: {reason}."));
        }
        lines.push(
            "Do not use this map. Drive again: slower, closer to the walls, and along each wall."
                .to_owned(),
        );
    }
    if let Some((from, to)) = found.disputed {
        lines.push(format!("Drive again what was driven from {from:.0} s to {to:.0} s."));
    }
    let poor: Vec<String> = found
        .walls
        .iter()
        .enumerate()
        .filter(|(_, wall)| wall.accuracy > POOR || !wall.is_confirmed)
        .map(|(index, _)| name(index))
        .collect();
    if !poor.is_empty() {
        lines.push(format!("Drive along these walls again: {}.", poor.join(", ")));
    }
    lines.join("\n")
}
