//! The surroundings that are not in the map: air, furniture, people.

use crate::document::{Node, Table};
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
pub(crate) fn read(root: &Table<'_>) -> Surroundings {
    let Some(node) = root.get("world") else {
        return Surroundings { temperature: ROOM, obstacles: Vec::new() };
    };
    let table = node.table(&KEYS);
    let obstacles = table.get("obstacle").map_or_else(Vec::new, |list| {
        let unit = table.require("unit").unit_of_length();
        list.items().into_iter().map(|node| obstacle(node, unit)).collect()
    });
    Surroundings { temperature: temperature(Some(&table)), obstacles }
}

/// The optional key `temperature` of an optional table, °C; that of a room by default.
pub(crate) fn temperature(table: Option<&Table<'_>>) -> f64 {
    let Some(node) = table.and_then(|table| table.get("temperature")) else {
        return ROOM;
    };
    let celsius = node.quantity(&TEMPERATURE);
    node.check(celsius, (COLDEST..=HOTTEST).contains(&celsius), "from -40 to 85 degC")
}

fn obstacle(node: Node<'_>, unit: &Unit) -> Obstacle {
    let table = node.table(&OBSTACLE_KEYS);
    Obstacle { outline: outline(&table, unit), walk: walk(&table, unit) }
}

fn outline(table: &Table<'_>, unit: &Unit) -> Outline {
    if let Some(centre) = table.get("centre") {
        let radius_node = table.require("radius");
        let radius = radius_node.quantity(&LENGTH);
        let radius = radius_node.check(radius, radius > 0.0, "positive");
        return Outline::Circle { centre: centre.point(unit), radius };
    }
    let mistakes = table.mistakes();
    let from = table.require("from").point(unit);
    let to_node = table.require("to");
    let to = to_node.point(unit);
    let has_length = (to[0] - from[0]).hypot(to[1] - from[1]) > 0.0;
    let rule = "different from `from`: the obstacle has no length";
    to_node.check((), has_length || table.mistakes() > mistakes, rule);
    Outline::Face { from, to }
}

fn walk(table: &Table<'_>, unit: &Unit) -> Option<Oscillation> {
    let by = table.get("walk")?;
    let takes_node = table.require("takes");
    let takes = takes_node.quantity(&TIME);
    let takes = takes_node.check(takes, takes > 0.0, "positive");
    Some(Oscillation { by: by.point(unit), takes })
}
