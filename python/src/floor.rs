//! Maps of walls.

use std::path::PathBuf;
use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, StringArray};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use sonarfix::config::{Config, RangerParameters};
use sonarfix::geometry::units::Metres;
use sonarfix::map::{Map as CoreMap, Wall};
use sonarfix_drawings::{Frame, grid};
use sonarfix_map::{Finding, Floor, Limits, MapFile, NamedWall, Severity, bake, flaws, symmetries};
use sonarfix_sim::simulate::MANY;

use crate::robot::Robot;
use crate::table::Table;
use crate::{errors, values};

/// The ends of walls as an array of shape (n, 2, 2).
pub fn ends(
    py: Python<'_>,
    walls: impl Iterator<Item = [[f64; 2]; 2]>,
) -> PyResult<Bound<'_, PyAny>> {
    let flat: Vec<f64> = walls.flatten().flatten().collect();
    let count = flat.len() / 4;
    Ok(PyArray1::from_vec(py, flat).reshape([count, 2, 2])?.into_any())
}

/// Walls for a localizer, which borrows them: with an index if there are many, as in the simulator.
pub struct Walls {
    walls: Vec<Wall>,
    image: Option<Vec<u8>>,
}

impl Walls {
    pub fn of(floor: &Floor) -> Self {
        let walls = floor.walls();
        let image = (walls.len() > MANY).then(|| bake(&walls).ok()).flatten();
        Self { walls, image }
    }

    pub fn map(&self) -> CoreMap<'_> {
        let indexed = self.image.as_deref().and_then(|image| CoreMap::read(image).ok());
        indexed.unwrap_or_else(|| CoreMap::new(&self.walls))
    }
}

/// A map of straight walls.
///
/// ``walls`` is an array of shape (n, 2, 2): for each wall its two ends, x and y in metres in the map frame. ``names`` are
/// unique; by default "wall 1", "wall 2", …
#[pyclass(frozen, module = "sonarfix")]
pub struct Map {
    pub floor: Floor,
}

impl Map {
    pub fn of(floor: Floor) -> Self {
        Self { floor }
    }
}

#[pymethods]
impl Map {
    #[new]
    #[pyo3(signature = (walls, names=None))]
    fn new(walls: &Bound<'_, PyAny>, names: Option<Vec<String>>) -> PyResult<Self> {
        let (numbers, shape) = values::reals(walls, "walls")?;
        let &[count, 2, 2] = shape.as_slice() else {
            return Err(errors::input(format!(
                "walls must have the shape (n, 2, 2), not {shape:?}"
            )));
        };
        let names = names.unwrap_or_else(|| (1..=count).map(|n| format!("wall {n}")).collect());
        let mut unique = std::collections::HashSet::new();
        if names.len() != count || !names.iter().all(|name| unique.insert(name)) {
            return Err(errors::input(format!("names must be {count} different texts")));
        }
        let mut named = Vec::new();
        for (name, wall) in names.into_iter().zip(numbers.chunks_exact(4)) {
            let &[x0, y0, x1, y1] = wall else { continue };
            let wall = NamedWall::new(name.clone(), [x0, y0], [x1, y1]);
            named.push(wall.map_err(|error| errors::input(format!("\"{name}\": {error}")))?);
        }
        if named.is_empty() {
            return Err(errors::input("a map needs a wall"));
        }
        Ok(Self::of(Floor::new(named)))
    }

    /// Reads a map from a map or scenario file (.toml), segments (.csv, with a ``unit`` of m, cm or mm if its header has
    /// none) or a baked map. Raises FileError.
    #[staticmethod]
    #[pyo3(signature = (path, unit=None))]
    fn load(path: PathBuf, unit: Option<&str>) -> PyResult<Self> {
        let map = MapFile::read(&path, unit).map_err(|error| errors::file(&error))?;
        Ok(Self::of(map.floor))
    }

    /// Finds the straight walls of an occupancy grid: an array of shape (rows, columns) with values from 0 (free) to 1
    /// (occupied), rows from the bottom (y grows), as in ROS's ``OccupancyGrid`` (divided by 100; unknown is negative or NaN).
    ///
    /// ``resolution`` is the size of a cell, metres; ``origin`` the place of the lower left corner: x, y (metres), turn
    /// (radians). Lines shorter than ``shortest`` metres are left out. Returns the map and notes on what was dropped and what is
    /// uncertain.
    #[staticmethod]
    #[pyo3(signature = (grid, resolution, origin=(0.0, 0.0, 0.0), *, occupied=0.65, shortest=0.1))]
    fn from_occupancy_grid(
        grid: &Bound<'_, PyAny>,
        resolution: f64,
        origin: (f64, f64, f64),
        occupied: f64,
        shortest: f64,
    ) -> PyResult<(Self, Vec<String>)> {
        let (cells, shape) = values::reals(grid, "the grid")?;
        let &[rows, columns] = shape.as_slice() else {
            return Err(errors::input(format!("the grid must have two dimensions, not {shape:?}")));
        };
        let numbers = [origin.0, origin.1, origin.2, shortest, occupied];
        if !numbers.iter().all(|number| number.is_finite()) {
            return Err(errors::input("origin, shortest and occupied must be finite"));
        }
        let frame = Frame { unit: None, origin: [0.0, 0.0] };
        let place = grid::Place { resolution, origin: [origin.0, origin.1, origin.2] };
        let cells: Vec<bool> = cells.iter().map(|&cell| cell > occupied).collect();
        let found = grid::of_cells(&cells, [columns, rows], &place, &frame, shortest);
        let found = found.map_err(|error| errors::any(&error))?;
        Ok((Self::of(found.floor), found.notes))
    }

    /// The ends of the walls, an array of shape (n, 2, 2), metres in the map frame.
    #[getter]
    fn walls<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        ends(py, self.floor.named_walls().iter().map(|wall| [wall.from(), wall.to()]))
    }

    /// The names of the walls.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.floor.named_walls().iter().map(|wall| wall.name().to_owned()).collect()
    }

    fn __len__(&self) -> usize {
        self.floor.named_walls().len()
    }

    /// Checks the map for a robot's sonar, by default a typical one: a table with a row per finding: ``wall``, ``severity``
    /// ("error" or "warning"), ``finding``; a symmetry of the whole map has no wall.
    #[pyo3(signature = (robot=None))]
    fn check(&self, robot: Option<&Robot>) -> PyResult<Table> {
        let usual = || Config::for_track_width(Metres(0.16)).rangers.first;
        let sonar: RangerParameters =
            robot.map_or_else(usual, |robot| robot.config.localizer.rangers.first);
        let baked = |error: sonarfix_map::BakeError| errors::input(error.to_string());
        let findings = flaws(&self.floor, &sonar).map_err(baked)?;
        let symmetries = symmetries(&self.floor).map_err(baked)?;
        let severity = |finding: &Finding| match finding.severity() {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let name = |wall: usize| self.floor.named_walls().get(wall).map(NamedWall::name);
        let text = |finding: &Finding| match finding.other().and_then(name) {
            Some(other) => format!("{} (\"{other}\")", finding.flaw),
            None => finding.flaw.to_string(),
        };
        let of_map = symmetries.iter();
        let walls = findings.iter().map(|f| name(f.wall)).chain(of_map.clone().map(|_| None));
        let severities = findings.iter().map(severity).chain(of_map.clone().map(|_| "warning"));
        let texts = findings.iter().map(text).chain(of_map.map(ToString::to_string));
        Table::of(vec![
            ("wall".to_owned(), Arc::new(walls.collect::<StringArray>()) as ArrayRef),
            ("severity".to_owned(), Arc::new(StringArray::from_iter_values(severities))),
            ("finding".to_owned(), Arc::new(StringArray::from_iter_values(texts))),
        ])
    }

    /// Joins collinear pieces of walls that are up to ``tolerance`` metres apart or beside each other, and leaves out walls
    /// that are then shorter than ``shortest`` metres.
    #[pyo3(signature = (tolerance=0.001, shortest=0.0))]
    fn simplify(&self, tolerance: f64, shortest: f64) -> PyResult<Self> {
        for (name, value) in [("tolerance", tolerance), ("shortest", shortest)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(errors::input(format!("{name} must be zero or positive")));
            }
        }
        let simplified = sonarfix_map::simplify(&self.floor, Limits { tolerance, shortest });
        let simplified = simplified
            .map_err(|error| errors::input(format!("nothing is left of the map: {error}")))?;
        Ok(Self::of(simplified.floor))
    }

    /// The text of a map file.
    fn to_toml(&self) -> String {
        self.floor.to_toml()
    }

    /// The image that a robot reads in place from flash.
    fn bake(&self) -> PyResult<std::borrow::Cow<'static, [u8]>> {
        let image = bake(&self.floor.walls()).map_err(|error| errors::input(error.to_string()))?;
        Ok(image.into())
    }

    /// The walls as a table: ``name``, ``from_x_m``, ``from_y_m``, ``to_x_m``, ``to_y_m``, ``length_m``.
    #[getter]
    fn table(&self) -> PyResult<Table> {
        let walls = self.floor.named_walls();
        let reals = |of: &dyn Fn(&NamedWall) -> f64| {
            Arc::new(Float64Array::from_iter_values(walls.iter().map(of))) as ArrayRef
        };
        let names = StringArray::from_iter_values(walls.iter().map(NamedWall::name));
        let length =
            |wall: &NamedWall| (wall.to()[0] - wall.from()[0]).hypot(wall.to()[1] - wall.from()[1]);
        let columns: [(&str, ArrayRef); 6] = [
            ("name", Arc::new(names)),
            ("from_x_m", reals(&|wall| wall.from()[0])),
            ("from_y_m", reals(&|wall| wall.from()[1])),
            ("to_x_m", reals(&|wall| wall.to()[0])),
            ("to_y_m", reals(&|wall| wall.to()[1])),
            ("length_m", reals(&length)),
        ];
        Table::of(columns.map(|(name, values)| (name.to_owned(), values)).into())
    }

    /// Draws the walls with matplotlib; returns the axes.
    #[pyo3(signature = (ax=None, **keywords))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let plots = slf.py().import("sonarfix.plots")?;
        plots.getattr("plot_map")?.call((slf, ax), keywords)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, map) = (slf.py(), slf.get());
        let arguments =
            PyTuple::new(py, [map.walls(py)?, map.names().into_pyobject(py)?.into_any()])?;
        PyTuple::new(py, [slf.get_type().into_any(), arguments.into_any()])
    }

    fn __repr__(&self) -> String {
        format!("<sonarfix.Map: {} walls>", self.__len__())
    }
}
