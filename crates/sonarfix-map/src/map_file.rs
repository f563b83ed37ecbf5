//! Reads a map from any file that contains one: a map file, a scenario, a CSV of segments, a baked map.

use std::path::Path;

use sonarfix::config::RangerParameters;

use crate::document::Document;
use crate::error::FileError;
use crate::file;
use crate::floor::{Floor, NamedWall};
use crate::scenario::{Scenario, scenario_keys};
use crate::text_lines::Lines;
use crate::wall_file::WallFile;

/// A map, with the position of each wall in its file.
#[derive(Debug, Clone)]
pub struct MapFile {
    /// The walls.
    pub floor: Floor,
    /// The scenario, if the file is one.
    pub scenario: Option<Box<Scenario>>,
    name: String,
    /// The line of each wall; none in a baked map.
    lines: Vec<usize>,
    is_toml: bool,
}

impl MapFile {
    /// Reads a map: a baked map if the file starts with its signature, a CSV of segments if its name ends in `.csv`,
    /// otherwise TOML, in which a file with a `path` is a scenario. `unit` is that of a CSV without a unit in its header.
    ///
    /// # Errors
    /// [`FileError`] with all mistakes.
    pub fn read(path: &Path, unit: Option<&str>) -> Result<Self, FileError> {
        let (name, bytes) = (file::name(path), file::bytes(path)?);
        if let Ok(text) = str::from_utf8(&bytes)
            && let Ok(document) = Document::parse(text, &name)
            && document.has("path")
        {
            let base = path.parent().unwrap_or(Path::new(""));
            return Self::of_scenario(text, &document, name.clone(), base);
        }
        Self::parse(bytes, path, unit)
    }

    /// Reads a map that is no scenario from the bytes of a file. Only the name of `path` is used.
    ///
    /// # Errors
    /// [`FileError`] with all mistakes.
    pub fn parse(bytes: Vec<u8>, path: &Path, unit: Option<&str>) -> Result<Self, FileError> {
        let WallFile { floor, lines } = WallFile::parse(bytes, path, unit)?;
        let is_toml = path.extension().is_some_and(|extension| extension == "toml");
        Ok(Self { floor, scenario: None, name: file::name(path), lines, is_toml })
    }

    fn of_scenario(
        text: &str,
        document: &Document<'_>,
        name: String,
        base: &Path,
    ) -> Result<Self, FileError> {
        let scenario = Box::new(Scenario::parse(text, &name, base)?);
        let floor = scenario.floor.clone();
        let map = document.read(&scenario_keys(), |root| {
            let map = root.require("map");
            Some(match map.as_text() {
                Some(file) => Err(base.join(file)),
                None => Ok(Floor::from_node(map).1),
            })
        });
        let (name, lines) = match map? {
            Ok(places) => (name, Lines::new(text).of_each(&places)),
            Err(file) => (file::name(&file), WallFile::read(&file, None)?.lines),
        };
        Ok(Self { floor, scenario: Some(scenario), name, lines, is_toml: true })
    }

    /// The sonar of the robot, if the file is a scenario.
    #[must_use]
    pub fn sonar(&self) -> Option<RangerParameters> {
        self.scenario.as_ref().map(|scenario| scenario.robot.localizer.rangers.first)
    }

    /// Whether the walls are in TOML.
    pub(crate) fn is_toml(&self) -> bool {
        self.is_toml
    }

    /// The name of the file in error messages.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The position of a wall in error messages: `map.toml:12: "window"`.
    #[must_use]
    pub fn place(&self, wall: usize) -> String {
        let (file, name) = (&self.name, self.quoted(wall));
        match self.line(wall) {
            Some(line) => format!("{file}:{line}: {name}"),
            None => format!("{file}: {name}"),
        }
    }

    /// The name of a wall in quotes.
    #[must_use]
    pub fn quoted(&self, wall: usize) -> String {
        let name = self.floor.named_walls().get(wall).map_or("", NamedWall::name);
        format!("\"{name}\"")
    }

    /// The line of a wall, if the file has lines.
    #[must_use]
    pub fn line(&self, wall: usize) -> Option<usize> {
        self.lines.get(wall).copied()
    }
}
