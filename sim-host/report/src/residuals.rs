//! The figure of a calibration: residuals of the ranges over time.

use super::axis::Axis;
use super::chart::{Chart, DrawError, LINE, Layer, Shape, WIDE};
use super::palette::Role;

/// Height of the figure, pixels.
const HEIGHT: u16 = 350;

/// A residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Time, seconds.
    pub time: f64,
    /// Measured minus expected range, metres.
    pub value: f64,
    /// Whether it is within three deviations.
    pub is_inlier: bool,
}

/// Draws the residuals.
///
/// # Errors
/// The error of the drawing.
pub fn residuals(residuals: &[Residual]) -> Result<String, DrawError> {
    let times = || residuals.iter().map(|residual| residual.time);
    let first = times().fold(f64::INFINITY, f64::min);
    let last = times().fold(f64::NEG_INFINITY, f64::max);
    let (first, last) = if last > first { (first, last) } else { (0.0, 1.0) };
    let largest = residuals.iter().map(|residual| residual.value.abs() * 1e3).fold(1.0, f64::max);
    let zero = Layer {
        label: "expected",
        role: Role::Truth,
        shape: Shape::Path(LINE, vec![(first, 0.0), (last, 0.0)]),
    };
    let dots = residuals.iter().map(|residual| Layer {
        label: if residual.is_inlier { "used" } else { "outlier" },
        role: if residual.is_inlier { Role::Accepted } else { Role::Gated },
        shape: Shape::Dot((residual.time, residual.value * 1e3)),
    });
    let chart = Chart {
        title: "Measured minus expected range".into(),
        x: Axis::linear("time (s)", first..last),
        y: Axis::linear("residual (mm)", -1.05 * largest..1.05 * largest),
        width: WIDE,
        height: HEIGHT,
        layers: std::iter::once(zero).chain(dots).collect(),
    };
    chart.svg()
}
