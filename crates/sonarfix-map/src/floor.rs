//! The map: walls with names, in metres.

use std::collections::HashSet;
use std::path::Path;

use sonarfix::map::{Wall, WallError};
use sonarfix::pose;

use crate::document::{Document, Node, Table};
use crate::error::FileError;
use crate::geometry::{TOO_FAR, is_near_enough};
use crate::quantity::Unit;
use crate::{file, single};

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
    /// [`WallError`], by what is wrong with the points.
    pub fn new(name: String, from: [f64; 2], to: [f64; 2]) -> Result<Self, WallError> {
        if !is_near_enough(from) || !is_near_enough(to) {
            return Err(WallError::NotFinite);
        }
        let point = |[x, y]: [f64; 2]| pose::Point::new(single(x), single(y));
        let wall = Wall::new(point(from), point(to))?;
        Ok(Self { name, from, to, wall })
    }

    /// Its name, which no other wall of the floor has.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where it starts, metres.
    #[must_use]
    pub fn from(&self) -> [f64; 2] {
        self.from
    }

    /// Where it ends, metres.
    #[must_use]
    pub fn to(&self) -> [f64; 2] {
        self.to
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
    /// [`FileError`] with the first thing that is wrong.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::parse(&file::read(path)?, &file::name(path))
    }

    /// Reads the text of a map file that errors call `file_name`.
    ///
    /// # Errors
    /// [`FileError`] with the first thing that is wrong.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, FileError> {
        let document = Document::parse(text, file_name)?;
        let root = document.root(&["map"])?;
        Self::from_node(root.require("map")?)
    }

    /// Reads a `[map]` table.
    pub(crate) fn from_node(node: Node<'_>) -> Result<Self, FileError> {
        let map = node.table(&["unit", "wall"])?;
        let unit = map.require("unit")?.unit_of_length()?;
        let array = map.require("wall")?;
        let mut walls = Vec::new();
        let mut names = HashSet::new();
        for item in array.items()? {
            let table = item.table(&["name", "from", "to"])?;
            let wall = wall(&table, unit)?;
            if !names.insert(wall.name.clone()) {
                let message = format!("another wall is already called \"{}\"", wall.name);
                return Err(table.error_at("name", message));
            }
            walls.push(wall);
        }
        let has_walls = !walls.is_empty();
        array.check(Self { walls }, has_walls, "at least one wall")
    }

    /// The walls with their names, in the file's order.
    #[must_use]
    pub fn named_walls(&self) -> &[NamedWall] {
        &self.walls
    }

    /// The walls as the localizer takes them, in the same order.
    #[must_use]
    pub fn walls(&self) -> Vec<Wall> {
        self.walls.iter().map(|named| named.wall).collect()
    }
}

fn wall(table: &Table<'_>, unit: &Unit) -> Result<NamedWall, FileError> {
    let name = table.require("name")?;
    let name = name.check(name.text()?, !name.text()?.is_empty(), "a name")?;
    let point = |key| {
        let node = table.require(key)?;
        let point = node.point(unit)?;
        node.check(point, is_near_enough(point), TOO_FAR)
    };
    let (from, to) = (point("from")?, point("to")?);
    NamedWall::new(name.into(), from, to).map_err(|error| {
        let message = match error {
            WallError::NotFinite => format!("must be {TOO_FAR}"),
            WallError::ZeroLength => "must differ from `from`: the wall has no length".into(),
        };
        table.error_at("to", message)
    })
}
