//! The surroundings that are not in the map: air, furniture, people.

use crate::document::{Node, Table};
use crate::error::FileError;
use crate::quantity::{LENGTH, TEMPERATURE, TIME, Unit};

const KEYS: [&str; 3] = ["temperature", "unit", "obstacle"];
const OBSTACLE_KEYS: [&str; 6] = ["centre", "radius", "from", "to", "walk", "takes"];

/// Temperature of a room, °C.
const ROOM: f64 = 20.0;
/// Temperatures that a ranger's driver accepts, °C.
const COLDEST: f64 = -40.0;
const HOTTEST: f64 = 85.0;

/// The outline of an obstacle, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outline {
    /// A circle.
    Circle {
        /// Centre.
        centre: [f64; 2],
        /// Radius.
        radius: f64,
    },
    /// A segment.
    Face {
        /// One end.
        from: [f64; 2],
        /// The other end.
        to: [f64; 2],
    },
}

/// A movement back and forth at constant speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillation {
    /// Displacement from the outline to the turning point, metres.
    pub by: [f64; 2],
    /// Duration in one direction, seconds.
    pub takes: f64,
}

/// An object that is not in the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Outline at the start of the run.
    pub outline: Outline,
    /// Movement, if any.
    pub walk: Option<Oscillation>,
}

/// The surroundings of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Surroundings {
    /// Temperature of the air, °C.
    pub temperature: f64,
    /// Obstacles.
    pub obstacles: Vec<Obstacle>,
}

/// Reads `[world]`; the default is an empty room of 20 °C.
pub(crate) fn read(root: &Table<'_>) -> Result<Surroundings, FileError> {
    let Some(node) = root.get("world") else {
        return Ok(Surroundings { temperature: ROOM, obstacles: Vec::new() });
    };
    let table = node.table(&KEYS)?;
    let obstacles = match table.get("obstacle") {
        Some(list) => {
            let unit = table.require("unit")?.unit_of_length()?;
            list.items()?.into_iter().map(|node| obstacle(node, unit)).collect::<Result<_, _>>()?
        }
        None => Vec::new(),
    };
    Ok(Surroundings { temperature: temperature(Some(&table))?, obstacles })
}

/// The optional key `temperature` of an optional table, °C; that of a room by default.
pub(crate) fn temperature(table: Option<&Table<'_>>) -> Result<f64, FileError> {
    let Some(node) = table.and_then(|table| table.get("temperature")) else {
        return Ok(ROOM);
    };
    let celsius = node.quantity(&TEMPERATURE)?;
    node.check(celsius, (COLDEST..=HOTTEST).contains(&celsius), "from -40 to 85 degC")
}

fn obstacle(node: Node<'_>, unit: &Unit) -> Result<Obstacle, FileError> {
    let table = node.table(&OBSTACLE_KEYS)?;
    Ok(Obstacle { outline: outline(&table, unit)?, walk: walk(&table, unit)? })
}

fn outline(table: &Table<'_>, unit: &Unit) -> Result<Outline, FileError> {
    if let Some(centre) = table.get("centre") {
        let radius_node = table.require("radius")?;
        let radius = radius_node.quantity(&LENGTH)?;
        let radius = radius_node.check(radius, radius > 0.0, "positive")?;
        return Ok(Outline::Circle { centre: centre.point(unit)?, radius });
    }
    let from = table.require("from")?.point(unit)?;
    let to_node = table.require("to")?;
    let to = to_node.point(unit)?;
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    to_node.check(length, length > 0.0, "different from `from`: the obstacle has no length")?;
    Ok(Outline::Face { from, to })
}

fn walk(table: &Table<'_>, unit: &Unit) -> Result<Option<Oscillation>, FileError> {
    let Some(by) = table.get("walk") else {
        return Ok(None);
    };
    let takes_node = table.require("takes")?;
    let takes = takes_node.quantity(&TIME)?;
    let takes = takes_node.check(takes, takes > 0.0, "positive")?;
    Ok(Some(Oscillation { by: by.point(unit)?, takes }))
}
