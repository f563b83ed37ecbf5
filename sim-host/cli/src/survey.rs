//! `sonarfix survey`: a map of walls from a recording.

use std::io::BufReader;
use std::path::PathBuf;

use anyhow::Context;
use serde::Serialize;
use sonarfix_batch::log;
use sonarfix_map::{MapFile, robot_file};
use sonarfix_report::Table;
use sonarfix_survey::comparison::{alignment, counterpart};
use sonarfix_survey::drawing::{draw, name};
use sonarfix_survey::map_text::map_text;
use sonarfix_survey::problem::Robot;
use sonarfix_survey::survey::{Survey, survey};
use sonarfix_survey::walls::MappedWall;

use sonarfix_terminal::output::{check_file, open};

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
    /// Prints the survey as JSON.
    #[arg(long)]
    json: bool,
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
    let file = open(&args.log)?;
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
    let compared = map.as_ref().map(|map| comparison(&found, map));
    if args.json {
        return sonarfix_terminal::json::print(&Json::of(&found, compared));
    }
    println!("{}", walls(&found).text());
    if let (Some(map), Some(compared)) = (&map, &compared) {
        println!("\n{}", comparison_table(compared, map).text());
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

/// A wall of the survey beside that of a map.
#[derive(Debug, Serialize)]
struct Beside {
    name: String,
    /// The wall of the map; `None` if it has none there.
    wall_of_map: Option<String>,
    /// As it is.
    offset: Option<f64>,
    angle: Option<f64>,
    /// After the motion that fits best.
    offset_moved: Option<f64>,
    angle_moved: Option<f64>,
}

/// The walls of the survey beside those of a map.
#[derive(Debug, Serialize)]
struct Comparison {
    walls: Vec<Beside>,
    /// Walls of the map, and those that the survey has.
    walls_of_map: usize,
    found: usize,
    /// The motion of the survey that fits best: metres, radians.
    shift: [f64; 2],
    turn: f64,
}

/// Each wall of the survey beside that of a map, as it is and after the motion that fits best.
fn comparison(found: &Survey, map: &MapFile) -> Comparison {
    let named = map.floor.named_walls();
    let ends: Vec<_> = named.iter().map(|wall| [wall.from().into(), wall.to().into()]).collect();
    let motion = alignment(&found.walls, &ends);
    let moved = |wall: &MappedWall| MappedWall {
        from: motion.of(&wall.from),
        to: motion.of(&wall.to),
        ..*wall
    };
    let beside = |(index, wall): (usize, &MappedWall)| {
        let (its, moved) = (counterpart(wall, &ends), counterpart(&moved(wall), &ends));
        Beside {
            name: name(index),
            wall_of_map: its.and_then(|its| named.get(its.index)).map(|it| it.name().to_owned()),
            offset: its.map(|its| its.offset),
            angle: its.map(|its| its.angle),
            offset_moved: moved.map(|its| its.offset),
            angle_moved: moved.map(|its| its.angle),
        }
    };
    let matches: Vec<_> = found.walls.iter().map(|wall| counterpart(wall, &ends)).collect();
    let is_found = |index: usize| matches.iter().flatten().any(|found| found.index == index);
    Comparison {
        walls: found.walls.iter().enumerate().map(beside).collect(),
        walls_of_map: named.len(),
        found: (0..named.len()).filter(|&index| is_found(index)).count(),
        shift: [motion.shift.x, motion.shift.y],
        turn: motion.turn,
    }
}

/// The comparison as a table; the note counts the walls without a counterpart.
fn comparison_table(compared: &Comparison, map: &MapFile) -> Table {
    let Comparison { walls, walls_of_map, found, shift, turn } = compared;
    let millimetres =
        |value: Option<f64>| value.map_or(String::new(), |it| format!("{:.1}", 1e3 * it));
    let degrees =
        |value: Option<f64>| value.map_or(String::new(), |it| format!("{:.2}", it.to_degrees()));
    let row = |it: &Beside| {
        vec![
            it.name.clone(),
            it.wall_of_map.clone().unwrap_or_default(),
            millimetres(it.offset),
            degrees(it.angle),
            millimetres(it.offset_moved),
            degrees(it.angle_moved),
        ]
    };
    Table {
        title: format!("Compared with {}", map.name()),
        note: format!(
            "{found} of {walls_of_map} walls of the map are found, {} other walls; offset in mm, angle in degrees, both \
             also after the motion of the survey that fits best, {:+.0} mm, {:+.0} mm and {:+.2}°",
            walls.iter().filter(|it| it.offset.is_none()).count(),
            1e3 * shift[0],
            1e3 * shift[1],
            turn.to_degrees()
        ),
        columns: ["", "wall of the map", "offset", "angle", "offset moved", "angle moved"]
            .map(str::to_owned)
            .to_vec(),
        rows: walls.iter().map(row).collect(),
    }
}

/// The survey as JSON.
#[derive(Debug, Serialize)]
struct Json {
    walls: Vec<JsonWall>,
    sure: bool,
    /// Why it is not.
    reasons: Vec<String>,
    /// Echoes that fit a wall, and all.
    echoes_explained: usize,
    echoes: usize,
    distance: f64,
    /// Largest distance between the paths forwards and backwards in time.
    differs: f64,
    /// From and to, where the paths differ.
    disputed: Option<[f64; 2]>,
    /// Relative.
    wheel_difference: f64,
    track_width_error: f64,
    drive_again: Vec<String>,
    compared: Option<Comparison>,
}

/// A wall of the survey.
#[derive(Debug, Serialize)]
struct JsonWall {
    name: String,
    from: [f64; 2],
    to: [f64; 2],
    accuracy: f64,
    echoes: usize,
    /// Whether both ends are corners with other walls.
    corners: [bool; 2],
    confirmed: bool,
}

impl Json {
    fn of(found: &Survey, compared: Option<Comparison>) -> Self {
        let wall = |(index, wall): (usize, &MappedWall)| JsonWall {
            name: name(index),
            from: wall.from.into(),
            to: wall.to.into(),
            accuracy: wall.accuracy,
            echoes: wall.echoes,
            corners: wall.corners,
            confirmed: wall.is_confirmed,
        };
        let [wheel_difference, track_width_error] = found.drive;
        Self {
            walls: found.walls.iter().enumerate().map(wall).collect(),
            sure: found.is_sure(),
            reasons: found.reasons.iter().map(ToString::to_string).collect(),
            echoes_explained: found.explained.0,
            echoes: found.explained.1,
            distance: found.distance,
            differs: found.differs,
            disputed: found.disputed.map(Into::into),
            wheel_difference,
            track_width_error,
            drive_again: poor(found),
            compared,
        }
    }
}

/// The walls along which should be driven again.
fn poor(found: &Survey) -> Vec<String> {
    let walls = found.walls.iter().enumerate();
    let poor = walls.filter(|(_, wall)| wall.accuracy > POOR || !wall.is_confirmed);
    poor.map(|(index, _)| name(index)).collect()
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
    let poor = poor(found);
    if !poor.is_empty() {
        lines.push(format!("Drive along these walls again: {}.", poor.join(", ")));
    }
    lines.join("\n")
}
