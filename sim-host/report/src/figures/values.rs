//! What the figures have in common: values over time, their layers, the ranges of their axes.

use std::ops::Range;

use sonarfix_sim::spread::Spread;
use sonarfix_sim::trace::{Tick, Trace};

use super::super::axis::Axis;
use super::super::chart::{Chart, Layer, Shape, WIDE};
use super::super::palette::Role;
use super::super::points::Point;

/// Height of a figure over time, pixels.
const TIME_HEIGHT: u16 = 350;
/// The same on a narrow page.
const NARROW_TIME_HEIGHT: u16 = 280;
/// Minimum extent of a figure over time, seconds, for a run of one tick.
const LEAST_TIME: f64 = 1.0;
/// Margin above and below the values over time, as a fraction of their range.
const HEADROOM: f64 = 0.06;
/// The share of the values, at either end, that a figure may clip to make the rest legible: the
/// first seconds of a run, while the filter converges.
const TAIL: f64 = 0.04;
/// A figure clips its tails if they would make it this many times taller.
const DWARFED: f64 = 4.0;
/// Millimetres in a metre.
pub(super) const MM_PER_M: f64 = 1_000.0;

/// What the figures show.
#[derive(Clone, Copy)]
pub(in super::super) struct Data<'a> {
    /// One run.
    pub(in super::super) trace: &'a Trace,
    /// The spread over many, if there are.
    pub(in super::super) spread: Option<&'a Spread>,
}

pub(super) fn chart_over_time(
    trace: &Trace,
    width: u16,
    title: String,
    y: Axis,
    layers: Vec<Layer<'static>>,
) -> Chart<'static> {
    // From zero, the start of the run, even if the first tick is later.
    let times = span(trace.ticks.iter().map(|tick| tick.time).chain([0.0])).unwrap_or(0.0..0.0);
    let x = Axis::linear("time (s)", times.start..times.end.max(times.start + LEAST_TIME));
    let height = if width < WIDE { NARROW_TIME_HEIGHT } else { TIME_HEIGHT };
    Chart { title, x, y, width, height, layers }
}

pub(super) fn line(
    label: &'static str,
    role: Role,
    width: u16,
    points: Vec<Point>,
) -> Layer<'static> {
    Layer { label, role, shape: Shape::Line(width, points) }
}

pub(super) fn path(
    label: &'static str,
    role: Role,
    width: u16,
    points: Vec<Point>,
) -> Layer<'static> {
    Layer { label, role, shape: Shape::Path(width, points) }
}

pub(super) fn band(lower: Vec<Point>, upper: Vec<Point>) -> Layer<'static> {
    Layer { label: "±σ", role: Role::Band, shape: Shape::Band(lower, upper) }
}

pub(super) fn over_time(trace: &Trace, value: impl Fn(&Tick) -> Option<f64>) -> Vec<Point> {
    let points = trace.ticks.iter().filter_map(|tick| Some((tick.time, value(tick)?)));
    points.filter(|(time, value)| time.is_finite() && value.is_finite()).collect()
}

/// Minimum and maximum of the finite values.
pub(super) fn span(values: impl IntoIterator<Item = f64>) -> Option<Range<f64>> {
    values.into_iter().filter(|value| value.is_finite()).fold(None, |span, value| {
        let Range { start, end } = span.unwrap_or(value..value);
        Some(start.min(value)..end.max(value))
    })
}

/// The range, extended to a minimum length.
pub(super) fn widened(range: Range<f64>, least: f64) -> Range<f64> {
    let short = (least - (range.end - range.start)).max(0.0);
    range.start - short / 2.0..range.end + short / 2.0
}

/// The range of the values, without tails that would dwarf the rest.
pub(super) fn legible<'a>(points: impl Iterator<Item = &'a Point>) -> Range<f64> {
    let mut values: Vec<f64> = points.map(|point| point.1).collect();
    values.sort_by(f64::total_cmp);
    let tail = tail_of(values.len());
    let body = values.get(tail..values.len() - tail).unwrap_or_default();
    let whole = span(values.iter().copied()).unwrap_or(0.0..0.0);
    let body = span(body.iter().copied()).unwrap_or(0.0..0.0);
    let dwarfed = whole.end - whole.start > DWARFED * (body.end - body.start);
    let chosen = if dwarfed && body.end > body.start { body } else { whole };
    let length = chosen.end - chosen.start;
    widened(chosen.start - HEADROOM * length..chosen.end + HEADROOM * length, f64::EPSILON)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "a share of a length is a length"
)]
fn tail_of(length: usize) -> usize {
    (length as f64 * TAIL) as usize
}

/// An axis from zero for magnitudes; a logarithmic one where the largest deviation is many times
/// the usual one.
pub(super) fn magnitude(label: &str, sigma: &[Point], error: &[Point]) -> Axis {
    /// Extension of a logarithmic axis below the least deviation, to show smaller errors.
    const BELOW: f64 = 3.0;
    let mut sorted: Vec<f64> = sigma.iter().map(|point| point.1).filter(|s| *s > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let least = sorted.first().copied().unwrap_or(0.0);
    let both = sigma.iter().chain(error).map(|point| point.1);
    let most = both.fold(0.0, f64::max) * (1.0 + HEADROOM);
    if usual > 0.0 && most > 2.0 * DWARFED * usual {
        return Axis::logarithmic(label, &(least / BELOW..most));
    }
    Axis::linear(label, if most > 0.0 { 0.0..most } else { 0.0..1.0 })
}
