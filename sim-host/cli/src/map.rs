//! `sonarfix map`: checks, bakes, draws, simplifies and converts maps.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Subcommand;
use sonarfix::config::{Config, RangerParameters};
use sonarfix::geometry::units::Metres;
use sonarfix::map::Map;
use sonarfix_map::{
    Limits, MapFile, Mistake, Severity, bake, flaws, plausibility, robot_file, simplify, symmetries,
};

use crate::map_exchange;
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
    /// Checks a map; prints the defects by wall.
    Check {
        #[command(flatten)]
        from: Source,
        /// The robot whose sonar measures the walls; by default the scenario's, or a typical one.
        #[arg(long, value_name = "ROBOT.toml")]
        robot: Option<PathBuf>,
    },
    /// Writes the map image, which a robot reads in place from flash.
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

fn check(map: &MapFile, robot: Option<&Path>) -> anyhow::Result<()> {
    let sonar = match robot {
        Some(robot) => robot_file::read(robot)?.localizer.rangers.first,
        None => map.sonar().unwrap_or_else(usual_sonar),
    };
    let findings = flaws(&map.floor, &sonar)?;
    for finding in findings.iter().take(SHOWN) {
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
    if findings.len() > SHOWN {
        println!("and {} more", findings.len() - SHOWN);
    }
    let is_new = |warning: &Mistake| {
        !findings.iter().any(|finding| warning.message().ends_with(&finding.flaw.to_string()))
    };
    let improbable = plausibility::of_file(Path::new(map.name())).into_iter().filter(is_new);
    let improbable: Vec<_> = improbable.collect();
    for warning in &improbable {
        println!("warning: {warning}");
    }
    let symmetries = symmetries(&map.floor)?;
    for symmetry in &symmetries {
        println!("{}: warning: {symmetry}", map.name());
    }
    if let Some(remedy) = symmetries.first().and_then(|symmetry| symmetry.remedy.as_ref()) {
        let (addition, [x, y], wall) = (remedy.addition, remedy.at, map.quoted(remedy.wall));
        println!(
            "    {addition} at ({x:.1}, {y:.1}) m on {wall}, mapped and not hidden by furniture, ends that"
        );
    }
    let errors = count(&findings, Severity::Error);
    let warnings = count(&findings, Severity::Warning) + improbable.len() + symmetries.len();
    let walls = map.floor.named_walls().len();
    println!("{}: {walls} walls, {errors} errors, {warnings} warnings", map.name());
    anyhow::ensure!(errors == 0, "the map has errors");
    Ok(())
}

fn count(findings: &[sonarfix_map::Finding], severity: Severity) -> usize {
    findings.iter().filter(|finding| finding.severity() == severity).count()
}

fn usual_sonar() -> RangerParameters {
    Config::for_track_width(Metres(0.16)).rangers.first
}

/// The image of a map.
///
/// # Errors
/// If the map has errors; they are not listed.
pub fn image(map: &MapFile) -> anyhow::Result<Vec<u8>> {
    let findings = flaws(&map.floor, &map.sonar().unwrap_or_else(usual_sonar))?;
    let errors = count(&findings, Severity::Error);
    let name = map.name();
    anyhow::ensure!(errors == 0, "{name}: {errors} errors; run `sonarfix map check {name}`");
    Ok(bake(&map.floor.walls())?)
}

fn write_image(map: &MapFile, out: &Path) -> anyhow::Result<()> {
    let image = image(map)?;
    sonarfix_files::write(out, &image)?;
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
    sonarfix_files::write(out, sonarfix_report::map::svg(&title, &map.floor, grid))
}

fn write_simplified(map: &MapFile, limits: Limits, out: &Path) -> anyhow::Result<()> {
    let simplified = simplify(&map.floor, limits).context("nothing is left of the map")?;
    let is_csv = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    let floor = &simplified.floor;
    let text = if is_csv { floor.to_csv() } else { floor.to_toml() };
    sonarfix_files::write(out, text)?;
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
    let (before, after) = (map.floor.named_walls().len(), floor.named_walls().len());
    println!("{}: {after} walls of {before}", out.display());
    Ok(())
}
