//! The surroundings that are not in the map: air, furniture, people.

use crate::document::{Node, Table};
use crate::keys::{Key, Section, Value, depends, number, optional, other};
use crate::quantity::{LENGTH, TEMPERATURE, TIME, Unit};

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

#[rustfmt::skip]
pub(crate) static WORLD: Section<f64> = Section { name: "world", usual: || 20.0, keys: &[
    optional(Key::new("temperature", Value::Number(&TEMPERATURE, ("-40 degC", "85 degC"), |celsius| celsius), "temperature of the air")),
    depends(other("unit", "`\"m\"`, `\"cm\"` or `\"mm\"`", "unit of the coordinates. Required with obstacles")),
    optional(other("obstacle", "tables", "standing or moving obstacles, round or flat")),
] };

/// Radius and `takes` of an obstacle.
#[rustfmt::skip]
pub(crate) static OBSTACLE: Section<(f64, f64)> = Section { name: "obstacle", usual: || (0.0, 0.0), keys: &[
    depends(other("centre", "within 8 km of the origin", "centre of a round one")),
    depends(number("radius", &LENGTH, ("0.1 mm", "1000 m"), |o| &mut o.0, "radius of a round one")),
    depends(other("from", "within 8 km of the origin", "one end of a flat one")),
    depends(other("to", "different from `from`", "the other end")),
    optional(other("walk", "within 8 km", "by what x and y it moves, and back, repeatedly")),
    depends(number("takes", &TIME, ("1 ms", "1000000 s"), |o| &mut o.1, "how long it moves in one direction. Required with `walk`")),
] };

/// Reads `[world]`; without it, an empty room of the usual temperature.
pub(crate) fn read(root: &Table<'_>) -> Surroundings {
    let usual = (WORLD.usual)();
    let Some(node) = root.get("world") else {
        return Surroundings { temperature: usual, obstacles: Vec::new() };
    };
    let table = node.table(&WORLD.names());
    let obstacles = table.get("obstacle").map_or_else(Vec::new, |list| {
        let unit = table.require("unit").unit_of_length();
        list.items().into_iter().map(|node| obstacle(node, unit)).collect()
    });
    Surroundings { temperature: WORLD.read_from(&table, usual), obstacles }
}

fn obstacle(node: Node<'_>, unit: &Unit) -> Obstacle {
    let table = node.table(&OBSTACLE.names());
    let (radius, takes) = OBSTACLE.read_from(&table, (OBSTACLE.usual)());
    let walk = table.get("walk").map(|by| {
        table.require("takes");
        Oscillation { by: by.point(unit), takes }
    });
    Obstacle { outline: outline(&table, unit, radius), walk }
}

fn outline(table: &Table<'_>, unit: &Unit, radius: f64) -> Outline {
    if let Some(centre) = table.get("centre") {
        table.require("radius");
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
