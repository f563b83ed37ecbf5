//! The map: walls with names, in metres.

use std::collections::HashSet;
use std::path::Path;

use sonarfix::geometry::pose;
use sonarfix::geometry::units::Metres;
use sonarfix::map::{Wall, WallError};

use crate::document::{Document, Node, Table};
use crate::error::FileError;
use crate::geometry::{Segment, TOO_FAR, is_near_enough};
use crate::keys::{Key, Section, Value, optional, other};
use crate::quantity::{LENGTH, Unit};
use crate::{file, single};

#[rustfmt::skip]
pub(crate) static MAP: Section<()> = Section { name: "map", usual: || (), keys: &[
    other("unit", "`\"m\"`, `\"cm\"` or `\"mm\"`", "unit of the coordinates"),
    other("wall", "at least one table", "the walls. `[[map.wall]]` tables are equivalent"),
] };

#[rustfmt::skip]
pub(crate) static WALL: Section<Option<f64>> = Section { name: "wall", usual: || None, keys: &[
    other("name", "unique", "name of the wall"),
    other("from", "within 8 km of the origin", "one end of the wall"),
    other("to", "the same", "the other end, at least 0.1 mm away"),
    optional(Key::new("accuracy", Value::Number(&LENGTH, ("0.1 mm", "255 mm"), |accuracy| accuracy),
        "standard deviation of its place, in whole millimetres, instead of `map_accuracy` of the [robot file](#robot). `sonarfix survey` writes it")),
] };

/// A wall of a floor.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedWall {
    name: String,
    from: [f64; 2],
    to: [f64; 2],
    wall: Wall,
}

impl NamedWall {
    /// A wall between two points, metres.
    ///
    /// # Errors
    /// [`WallError`], by the cause.
    pub fn new(name: String, from: [f64; 2], to: [f64; 2]) -> Result<Self, WallError> {
        if !is_near_enough(from) || !is_near_enough(to) {
            return Err(WallError::NotFinite);
        }
        let point = |[x, y]: [f64; 2]| pose::Point::new(single(x), single(y));
        let wall = Wall::new(point(from), point(to))?;
        Ok(Self { name, from, to, wall })
    }

    /// The same wall with this accuracy of its own, metres ([`Wall::with_accuracy`]), if it has one.
    #[must_use]
    pub fn with_accuracy(self, accuracy: Option<f64>) -> Self {
        let wall = match accuracy {
            Some(accuracy) => self.wall.with_accuracy(Metres(single(accuracy))),
            None => self.wall,
        };
        Self { wall, ..self }
    }

    /// The standard deviation of its place, metres, if it has one of its own.
    #[must_use]
    pub fn accuracy(&self) -> Option<f64> {
        self.wall.accuracy().map(|accuracy| accuracy.0.into())
    }

    /// Its unique name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Start, metres.
    #[must_use]
    pub fn from(&self) -> [f64; 2] {
        self.from
    }

    /// End, metres.
    #[must_use]
    pub fn to(&self) -> [f64; 2] {
        self.to
    }

    pub(crate) fn segment(&self) -> Segment {
        Segment { from: self.from, to: self.to }
    }
}

/// The walls of a place.
#[derive(Debug, Clone, PartialEq)]
pub struct Floor {
    walls: Vec<NamedWall>,
}

impl Floor {
    /// Reads a map file.
    ///
    /// # Errors
    /// [`FileError`] with all mistakes.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::parse(&file::read(path)?, &file::name(path))
    }

    /// Parses the text of a map file. Errors name it `file_name`.
    ///
    /// # Errors
    /// [`FileError`] with all mistakes.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, FileError> {
        let document = Document::parse(text, file_name)?;
        document.read(&["map"], |root| Some(Self::from_node(root.require("map")).0))
    }

    /// Reads a `[map]` table; also returns the position of each wall in the text.
    pub(crate) fn from_node(node: Node<'_>) -> (Self, Vec<usize>) {
        let map = node.table(&MAP.names());
        let unit = map.require("unit").unit_of_length();
        let array = map.require("wall");
        let (mut walls, mut places) = (Vec::new(), Vec::new());
        let mut names = HashSet::new();
        for item in array.items() {
            let place = item.place();
            let table = item.table(&WALL.names());
            let Some(wall) = wall(&table, unit) else { continue };
            if !names.insert(wall.name.clone()) {
                let message = format!("another wall is already called \"{}\"", wall.name);
                table.report_at("name", message);
            }
            places.push(place);
            walls.push(wall);
        }
        // Walls that cannot be read have been recorded.
        let is_empty = array.items().is_empty();
        array.check((Self { walls }, places), !is_empty, "at least one wall")
    }

    /// A floor of these walls.
    ///
    /// ```
    /// use sonarfix_map::{Floor, NamedWall};
    /// let wall = NamedWall::new("window".into(), [0.0, 0.0], [4.0, 0.0])?;
    /// let floor = Floor::new(vec![wall]);
    /// assert_eq!(Floor::parse(&floor.to_toml(), "floor.toml")?, floor);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn new(walls: Vec<NamedWall>) -> Self {
        Self { walls }
    }

    /// The text of a map file with these walls, in metres.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let line = |wall: &NamedWall| {
            let name = toml::Value::String(wall.name.clone());
            let ([x1, y1], [x2, y2]) = (wall.from, wall.to);
            let accuracy = wall.accuracy().map_or_else(String::new, |accuracy| {
                format!(", accuracy = \"{:.0} mm\"", 1e3 * accuracy)
            });
            format!(
                "    {{ name = {name}, from = [{x1:?}, {y1:?}], to = [{x2:?}, {y2:?}]{accuracy} }},\n"
            )
        };
        let walls: String = self.walls.iter().map(line).collect();
        format!("format = 1\n\n[map]\nunit = \"m\"\nwall = [\n{walls}]\n")
    }

    /// The text of a CSV of these walls, in metres, without their accuracies.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let line = |wall: &NamedWall| {
            let ([x1, y1], [x2, y2]) = (wall.from, wall.to);
            format!("{x1:?},{y1:?},{x2:?},{y2:?},\"{}\"\n", wall.name.replace('"', "\"\""))
        };
        let walls: String = self.walls.iter().map(line).collect();
        format!("x1_m,y1_m,x2_m,y2_m,name\n{walls}")
    }

    /// The walls with their names, in the file's order.
    #[must_use]
    pub fn named_walls(&self) -> &[NamedWall] {
        &self.walls
    }

    /// The walls in the localizer's type, in the same order.
    #[must_use]
    pub fn walls(&self) -> Vec<Wall> {
        self.walls.iter().map(|named| named.wall).collect()
    }
}

/// None if it is no wall, which is recorded.
fn wall(table: &Table<'_>, unit: &Unit) -> Option<NamedWall> {
    let mistakes = table.mistakes();
    let name = table.require("name");
    let name = name.check(name.text(), !name.text().is_empty(), "a name");
    let point = |key| table.require(key).point(unit);
    let (from, to) = (point("from"), point("to"));
    let wall = NamedWall::new(name.into(), from, to);
    if let Err(error) = &wall
        && table.mistakes() == mistakes
    {
        let message = match error {
            WallError::NotFinite => format!("must be {TOO_FAR}"),
            WallError::ZeroLength => "must differ from `from`: the wall has no length".into(),
            other => other.to_string(),
        };
        table.report_at("to", message);
    }
    let wall = wall.ok()?;
    let accuracy = WALL.read_from(table, None);
    Some(wall.with_accuracy(accuracy))
}
