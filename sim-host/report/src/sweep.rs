//! The figure of a sweep: the position error over the values of a key.

use super::axis::Axis;
use super::chart::{BROAD, Chart, DrawError, Layer, Shape, WIDE};
use super::palette::Role;
use super::points::Point;

/// Height of the figure, pixels.
const HEIGHT: u16 = 350;

/// Colours of the lines, in turn.
const ROLES: [Role; 6] =
    [Role::Estimate, Role::Encoders, Role::Accepted, Role::Error, Role::Gated, Role::Wall];

/// A line of the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Its label in the legend.
    pub label: String,
    /// Value of the key and RMS position error in millimetres.
    pub points: Vec<(f64, f64)>,
}

/// The figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Label of the horizontal axis.
    pub x_label: String,
    /// The lines.
    pub lines: Vec<Line>,
}

impl Picture {
    /// Draws the figure.
    ///
    /// # Errors
    /// The error of the drawing.
    pub fn svg(&self) -> Result<String, DrawError> {
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let low = points().map(|point| point.0).fold(f64::INFINITY, f64::min);
        let high = points().map(|point| point.0).fold(f64::NEG_INFINITY, f64::max);
        let margin = if high > low { 0.04 * (high - low) } else { 0.5 };
        let top = points().map(|point| point.1).fold(0.0, f64::max);
        let layers = self.lines.iter().zip(ROLES.into_iter().cycle());
        let chart = Chart {
            title: "RMS position error along the path".into(),
            x: Axis::linear(&self.x_label, low - margin..high + margin),
            y: Axis::linear("position (mm)", 0.0..if top > 0.0 { 1.08 * top } else { 1.0 }),
            width: WIDE,
            height: HEIGHT,
            layers: layers.flat_map(|(line, role)| layers_of(line, role)).collect(),
        };
        chart.svg()
    }
}

/// A line with a dot at each value.
fn layers_of(line: &Line, role: Role) -> Vec<Layer<'_>> {
    let label = line.label.as_str();
    let dots = line.points.iter().map(|&at: &Point| Layer { label, role, shape: Shape::Dot(at) });
    let path = Layer { label, role, shape: Shape::Path(BROAD, line.points.clone()) };
    std::iter::once(path).chain(dots).collect()
}
