//! `sonarfix map import` and `map export`: maps from and for other programs.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use serde::Serialize;
use sonarfix_drawings::geojson::Anchor;
use sonarfix_drawings::{
    Frame, Imported, MAX_JSON_BYTES, MAX_TEXT_BYTES, SHORTEST_OF_PLAN, dxf, geojson, grid, plan,
    scan, svg, unit,
};
use sonarfix_map::Floor;
use sonarfix_terminal::json;
use sonarfix_terminal::output::check_file;

#[derive(Debug, clap::Args)]
pub struct Import {
    /// A grid of ROS's `map_server` (.yaml), a drawing (.dxf, .svg), `GeoJSON` (.geojson, .json) or a scanned plan (.png, .pgm).
    file: PathBuf,
    /// The map to write: .csv, or else TOML.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// The length of one unit of the drawing, or of a pixel of a scanned plan: m, cm, mm, in, ft, or metres as a number. By default
    /// that of the file.
    #[arg(long, value_parser = unit)]
    unit: Option<f64>,
    /// The place of the drawing's origin in the map, metres.
    #[arg(long, value_name = "X,Y", value_parser = pair, default_value = "0,0", allow_hyphen_values = true)]
    origin: [f64; 2],
    /// The place of the map's origin in `GeoJSON` with degrees.
    #[arg(long, value_name = "LON,LAT", value_parser = pair, allow_hyphen_values = true)]
    anchor: Option<[f64; 2]>,
    /// Reads only this layer of a DXF; may be repeated.
    #[arg(long, value_name = "NAME")]
    layer: Vec<String>,
    /// The shortest wall that is read from a grid or an image, metres: by default 0.1, of a plan 0.25.
    #[arg(long, value_name = "M")]
    shortest: Option<f64>,
    /// The drawing is a floor plan: double lines, thick lines and copies become one wall each; text and furniture are left out.
    /// Always so for a .png or .pgm.
    #[arg(long)]
    plan: bool,
    /// Draws what was found in a plan, before and after.
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
    /// Prints the result as JSON.
    #[arg(long)]
    json: bool,
}

impl Import {
    fn is_image(&self) -> bool {
        matches!(ending(&self.file).as_str(), "png" | "pgm")
    }

    fn is_plan(&self) -> bool {
        self.plan || self.is_image()
    }
}

#[derive(Debug, clap::Args)]
pub struct Target {
    /// The file to write: a grid of ROS's `map_server` (.yaml, and a .pgm beside it), .svg, or .geojson.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// The size of a pixel of a grid, metres.
    #[arg(long, value_name = "M", default_value_t = 0.02)]
    resolution: f64,
    /// The place of the map's origin in `GeoJSON`: writes degrees instead of metres.
    #[arg(long, value_name = "LON,LAT", value_parser = pair, allow_hyphen_values = true)]
    anchor: Option<[f64; 2]>,
}

fn pair(text: &str) -> Result<[f64; 2], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let numbers = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
    let numbers = numbers.and_then(|numbers| <[f64; 2]>::try_from(numbers).ok());
    numbers.ok_or_else(|| "two numbers with a comma between them are expected".to_owned())
}

fn anchor(pair: Option<[f64; 2]>) -> anyhow::Result<Option<Anchor>> {
    let Some([longitude, latitude]) = pair else { return Ok(None) };
    // Nearer to a pole, a degree of longitude is too short to be a coordinate.
    let is_usable = longitude.abs() <= 180.0 && latitude.abs() <= 89.0;
    ensure!(is_usable, "--anchor: a longitude within ±180 and a latitude within ±89 are expected");
    Ok(Some(Anchor { longitude, latitude }))
}

fn ending(file: &Path) -> String {
    let ending = file.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    ending.unwrap_or_default()
}

pub fn import(args: &Import) -> anyhow::Result<()> {
    ensure!(args.picture.is_none() || args.is_plan(), "--picture shows a floor plan: add --plan");
    if let Some(picture) = &args.picture {
        check_file("--picture", picture)?;
    }
    let mut imported = read(args).with_context(|| args.file.display().to_string())?;
    if args.is_plan() {
        let (of_plan, found) =
            plan::of(imported).with_context(|| args.file.display().to_string())?;
        imported = of_plan;
        if let Some(picture) = &args.picture {
            sonarfix_files::write(picture, found.picture())?;
        }
    } else if let Some(walls) = plan::fewer(&imported) {
        imported.notes.push(format!(
            "hint: as a floor plan (--plan) it has {walls} walls, because of double lines, copies or furniture"
        ));
    }
    for note in imported.notes.iter().filter(|_| !args.json) {
        println!("{note}");
    }
    let floor = &imported.floor;
    let text = match (ending(&args.out) == "csv", imported.offset) {
        (true, None) => floor.to_csv(),
        (true, Some([x, y])) => bail!(
            "--out: a CSV cannot keep the offset of {x}, {y} m: write TOML, or pass --origin={},{}",
            -x,
            -y
        ),
        (false, None) => floor.to_toml(),
        (false, Some([x, y])) => {
            format!(
                "# Moved: add ({x}, {y}) m for the coordinates of the drawing.\n{}",
                floor.to_toml()
            )
        }
    };
    sonarfix_files::write(&args.out, text)?;
    let walls = floor.named_walls().len();
    if args.json {
        let Imported { notes, offset, .. } = &imported;
        return json::print(&Json { out: &args.out, walls, offset: *offset, notes });
    }
    println!("{}: {walls} walls", args.out.display());
    Ok(())
}

/// What was imported, as JSON.
#[derive(Debug, Serialize)]
struct Json<'a> {
    out: &'a Path,
    walls: usize,
    /// What must be added to the map's coordinates for those of the drawing, metres.
    offset: Option<[f64; 2]>,
    notes: &'a [String],
}

fn read(args: &Import) -> anyhow::Result<Imported> {
    let frame = Frame { unit: args.unit, origin: args.origin };
    let shortest = args.shortest.unwrap_or(if args.is_plan() { SHORTEST_OF_PLAN } else { 0.1 });
    let is_length = shortest.is_finite() && shortest >= 0.0;
    ensure!(is_length, "--shortest must be zero or positive");
    let ending = ending(&args.file);
    let is_json = matches!(ending.as_str(), "geojson" | "json");
    ensure!(args.anchor.is_none() || is_json, "--anchor is for GeoJSON");
    ensure!(args.layer.is_empty() || ending == "dxf", "--layer is for DXF");
    match ending.as_str() {
        "yaml" | "yml" if !args.plan => grid::read(&args.file, &frame, shortest),
        "yaml" | "yml" | "png" | "pgm" => scan::read(&args.file, &frame, shortest),
        "dxf" => dxf::read(BufReader::new(File::open(&args.file)?), &frame, &args.layer),
        "svg" => svg::read(&text(&args.file, MAX_TEXT_BYTES)?, &frame),
        _ if is_json => {
            geojson::read(&text(&args.file, MAX_JSON_BYTES)?, &frame, anchor(args.anchor)?)
        }
        other => {
            bail!("unknown ending `{other}`: expected yaml, png, pgm, dxf, svg, geojson or json")
        }
    }
}

/// The text of a file that is read at once.
fn text(file: &Path, most: u64) -> anyhow::Result<String> {
    let bytes = File::open(file)?.metadata()?.len();
    let mebibytes = most / (1024 * 1024);
    ensure!(bytes <= most, "it has more than {mebibytes} MiB: remove what is no wall, or split it");
    Ok(sonarfix_map::read_text(file)?)
}

pub fn export(floor: &Floor, args: &Target) -> anyhow::Result<()> {
    let ending = ending(&args.out);
    ensure!(args.anchor.is_none() || ending == "geojson", "--anchor is for GeoJSON");
    let is_size = args.resolution.is_finite() && args.resolution >= 1e-3;
    ensure!(is_size, "--resolution must be at least 0.001");
    let text = match ending.as_str() {
        "yaml" => return write_grid(floor, args),
        "svg" => svg::write(floor),
        "geojson" => geojson::write(floor, anchor(args.anchor)?),
        other => bail!("--out: unknown ending `{other}`: expected yaml, svg or geojson"),
    };
    sonarfix_files::write(&args.out, text)
}

fn write_grid(floor: &Floor, args: &Target) -> anyhow::Result<()> {
    let image = args.out.with_extension("pgm");
    let name = image.file_name().and_then(|name| name.to_str()).context("the name is no text")?;
    let (yaml, pgm) = grid::write(floor, name, args.resolution)?;
    sonarfix_files::write(&image, pgm)?;
    sonarfix_files::write(&args.out, yaml)
}
