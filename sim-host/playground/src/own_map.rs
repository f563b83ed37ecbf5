//! A map from a file of one's own: an image, a drawing, a CSV, a map in TOML. The importers are those of `sonarfix map import`.

use std::path::Path;

use anyhow::{Context, bail, ensure};
use serde::{Deserialize, Serialize};
use sonarfix_drawings::{Frame, Imported, SHORTEST_OF_PLAN, dxf, plan, scan, svg};
use sonarfix_map::{Floor, MapFile, NamedWall};

use crate::request::Request;

/// Most walls: a longer map does not fit into the address of the page.
const MOST_WALLS: usize = 500;
/// The distance that the path keeps from the walls, metres.
const CLEARANCE: f64 = 0.5;
/// Places along each axis that are tried as the middle of the path.
const PLACES: u8 = 24;
/// The sides of the path that are tried, metres. In the middle of a larger one most sonars reach no wall.
const SIDES: [f64; 7] = [6.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.5];

/// How a file is read.
#[derive(Debug, Deserialize)]
struct Options {
    /// The name of the file.
    name: String,
    /// The length of a unit of the drawing; empty for that of the file.
    unit: String,
    /// Whether it is a floor plan, with double lines, text and furniture.
    is_plan: bool,
}

/// A map and a path in it, with the keys of a scenario.
#[derive(Debug, Serialize)]
struct OwnMap {
    map: toml::Table,
    path: Loop,
    /// What was read and what was dropped.
    notes: Vec<String>,
}

/// A closed path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Loop {
    start: [f64; 2],
    corners: [[f64; 2]; 4],
}

/// Answers with the map in a file, `{"map": …, "path": …, "notes": …}`, or `{"error": "…"}`. `request` says how it is read.
#[must_use]
pub fn answer(request: &str, file: Vec<u8>) -> String {
    let read = || Ok(serde_json::to_string(&read(&serde_json::from_str(request)?, file)?)?);
    // The fields of the page stand for the options of the command.
    read().unwrap_or_else(|error: anyhow::Error| {
        let text = format!("{error:#}").replace("--unit", "\"Unit of the drawing\"");
        serde_json::json!({ "error": text }).to_string()
    })
}

/// Answers with the map of a request as a map file, `{"text": "…"}`, or `{"error": "…"}`.
#[must_use]
pub fn file(request: &str) -> String {
    let text = || {
        let request: Request = serde_json::from_str(request)?;
        let map = request.scenario.get("map").context("the scenario has no map")?;
        let table = toml::Table::from_iter([
            ("format".to_owned(), 1.into()),
            ("map".to_owned(), map.clone()),
        ]);
        anyhow::Ok(Floor::parse(&table.to_string(), "map.toml")?.to_toml())
    };
    let answer = match text() {
        Ok(text) => serde_json::json!({ "text": text }),
        Err(error) => serde_json::json!({ "error": format!("{error:#}") }),
    };
    answer.to_string()
}

fn read(options: &Options, file: Vec<u8>) -> anyhow::Result<OwnMap> {
    let (floor, notes) = floor(options, file)?;
    let walls = floor.named_walls();
    ensure!(
        walls.len() <= MOST_WALLS,
        "it has {} walls, the page takes {MOST_WALLS}: tick \"The drawing is a floor plan\", remove what is no wall, or use `sonarfix map \
         import`",
        walls.len()
    );
    let path = path(walls).with_context(|| {
        let [[left, right], [bottom, top]] = extent(walls);
        format!(
            "in the {} walls of {:.2} m × {:.2} m a robot has no room between walls on all sides: is the unit right, and is a room closed?",
            walls.len(),
            right - left,
            top - bottom
        )
    })?;
    let table: toml::Table = floor.to_toml().parse()?;
    let map = table.get("map").and_then(toml::Value::as_table).cloned().unwrap_or_default();
    Ok(OwnMap { map, path, notes })
}

/// The walls in a file, and notes.
fn floor(options: &Options, file: Vec<u8>) -> anyhow::Result<(Floor, Vec<String>)> {
    let Options { name, unit, is_plan } = options;
    let unit = unit.trim();
    let metres = match unit {
        "" => None,
        unit => Some(
            sonarfix_drawings::unit(unit)
                .map_err(|error| anyhow::anyhow!("\"Unit of the drawing\" is `{unit}`: {error}"))?,
        ),
    };
    let frame = Frame { unit: metres, origin: [0.0; 2] };
    let ending = Path::new(name).extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let imported = match ending.as_str() {
        "csv" | "toml" => {
            let unit = (!unit.is_empty()).then_some(unit);
            return Ok((MapFile::parse(file, Path::new(name), unit)?.floor, Vec::new()));
        }
        "png" | "pgm" => scan::of_image(&file, &frame, SHORTEST_OF_PLAN)?,
        "dxf" => dxf::read(file.as_slice(), &frame, &[])?,
        "svg" => svg::read(std::str::from_utf8(&file).context("it is no text in UTF-8")?, &frame)?,
        _ => bail!(
            "a name that ends in .png, .pgm, .dxf, .svg, .csv or .toml is expected; `sonarfix map import` reads grids and GeoJSON, too"
        ),
    };
    let is_image = matches!(ending.as_str(), "png" | "pgm");
    let hint = if *is_plan || is_image { None } else { plan::fewer(&imported) };
    let Imported { floor, mut notes, .. } =
        if *is_plan || is_image { plan::of(imported)?.0 } else { imported };
    notes.extend(hint.map(|walls| {
        format!("hint: with \"The drawing is a floor plan\" it has {walls} walls, because of double lines, copies or furniture")
    }));
    Ok((floor, notes))
}

/// The lowest and the highest x, and those of y.
fn extent(walls: &[NamedWall]) -> [[f64; 2]; 2] {
    let ends = || walls.iter().flat_map(|wall| [wall.from(), wall.to()]);
    let span = |of: fn([f64; 2]) -> f64| {
        ends().map(of).fold([f64::MAX, f64::MIN], |[low, high], at| [low.min(at), high.max(at)])
    };
    [span(|[x, _]| x), span(|[_, y]| y)]
}

/// The longest rectangle, rounded to centimetres, that keeps off the walls and has walls on all sides.
fn path(walls: &[NamedWall]) -> Option<Loop> {
    let [x, y] = extent(walls);
    let places = |[low, high]: [f64; 2]| {
        (1..PLACES).map(move |step| low + (high - low) * f64::from(step) / f64::from(PLACES))
    };
    let middles: Vec<[f64; 2]> = places(x)
        .flat_map(|x| places(y).map(move |y| [x, y]))
        .filter(|at| is_inside(*at, walls))
        .collect();
    let mut sizes: Vec<[f64; 2]> =
        SIDES.iter().flat_map(|width| SIDES.map(|height| [*width, height])).collect();
    sizes.sort_by(|a, b| (b[0] + b[1]).total_cmp(&(a[0] + a[1])));
    let mut loops = sizes.iter().flat_map(|size| middles.iter().map(|at| Loop::around(*at, *size)));
    loops.find(|path| path.is_free(walls))
}

/// Whether walls are to the left, to the right, above and below.
fn is_inside([x, y]: [f64; 2], walls: &[NamedWall]) -> bool {
    let [mut left, mut right, mut below, mut above] = [false; 4];
    for wall in walls {
        let ([x1, y1], [x2, y2]) = (wall.from(), wall.to());
        if (y1 > y) != (y2 > y) {
            let is_right = x1 + (x2 - x1) * (y - y1) / (y2 - y1) > x;
            right |= is_right;
            left |= !is_right;
        }
        if (x1 > x) != (x2 > x) {
            let is_above = y1 + (y2 - y1) * (x - x1) / (x2 - x1) > y;
            above |= is_above;
            below |= !is_above;
        }
    }
    left && right && below && above
}

impl Loop {
    fn around([x, y]: [f64; 2], [width, height]: [f64; 2]) -> Self {
        let rounded = |metres: f64| (100.0 * metres).round() / 100.0;
        let [left, right] = [x - width / 2.0, x + width / 2.0].map(rounded);
        let [bottom, top] = [y - height / 2.0, y + height / 2.0].map(rounded);
        let start = [left, bottom];
        Self { start, corners: [[right, bottom], [right, top], [left, top], start] }
    }

    /// Whether no wall is on the rectangle or nearer to it than the clearance.
    fn is_free(&self, walls: &[NamedWall]) -> bool {
        let ([left, bottom], [right, top]) = (self.start, self.corners[1]);
        let low = [left - CLEARANCE, bottom - CLEARANCE];
        let high = [right + CLEARANCE, top + CLEARANCE];
        walls.iter().all(|wall| !crosses(wall.from(), wall.to(), low, high))
    }
}

/// Whether a segment has a point in a box: the part of it that is between the sides of each axis.
fn crosses(from: [f64; 2], to: [f64; 2], low: [f64; 2], high: [f64; 2]) -> bool {
    let axes = from.iter().zip(to).zip(low.iter().zip(high));
    let part = axes.fold([0.0_f64, 1.0_f64], |[begin, end], ((&from, to), (&low, high))| {
        let way = to - from;
        if way == 0.0 {
            let is_between = low <= from && from <= high;
            return if is_between { [begin, end] } else { [1.0, 0.0] };
        }
        let (a, b) = ((low - from) / way, (high - from) / way);
        [begin.max(a.min(b)), end.min(a.max(b))]
    });
    part[0] <= part[1]
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    const ROOM: &str = "x1_m,y1_m,x2_m,y2_m,name\n0,0,5,0,a\n5,0,5,4,b\n5,4,0,4,c\n0,4,0,0,d\n";

    fn read(name: &str, unit: &str, file: &[u8]) -> Value {
        let options = json!({ "name": name, "unit": unit, "is_plan": false });
        serde_json::from_str(&answer(&options.to_string(), file.to_vec())).unwrap()
    }

    fn dxf_line([x1, y1, x2, y2]: [f64; 4]) -> String {
        format!("0\nLINE\n8\n0\n10\n{x1}\n20\n{y1}\n11\n{x2}\n21\n{y2}\n")
    }

    /// The room of [`ROOM`] as a drawing in centimetres.
    fn dxf() -> String {
        let lines = [
            [0., 0., 500., 0.],
            [500., 0., 500., 400.],
            [500., 400., 0., 400.],
            [0., 400., 0., 0.],
        ];
        let lines: String = lines.map(dxf_line).concat();
        format!("0\nSECTION\n2\nENTITIES\n{lines}0\nENDSEC\n0\nEOF\n")
    }

    /// The room of [`ROOM`] as an image, 2 cm a pixel.
    fn pgm() -> Vec<u8> {
        let (width, height) = (290_usize, 240_usize);
        let is_between = |at: usize, low: usize, high: usize| (low..=high).contains(&at);
        let is_wall = |column: usize, row: usize| {
            let outer = is_between(column, 17, 272) && is_between(row, 17, 222);
            outer && !(is_between(column, 23, 266) && is_between(row, 23, 216))
        };
        let mut image = format!("P5\n{width} {height}\n255\n").into_bytes();
        image.extend(
            (0..width * height).map(|at| if is_wall(at % width, at / width) { 0 } else { 255 }),
        );
        image
    }

    fn run_of(own: &Value) -> Value {
        let mut scenario =
            serde_json::to_value(sonarfix_map::CLASSROOM.parse::<toml::Table>().unwrap()).unwrap();
        scenario["map"] = own["map"].clone();
        scenario["path"]["start"] = own["path"]["start"].clone();
        scenario["path"]["corners"] = own["path"]["corners"].clone();
        scenario["world"]["obstacle"] = json!([]);
        json!({ "scenario": scenario, "seed": 0, "seconds": 20.0, "moves": [] })
    }

    /// A CSV, a drawing and an image become walls with a path that has a run, and the saved map has these walls.
    #[test]
    fn a_file_becomes_the_map_of_a_run() {
        let files: [(&str, &str, Vec<u8>); 3] = [
            ("room.csv", "", ROOM.into()),
            ("ROOM.DXF", "cm", dxf().into()),
            ("room.pgm", "0.02", pgm()),
        ];
        for (name, unit, file) in files {
            let own = read(name, unit, &file);
            assert_eq!(own["map"]["wall"].as_array().map(Vec::len), Some(4), "{name}: {own}");
            let request = run_of(&own);
            let run: Value = serde_json::from_str(&crate::answer(&request.to_string())).unwrap();
            assert_eq!(run["summary"]["verdict"], "Tracking", "{name}: {}", run["error"]);
            let saved: Value = serde_json::from_str(&super::file(&request.to_string())).unwrap();
            let saved = Floor::parse(saved["text"].as_str().unwrap(), "map.toml").unwrap();
            let [[left, right], [bottom, top]] = extent(saved.named_walls());
            let is_near = |a: f64, b: f64| (a - b).abs() < 0.03;
            assert!(is_near(right - left, 5.0) && is_near(top - bottom, 4.0), "{name}: {saved:?}");
        }
    }

    /// The path stays in the room, and off a wall in the middle of it.
    #[test]
    fn the_path_keeps_off_the_walls() {
        let wall = |from, to| NamedWall::new(format!("{from:?}"), from, to).unwrap();
        let mut walls = vec![
            wall([0.0, 0.0], [6.0, 0.0]),
            wall([6.0, 0.0], [6.0, 4.0]),
            wall([6.0, 4.0], [0.0, 4.0]),
            wall([0.0, 4.0], [0.0, 0.0]),
        ];
        let sides =
            |path: Loop| [path.corners[0][0] - path.start[0], path.corners[1][1] - path.start[1]];
        assert_eq!(path(&walls).map(sides), Some([4.0, 2.0]));
        walls.push(wall([3.0, 0.5], [3.0, 3.5]));
        assert_eq!(path(&walls).map(sides), Some([1.5, 2.0]));
    }

    /// What cannot be read is refused with what is wrong and what to do, in the words of the page.
    #[test]
    fn mistakes_are_named() {
        let (dxf, pgm) = (dxf(), pgm());
        let refused: [(&str, &str, &[u8], &str); 9] = [
            ("room.docx", "", ROOM.as_bytes(), ".dxf"),
            ("room.png", "0.02", ROOM.as_bytes(), "neither PGM nor PNG"),
            ("room.pgm", "", &pgm, "\"Unit of the drawing\": the length of a pixel is unknown"),
            ("room.dxf", "", dxf.as_bytes(), "give \"Unit of the drawing\""),
            ("room.dxf", "furlong", dxf.as_bytes(), "m, cm, mm, in, ft"),
            ("room.dxf", "m", b"\x00\xff", "group code"),
            ("room.dxf", "0.0001", dxf.as_bytes(), "0.05 m × 0.04 m"),
            ("room.csv", "", b"x1_m,y1_m,x2_m,y2_m\n0,0,5,zero\n", "room.csv"),
            ("line.csv", "", b"x1_m,y1_m,x2_m,y2_m\n0,0,5,0\n", "closed"),
        ];
        for (name, unit, file, reason) in refused {
            let answer = read(name, unit, file);
            let error = answer["error"].as_str().unwrap_or_default();
            assert!(error.contains(reason) && !error.contains("--"), "{name}: {answer}");
        }
    }
}
