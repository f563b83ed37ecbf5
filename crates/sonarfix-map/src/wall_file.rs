//! Reads walls from a file that is a map: TOML, a CSV of segments, a baked map.

use std::collections::HashSet;
use std::path::Path;

use sonarfix::geometry::pose::Point;
use sonarfix::map::{Map, WallError, image};

use crate::document::Document;
use crate::error::{FileError, MOST_MISTAKES, Mistake};
use crate::file;
use crate::floor::{Floor, NamedWall};
use crate::geometry::TOO_FAR;
use crate::quantity::{LENGTH, Unit};
use crate::text_lines::Lines;

/// The walls of a map.
pub(crate) struct WallFile {
    pub floor: Floor,
    /// The line of each wall; none in a baked map.
    pub lines: Vec<usize>,
}

/// The most walls of a CSV: an imported map has half of them.
const MOST_WALLS: u32 = 400_000;

impl WallFile {
    /// Reads a map: a baked map if the file starts with its signature, a CSV of segments if its name ends in `.csv`,
    /// otherwise TOML. `unit` is that of a CSV without a unit in its header.
    pub fn read(path: &Path, unit: Option<&str>) -> Result<Self, FileError> {
        Self::parse(file::bytes(path)?, path, unit)
    }

    /// Parses the bytes of a file.
    pub fn parse(bytes: Vec<u8>, path: &Path, unit: Option<&str>) -> Result<Self, FileError> {
        let name = file::name(path);
        if bytes.starts_with(&image::MAGIC) {
            return Self::from_image(&bytes, &name);
        }
        let text = String::from_utf8(bytes)
            .map_err(|_| FileError::of_file(&name, "is neither text nor a baked map"))?;
        let is_csv =
            path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
        if is_csv { Self::from_csv(&text, &name, unit) } else { Self::from_toml(&text, &name) }
    }

    fn from_toml(text: &str, name: &str) -> Result<Self, FileError> {
        let document = Document::parse(text, name)?;
        let read = document.read(&["map"], |root| Some(Floor::from_node(root.require("map"))));
        let (floor, places) = read?;
        Ok(Self { floor, lines: Lines::new(text).of_each(&places) })
    }

    /// Reads a baked map. Its walls are named by their numbers.
    fn from_image(bytes: &[u8], name: &str) -> Result<Self, FileError> {
        let refused = |message: String| FileError::of_file(name, message);
        let map = Map::read(bytes).map_err(|error| refused(error.to_string()))?;
        let wall = |(id, wall): (sonarfix::map::WallId, sonarfix::map::Wall)| {
            let place = |point: Point| [point.x.0.into(), point.y.0.into()];
            let named =
                NamedWall::new(format!("wall {}", id.0), place(wall.from()), place(wall.to()));
            let named = named.map_err(|error| refused(format!("wall {}: {error}", id.0)))?;
            let accuracy = wall.accuracy().map(|accuracy| accuracy.0.into());
            Ok::<_, FileError>(named.with_accuracy(accuracy))
        };
        let walls = map.walls().map(wall).collect::<Result<_, _>>()?;
        Ok(Self { floor: Floor::new(walls), lines: Vec::new() })
    }

    /// Parses the text of a CSV of segments.
    fn from_csv(text: &str, name: &str, unit: Option<&str>) -> Result<Self, FileError> {
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| of_csv(name, &error))?.clone();
        let columns = Columns::of(&header, unit)
            .map_err(|message| FileError::from(Mistake::new(name, 1, "", message)))?;
        let (mut walls, mut lines, mut mistakes) = (Vec::new(), Vec::new(), Vec::new());
        let mut counter = LineCounter::new(text);
        let mut names = HashSet::new();
        for (number, record) in (1_u32..).zip(reader.records()) {
            let record = record.map_err(|error| of_csv(name, &error))?;
            let byte = record.position().and_then(|position| usize::try_from(position.byte()).ok());
            let line = counter.advance_to(text.len().saturating_sub(byte.unwrap_or(0)));
            if number > MOST_WALLS {
                let message =
                    format!("there are more than {MOST_WALLS} walls: remove what is no wall");
                mistakes.push(Mistake::new(name, line, "", message));
            }
            if number > MOST_WALLS || mistakes.len() >= MOST_MISTAKES {
                break;
            }
            let wall = columns.wall(&record, number).and_then(|wall| {
                let is_new = names.insert(wall.name().to_owned());
                let message = || format!("another wall is already called \"{}\"", wall.name());
                if is_new { Ok(wall) } else { Err(("name", message())) }
            });
            match wall {
                Ok(wall) => walls.push(wall),
                Err((key, message)) => mistakes.push(Mistake::new(name, line, key, message)),
            }
            lines.push(line);
        }
        if walls.is_empty() && mistakes.is_empty() {
            mistakes.push(Mistake::new(name, 1, "", "there is no wall below the header"));
        }
        if let Some(error) = FileError::of(mistakes) {
            return Err(error);
        }
        Ok(Self { floor: Floor::new(walls), lines })
    }
}

/// Counts the lines of a text from record to record.
struct LineCounter<'t> {
    rest: &'t str,
    line: usize,
}

impl<'t> LineCounter<'t> {
    fn new(text: &'t str) -> Self {
        Self { rest: text, line: 1 }
    }

    /// The line at which a record starts, from the distance between the end of the previous one and the end of the text.
    /// There may be empty lines between them.
    fn advance_to(&mut self, end: usize) -> usize {
        let ended = self.rest.len().saturating_sub(end);
        let after = self.rest.get(ended..).unwrap_or_default();
        let start = after.trim_start_matches(['\r', '\n']);
        let passed = self.rest.get(..self.rest.len() - start.len()).unwrap_or_default();
        self.line += passed.matches('\n').count();
        self.rest = start;
        self.line
    }
}

fn of_csv(name: &str, error: &csv::Error) -> FileError {
    let message = format!("cannot be read as CSV: {error}");
    match error.position().and_then(|position| usize::try_from(position.line()).ok()) {
        Some(line) => Mistake::new(name, line, "", message).into(),
        None => FileError::of_file(name, message),
    }
}

/// The columns of a CSV, and the unit of its coordinates.
struct Columns {
    coordinates: [usize; 4],
    name: Option<usize>,
    unit: &'static Unit,
}

const COORDINATES: [&str; 4] = ["x1", "y1", "x2", "y2"];

impl Columns {
    /// Finds the columns `x1`, `y1`, `x2`, `y2` and the optional `name`, in any order. The unit follows the name, as in
    /// `x1_mm`.
    fn of(header: &csv::StringRecord, unit: Option<&str>) -> Result<Self, String> {
        let find = |wanted: &str| {
            header.iter().position(|column| column.split('_').next() == Some(wanted))
        };
        let columns = COORDINATES.map(find);
        let [Some(x1), Some(y1), Some(x2), Some(y2)] = columns else {
            return Err(
                "the columns must be named x1, y1, x2, y2 and, if there is one, name".into()
            );
        };
        let coordinates = [x1, y1, x2, y2];
        let units = coordinates.map(|at| header.get(at)?.split_once('_').map(|(_, unit)| unit));
        let [first, rest @ ..] = units;
        if rest.iter().any(|&unit| unit != first) {
            return Err("the coordinates must all be in one unit".into());
        }
        let unit = match (first, unit) {
            (Some(named), None) => named,
            (None, Some(given)) => given,
            (Some(named), Some(given)) if named == given => named,
            (Some(named), Some(given)) => {
                return Err(format!("the coordinates are in {named}, not in {given}"));
            }
            (None, None) => {
                return Err(
                    "the unit is missing: name the columns x1_m, y1_m, x2_m, y2_m (or _cm, _mm), \
                            or give --unit"
                        .into(),
                );
            }
        };
        let unit = LENGTH.unit(unit);
        let unit =
            unit.ok_or_else(|| format!("the unit must be one of {}", LENGTH.unit_names()))?;
        Ok(Self { coordinates, name: find("name"), unit })
    }

    /// The wall of a record; otherwise the invalid column and the error.
    fn wall(
        &self,
        record: &csv::StringRecord,
        number: u32,
    ) -> Result<NamedWall, (&'static str, String)> {
        let mut ends = [0.0; 4];
        for ((end, &at), key) in ends.iter_mut().zip(&self.coordinates).zip(COORDINATES) {
            let text = record.get(at).unwrap_or_default();
            let coordinate =
                text.parse().map_err(|_| (key, format!("`{text}` is not a number")))?;
            *end = self.unit.in_si(coordinate);
        }
        let [x1, y1, x2, y2] = ends;
        let name = self.name.and_then(|at| record.get(at)).filter(|name| !name.is_empty());
        let name = name.map_or_else(|| format!("wall {number}"), str::to_owned);
        NamedWall::new(name, [x1, y1], [x2, y2]).map_err(|error| match error {
            WallError::NotFinite => ("", format!("both ends must be {TOO_FAR}")),
            WallError::ZeroLength => ("", "the wall has no length".into()),
            other => ("", other.to_string()),
        })
    }
}
