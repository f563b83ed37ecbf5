//! `sonarfix map`: checks, bakes, draws and simplifies maps.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Subcommand;
use sonarfix::config::{Config, Sonar};
use sonarfix::map::Map;
use sonarfix::units::Metres;
use sonarfix_map::{Limits, MapFile, Robot, Severity, bake, simplify, survey};

use crate::report;

/// Findings are told one by one up to this many.
const TOLD: usize = 100;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    task: Task,
}

/// Where a map comes from.
#[derive(Debug, clap::Args)]
struct Source {
    /// A map or a scenario (.toml), segments (.csv), or a baked map (docs/formats.md).
    file: PathBuf,
    /// The unit of a CSV whose header names none: m, cm or mm.
    #[arg(long)]
    unit: Option<String>,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Tells what is wrong with a map, wall by wall.
    Check {
        #[command(flatten)]
        from: Source,
        /// The robot whose sonar is to see the walls; the scenario's, or a usual one, if not given.
        #[arg(long, value_name = "ROBOT.toml")]
        robot: Option<PathBuf>,
    },
    /// Writes the image that a robot reads in place from flash.
    Bake {
        #[command(flatten)]
        from: Source,
        /// The image to write.
        #[arg(long, value_name = "MAP.bin")]
        out: PathBuf,
    },
    /// Draws a map as SVG.
    Draw {
        #[command(flatten)]
        from: Source,
        /// The picture to write.
        #[arg(long, value_name = "MAP.svg")]
        out: PathBuf,
        /// Draws the cells of the baked map's index too.
        #[arg(long)]
        grid: bool,
    },
    /// Joins pieces of walls that are in line, and leaves out short ones.
    Simplify {
        #[command(flatten)]
        from: Source,
        /// The map to write: .csv, or else TOML.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// How far an end may be off the wall that it becomes part of, and how wide a gap is closed.
        #[arg(long, value_name = "MM", default_value_t = 1.0)]
        tolerance: f64,
        /// Walls shorter than this are left out, after pieces are joined.
        #[arg(long, value_name = "MM", default_value_t = 0.0)]
        shortest: f64,
    },
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    match &args.task {
        Task::Check { from, robot } => check(&from.read()?, robot.as_deref()),
        Task::Bake { from, out } => write_image(&from.read()?, out),
        Task::Draw { from, out, grid } => draw(&from.read()?, &from.title(), out, *grid),
        Task::Simplify { from, out, tolerance, shortest } => {
            for (name, value) in [("tolerance", tolerance), ("shortest", shortest)] {
                let is_length = value.is_finite() && *value >= 0.0;
                anyhow::ensure!(is_length, "--{name} must be zero or positive");
            }
            let limits = Limits { tolerance: tolerance / 1e3, shortest: shortest / 1e3 };
            write_simplified(&from.read()?, limits, out)
        }
    }
}

impl Source {
    fn read(&self) -> anyhow::Result<MapFile> {
        Ok(MapFile::read(&self.file, self.unit.as_deref())?)
    }

    /// What a picture of it is called.
    fn title(&self) -> String {
        self.file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
    }
}

fn check(map: &MapFile, robot: Option<&Path>) -> anyhow::Result<()> {
    let sonar = match robot {
        Some(robot) => Robot::read(robot)?.config.sonar,
        None => map.sonar.unwrap_or_else(usual_sonar),
    };
    let findings = survey(&map.floor, &sonar)?;
    for finding in findings.iter().take(TOLD) {
        let beside = match (finding.other(), finding.other().and_then(|other| map.line(other))) {
            (Some(other), Some(line)) => format!(" and {} (line {line})", map.quoted(other)),
            (Some(other), None) => format!(" and {}", map.quoted(other)),
            (None, _) => String::new(),
        };
        let severity = match finding.severity() {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        println!("{}{beside}: {severity}: {}", map.place(finding.wall), finding.flaw);
    }
    if findings.len() > TOLD {
        println!("and {} more", findings.len() - TOLD);
    }
    let errors = count(&findings, Severity::Error);
    let warnings = count(&findings, Severity::Warning);
    let walls = map.floor.named_walls().len();
    println!("{}: {walls} walls, {errors} errors, {warnings} warnings", map.name());
    anyhow::ensure!(errors == 0, "the map has errors");
    Ok(())
}

fn count(findings: &[sonarfix_map::Finding], severity: Severity) -> usize {
    findings.iter().filter(|finding| finding.severity() == severity).count()
}

fn usual_sonar() -> Sonar {
    Config::for_track_width(Metres(0.16)).sonar
}

fn write_image(map: &MapFile, out: &Path) -> anyhow::Result<()> {
    let findings = survey(&map.floor, &map.sonar.unwrap_or_else(usual_sonar))?;
    let errors = count(&findings, Severity::Error);
    let name = map.name();
    anyhow::ensure!(errors == 0, "{name}: {errors} errors, told by `sonarfix map check {name}`");
    let image = bake(&map.floor.walls())?;
    write(out, &image)?;
    let (walls, bytes) = (map.floor.named_walls().len(), image.len());
    if let Some(grid) = Map::read(&image)?.grid() {
        let (columns, rows, cell) = (grid.columns(), grid.rows(), grid.cell_size().0);
        let out = out.display();
        eprintln!("{out}: {walls} walls, {bytes} bytes, {columns} x {rows} cells of {cell} m");
    }
    Ok(())
}

fn draw(map: &MapFile, title: &str, out: &Path, with_grid: bool) -> anyhow::Result<()> {
    let walls = map.floor.named_walls().len();
    let title = format!("{title}: {walls} {}", if walls == 1 { "wall" } else { "walls" });
    let grid = if with_grid { Map::read(&bake(&map.floor.walls())?)?.grid() } else { None };
    write(out, report::map::svg(&title, &map.floor, grid).as_bytes())
}

fn write_simplified(map: &MapFile, limits: Limits, out: &Path) -> anyhow::Result<()> {
    let simplified = simplify(&map.floor, limits).context("nothing is left of the map")?;
    let is_csv = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    let floor = &simplified.floor;
    let text = if is_csv { floor.to_csv() } else { floor.to_toml() };
    write(out, text.as_bytes())?;
    let pieces =
        |walls: &[usize]| walls.iter().map(|&wall| map.quoted(wall)).collect::<Vec<_>>().join(", ");
    for joined in simplified.joined.iter().take(TOLD) {
        println!("joined: {}", pieces(joined));
    }
    for dropped in simplified.dropped.iter().take(TOLD) {
        println!("left out, too short: {}", pieces(dropped));
    }
    let told = simplified.joined.len().min(TOLD) + simplified.dropped.len().min(TOLD);
    let all = simplified.joined.len() + simplified.dropped.len();
    if all > told {
        println!("and {} more", all - told);
    }
    let (before, after) = (map.floor.named_walls().len(), floor.named_walls().len());
    println!("{}: {after} walls of {before}", out.display());
    Ok(())
}

fn write(out: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    fs::write(out, bytes).with_context(|| format!("cannot write {}", out.display()))
}
