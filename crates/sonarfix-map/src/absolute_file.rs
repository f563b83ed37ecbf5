//! Reads the `[absolute]` table of a scenario: sensors that measure heading, position or pose from outside.

use crate::document::{Node, Table};
use crate::quantity::{ANGLE, LENGTH};

/// When a sensor measures, and how often it is wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Time between two measurements, µs.
    pub period: u64,
    /// Time from a measurement to its arrival, µs.
    pub delay: u64,
    /// Probability that a measurement is an outlier.
    pub outliers: f64,
}

impl Sampling {
    /// Every 0.73 s, between the samples of the encoders, and 20 ms late.
    pub const EXAMPLE: Self = Self { period: 730_000, delay: 20_000, outliers: 0.0 };
}

/// A sensor of the heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingSensor {
    /// When it measures.
    pub sampling: Sampling,
    /// Standard deviation of its noise, radians.
    pub deviation: f64,
}

impl HeadingSensor {
    /// A calibrated compass that its surroundings disturb little: 2°, every 0.73 s and 20 ms late.
    pub const COMPASS: Self =
        Self { sampling: Sampling::EXAMPLE, deviation: 2.0 * std::f64::consts::PI / 180.0 };
}

/// A sensor of the position, or of the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionSensor {
    /// When it measures.
    pub sampling: Sampling,
    /// Standard deviation of the noise of x and of y, metres.
    pub deviation: f64,
    /// Standard deviation of the heading, radians; `None` if it does not measure it.
    pub heading_deviation: Option<f64>,
}

/// The sensors that measure from outside.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AbsoluteSensors {
    /// A compass.
    pub heading: Option<HeadingSensor>,
    /// A beacon or a camera.
    pub position: Option<PositionSensor>,
}

/// The sensors of a scenario.
pub(crate) fn read(root: &Table<'_>) -> AbsoluteSensors {
    let Some(node) = root.get("absolute") else {
        return AbsoluteSensors::default();
    };
    let table = node.table(&["heading", "position"]);
    AbsoluteSensors {
        heading: table.get("heading").map(read_heading),
        position: table.get("position").map(read_position),
    }
}

fn read_heading(node: Node<'_>) -> HeadingSensor {
    let table = node.table(&["deviation", "period", "delay", "outliers"]);
    HeadingSensor {
        sampling: read_sampling(&table),
        deviation: positive(&table, "deviation", &ANGLE),
    }
}

fn read_position(node: Node<'_>) -> PositionSensor {
    let keys = ["deviation", "heading_deviation", "period", "delay", "outliers"];
    let table = node.table(&keys);
    PositionSensor {
        sampling: read_sampling(&table),
        deviation: positive(&table, "deviation", &LENGTH),
        heading_deviation: table
            .get("heading_deviation")
            .map(|_| positive(&table, "heading_deviation", &ANGLE)),
    }
}

fn positive(table: &Table<'_>, key: &str, dimension: &crate::quantity::Dimension) -> f64 {
    let node = table.require(key);
    let value = node.quantity(dimension);
    node.check(value, value > 0.0, "positive")
}

fn read_sampling(table: &Table<'_>) -> Sampling {
    let outliers = table.get("outliers").map_or(0.0, |node| {
        let share = node.fraction();
        node.check(share, (0.0..=1.0).contains(&share), "between 0 and 1")
    });
    Sampling {
        period: table.require("period").period().to_micros(),
        delay: table.get("delay").map_or(0, |node| node.span().to_micros()),
        outliers,
    }
}
