//! `sonarfix map`: checks, bakes, draws, simplifies and converts maps.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Subcommand;
use serde::Serialize;
use sonarfix::map::Map;
use sonarfix_map::{
    Finding, Limits, MapFile, Mistake, NamedWall, Severity, Symmetry, bake, flaws, plausibility,
    robot_file, simplify, symmetries,
};
use sonarfix_new_robot::flash;
use sonarfix_plan::anywhere::Anywhere;

use crate::map_exchange;
use crate::map_starts::{self, Forecast};
use crate::warnings::Warning;
use sonarfix_terminal::json;
use sonarfix_terminal::output::check_file;

/// Maximum number of findings that are printed.
const SHOWN: usize = 100;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    task: Task,
}

/// The source of a map.
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
    /// Checks a map; prints the defects by wall, and with --starts how well a robot finds its pose on it.
    Check {
        #[command(flatten)]
        from: Source,
        /// The robot whose sonar measures the walls; by default the scenario's, or a typical one.
        #[arg(long, value_name = "ROBOT.toml")]
        robot: Option<PathBuf>,
        #[command(flatten)]
        starts: map_starts::Args,
        /// Prints the findings as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Writes the map image, which a robot reads in place from flash.
    Bake {
        #[command(flatten)]
        from: Source,
        /// The image to write.
        #[arg(long, value_name = "MAP.bin")]
        out: PathBuf,
        /// Prints the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Draws a map as SVG.
    Draw {
        #[command(flatten)]
        from: Source,
        /// The drawing to write.
        #[arg(long, value_name = "MAP.svg")]
        out: PathBuf,
        /// Also draws the cells of the baked map's index.
        #[arg(long)]
        grid: bool,
    },
    /// Joins collinear pieces of walls and removes short ones.
    Simplify {
        #[command(flatten)]
        from: Source,
        /// The map to write: .csv, or else TOML.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Maximum distance of an end from the wall that it becomes part of, and maximum gap.
        #[arg(long, value_name = "MM", default_value_t = 1.0)]
        tolerance: f64,
        /// Minimum length of a wall, after pieces are joined.
        #[arg(long, value_name = "MM", default_value_t = 0.0)]
        shortest: f64,
        /// Prints the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Reads a grid, a drawing or `GeoJSON` of another program as a map; prints what was dropped and what is uncertain.
    Import(map_exchange::Import),
    /// Writes a map as a grid, SVG or `GeoJSON` for another program.
    Export {
        #[command(flatten)]
        from: Source,
        #[command(flatten)]
        to: map_exchange::Target,
    },
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let out = match &args.task {
        Task::Check { .. } => None,
        Task::Bake { out, .. } | Task::Draw { out, .. } | Task::Simplify { out, .. } => Some(out),
        Task::Import(import) => Some(&import.out),
        Task::Export { to, .. } => Some(&to.out),
    };
    if let Some(out) = out {
        check_file("--out", out)?;
    }
    match &args.task {
        Task::Check { from, robot, starts, json } => {
            starts.check()?;
            check(&from.read()?, robot.as_deref(), starts, *json)
        }
        Task::Bake { from, out, json } => write_image(&from.read()?, out, *json),
        Task::Draw { from, out, grid } => draw(&from.read()?, &from.title(), out, *grid),
        Task::Simplify { from, out, tolerance, shortest, json } => {
            for (name, value) in [("tolerance", tolerance), ("shortest", shortest)] {
                let is_length = value.is_finite() && *value >= 0.0;
                anyhow::ensure!(is_length, "--{name} must be zero or positive");
            }
            let limits = Limits { tolerance: tolerance / 1e3, shortest: shortest / 1e3 };
            write_simplified(&from.read()?, limits, out, *json)
        }
        Task::Import(import) => map_exchange::import(import),
        Task::Export { from, to } => map_exchange::export(&from.read()?.floor, to),
    }
}

impl Source {
    fn read(&self) -> anyhow::Result<MapFile> {
        Ok(MapFile::read(&self.file, self.unit.as_deref())?)
    }

    /// The title of a drawing of it.
    fn title(&self) -> String {
        self.file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
    }
}

/// What `check` finds.
struct Checked {
    findings: Vec<Finding>,
    improbable: Vec<Mistake>,
    symmetries: Vec<Symmetry>,
}

impl Checked {
    fn of(map: &MapFile, robot: Option<&Path>) -> anyhow::Result<Self> {
        let sonar = match robot {
            Some(robot) => robot_file::read(robot)?.localizer.rangers.first,
            None => map.sonar().unwrap_or_else(flash::usual_sonar),
        };
        let findings = flaws(&map.floor, &sonar)?;
        let is_new = |warning: &Mistake| {
            !findings.iter().any(|finding| warning.message().ends_with(&finding.flaw.to_string()))
        };
        let improbable = plausibility::of_file(Path::new(map.name()));
        let improbable = improbable.into_iter().filter(is_new).collect();
        Ok(Self { improbable, symmetries: symmetries(&map.floor)?, findings })
    }

    fn errors(&self) -> usize {
        count(&self.findings, Severity::Error)
    }

    fn warnings(&self) -> usize {
        count(&self.findings, Severity::Warning) + self.improbable.len() + self.symmetries.len()
    }

    fn print(&self, map: &MapFile) {
        for finding in self.findings.iter().take(SHOWN) {
            let beside = match (finding.other(), finding.other().and_then(|other| map.line(other)))
            {
                (Some(other), Some(line)) => format!(" and {} (line {line})", map.quoted(other)),
                (Some(other), None) => format!(" and {}", map.quoted(other)),
                (None, _) => String::new(),
            };
            let severity = severity(finding);
            println!("{}{beside}: {severity}: {}", map.place(finding.wall), finding.flaw);
        }
        if self.findings.len() > SHOWN {
            println!("and {} more", self.findings.len() - SHOWN);
        }
        for warning in &self.improbable {
            println!("warning: {warning}");
        }
        for symmetry in &self.symmetries {
            println!("{}: warning: {symmetry}", map.name());
        }
        if let Some(remedy) = self.remedy(map) {
            println!("    {remedy}");
        }
        let (walls, errors, warnings) =
            (map.floor.named_walls().len(), self.errors(), self.warnings());
        println!("{}: {walls} walls, {errors} errors, {warnings} warnings", map.name());
    }

    /// What ends the symmetries.
    fn remedy(&self, map: &MapFile) -> Option<String> {
        let remedy = self.symmetries.first()?.remedy.as_ref()?;
        let (addition, [x, y], wall) = (remedy.addition, remedy.at, map.quoted(remedy.wall));
        Some(format!(
            "{addition} at ({x:.1}, {y:.1}) m on {wall}, mapped and not hidden by furniture, ends that"
        ))
    }

    fn json<'a>(&self, map: &'a MapFile, forecast: Option<&'a Forecast>) -> JsonCheck<'a> {
        let wall = |index: usize| map.floor.named_walls().get(index).map_or("", NamedWall::name);
        let finding = |it: &Finding| JsonFinding {
            severity: severity(it),
            wall: wall(it.wall),
            line: map.line(it.wall),
            other: it.other().map(wall),
            message: it.flaw.to_string(),
        };
        JsonCheck {
            file: map.name(),
            walls: map.floor.named_walls().len(),
            errors: self.errors(),
            findings: self.findings.iter().map(finding).collect(),
            symmetries: self.symmetries.iter().map(ToString::to_string).collect(),
            remedy: self.remedy(map),
            warnings: self.improbable.iter().map(Warning::from).collect(),
            starts: forecast.map(|forecast| &forecast.anywhere),
        }
    }
}

/// What `check` finds, as JSON.
#[derive(Serialize)]
struct JsonCheck<'a> {
    file: &'a str,
    walls: usize,
    errors: usize,
    findings: Vec<JsonFinding<'a>>,
    symmetries: Vec<String>,
    /// What ends the symmetries.
    remedy: Option<String>,
    /// Improbable values.
    warnings: Vec<Warning>,
    /// With `--starts`, what starts anywhere lead to.
    #[serde(skip_serializing_if = "Option::is_none")]
    starts: Option<&'a Anywhere>,
}

#[derive(Serialize)]
struct JsonFinding<'a> {
    severity: &'static str,
    wall: &'a str,
    line: Option<usize>,
    /// The other wall of two.
    other: Option<&'a str>,
    message: String,
}

fn severity(finding: &Finding) -> &'static str {
    match finding.severity() {
        Severity::Error => "error",
        Severity::Warning => "warning",
    }
}

fn check(
    map: &MapFile,
    robot: Option<&Path>,
    starts: &map_starts::Args,
    is_json: bool,
) -> anyhow::Result<()> {
    let checked = Checked::of(map, robot)?;
    if !is_json {
        checked.print(map);
    }
    let is_usable = checked.errors() == 0;
    let forecast = if is_usable { starts.forecast(map, robot)? } else { None };
    if is_json {
        json::print(&checked.json(map, forecast.as_ref()))?;
    } else if let Some(forecast) = &forecast {
        forecast.print(map);
    }
    anyhow::ensure!(is_usable, "the map has errors");
    Ok(())
}

fn count(findings: &[Finding], severity: Severity) -> usize {
    findings.iter().filter(|finding| finding.severity() == severity).count()
}

/// A baked map, as JSON.
#[derive(Serialize)]
struct JsonImage<'a> {
    out: &'a Path,
    walls: usize,
    bytes: usize,
    /// That which a robot reports.
    checksum: String,
    grid: Option<JsonGrid>,
}

/// The index of a baked map.
#[derive(Serialize)]
struct JsonGrid {
    columns: u16,
    rows: u16,
    cell_size: f32,
}

fn write_image(map: &MapFile, out: &Path, is_json: bool) -> anyhow::Result<()> {
    let image = flash::image(map)?;
    sonarfix_files::write(out, &image)?;
    let (walls, bytes) = (map.floor.named_walls().len(), image.len());
    let grid = Map::read(&image)?.grid().map(|grid| JsonGrid {
        columns: grid.columns(),
        rows: grid.rows(),
        cell_size: grid.cell_size().0,
    });
    if is_json {
        let checksum = format!("{:08x}", flash::seal(&image));
        return json::print(&JsonImage { out, walls, bytes, checksum, grid });
    }
    if let Some(JsonGrid { columns, rows, cell_size }) = grid {
        let out = out.display();
        eprintln!("{out}: {walls} walls, {bytes} bytes, {columns} x {rows} cells of {cell_size} m");
    }
    Ok(())
}

fn draw(map: &MapFile, title: &str, out: &Path, with_grid: bool) -> anyhow::Result<()> {
    let walls = map.floor.named_walls().len();
    let title = format!("{title}: {walls} {}", if walls == 1 { "wall" } else { "walls" });
    let grid = if with_grid { Map::read(&bake(&map.floor.walls())?)?.grid() } else { None };
    sonarfix_files::write(out, sonarfix_report::map::svg(&title, &map.floor, grid))
}

/// A simplified map, as JSON.
#[derive(Serialize)]
struct JsonSimplified<'a> {
    out: &'a Path,
    walls: usize,
    walls_before: usize,
    /// The pieces of each wall that was joined.
    joined: Vec<Vec<&'a str>>,
    /// What was left out, too short.
    dropped: Vec<Vec<&'a str>>,
}

fn write_simplified(
    map: &MapFile,
    limits: Limits,
    out: &Path,
    is_json: bool,
) -> anyhow::Result<()> {
    let simplified = simplify(&map.floor, limits).context("nothing is left of the map")?;
    let is_csv = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    let floor = &simplified.floor;
    let text = if is_csv { floor.to_csv() } else { floor.to_toml() };
    sonarfix_files::write(out, text)?;
    let (before, after) = (map.floor.named_walls().len(), floor.named_walls().len());
    if is_json {
        let name = |&wall: &usize| map.floor.named_walls().get(wall).map_or("", NamedWall::name);
        let names = |groups: &[Vec<usize>]| {
            groups.iter().map(|walls| walls.iter().map(name).collect()).collect()
        };
        return json::print(&JsonSimplified {
            out,
            walls: after,
            walls_before: before,
            joined: names(&simplified.joined),
            dropped: names(&simplified.dropped),
        });
    }
    let pieces =
        |walls: &[usize]| walls.iter().map(|&wall| map.quoted(wall)).collect::<Vec<_>>().join(", ");
    for joined in simplified.joined.iter().take(SHOWN) {
        println!("joined: {}", pieces(joined));
    }
    for dropped in simplified.dropped.iter().take(SHOWN) {
        println!("left out, too short: {}", pieces(dropped));
    }
    let reported = simplified.joined.len().min(SHOWN) + simplified.dropped.len().min(SHOWN);
    let all = simplified.joined.len() + simplified.dropped.len();
    if all > reported {
        println!("and {} more", all - reported);
    }
    println!("{}: {after} walls of {before}", out.display());
    Ok(())
}
