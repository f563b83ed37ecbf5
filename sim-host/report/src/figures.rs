//! The content of each figure. On a page about the paper they have its numbers, 2 to 6.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use sonarfix_sim::trace::{Calibration, Pose, Tick, Trace};

use super::axis::Axis;
use super::chart::{BROAD, Chart, DrawError, HAIRLINE, LINE, Layer, Shape, plot_size};
use super::palette::Role;
use super::points::Point;

/// Indices of the deviations in [`sonarfix_sim::STATES`].
const X: usize = 0;
const Y: usize = 1;
const HEADING: usize = 2;
const SCALE_LEFT: usize = 4;

/// Height of a figure over time, pixels.
const TIME_HEIGHT: u16 = 350;
/// Limits of the height of the trajectory figure, pixels: it follows the shape of the map.
const FLOOR_HEIGHT: Range<u16> = 400..780;

/// Margin around the map, as a fraction of its larger side.
const MARGIN: f64 = 0.04;
/// Minimum extent of the trajectory figure, metres, for a robot that does not move.
const LEAST_SPAN: f64 = 1.0;
/// Minimum extent of a figure over time, seconds, for a run of one tick.
const LEAST_TIME: f64 = 1.0;
/// Margin above and below the values over time, as a fraction of their range.
const HEADROOM: f64 = 0.06;

/// The share of the values, at either end, that a figure may clip to make the rest legible: the
/// first seconds of a run, while the filter converges.
const TAIL: f64 = 0.04;
/// A figure clips its tails if they would make it this many times taller.
const DWARFED: f64 = 4.0;

const MM_PER_M: f64 = 1_000.0;
const PER_MILLE: f64 = 1_000.0;

/// A drawn figure.
pub(super) struct Figure {
    /// The number of the corresponding figure of the paper.
    pub(super) number: u8,
    /// The name of its file.
    pub(super) file: &'static str,
    /// The caption.
    pub(super) caption: &'static str,
    /// What the paper calls things in it.
    pub(super) paper: &'static str,
    /// The picture.
    pub(super) svg: String,
}

/// A figure before it is drawn.
struct Plan {
    number: u8,
    file: &'static str,
    caption: &'static str,
    paper: &'static str,
    chart: fn(&Trace) -> Chart<'static>,
}

/// The figures, in the order of the paper.
const PLANS: [Plan; 5] = [
    Plan {
        number: 2,
        file: "trajectory.svg",
        caption: "The path over the floor: with the localizer and by the encoders \
                  alone. Both axes have the same scale. A path that leaves the \
                  map is cut off.",
        paper: " In the paper, A is the localizer and B the encoders alone.",
        chart: trajectory,
    },
    Plan {
        number: 3,
        file: "heading-error.svg",
        caption: "Estimated minus true heading, where the truth is known, and one standard \
                  deviation of the filter on either side of zero. Initial values that would \
                  dwarf the rest are clipped.",
        paper: "",
        chart: heading,
    },
    Plan {
        number: 4,
        file: "sigma-x.svg",
        caption: "Standard deviation of X and, where the truth is known, the absolute error.",
        paper: "",
        chart: |trace| position(trace, "X", X, |pose| pose.x),
    },
    Plan {
        number: 5,
        file: "sigma-y.svg",
        caption: "The same for Y. A deviation grows while no wall across its axis is measured, \
                  and grows more slowly once the errors of the encoders are estimated.",
        paper: "",
        chart: |trace| position(trace, "Y", Y, |pose| pose.y),
    },
    Plan {
        number: 6,
        file: "scale-left.svg",
        caption: "The estimated scale error of the left wheel, one standard deviation on \
                  either side and, where it is known, the true value. Initial values that \
                  would dwarf the rest are clipped.",
        paper: "",
        chart: scale_left,
    },
];

/// Draws every figure; none for an empty trace.
///
/// # Errors
/// The name of the file and the error of the first figure that cannot be drawn.
pub(super) fn draw(trace: &Trace) -> Result<Vec<Figure>, (&'static str, DrawError)> {
    if trace.ticks.is_empty() {
        return Ok(Vec::new());
    }
    let figure = |Plan { number, file, caption, paper, chart }| {
        let svg = chart(trace).svg().map_err(|error| (file, error))?;
        Ok(Figure { number, file, caption, paper, svg })
    };
    PLANS.into_iter().map(figure).collect()
}

/// Figure 2.
fn trajectory(trace: &Trace) -> Chart<'static> {
    let truth = places(trace, |tick| tick.truth.map(|truth| truth.pose));
    let estimate = places(trace, |tick| Some(tick.estimate.pose));
    let encoders = places(trace, |tick| Some(tick.odometry));
    let (bounds_x, bounds_y) = floor(trace, &truth, &estimate);
    let height = floor_height(&bounds_x, &bounds_y);
    let (x, y) = equal_scale(bounds_x, bounds_y, plot_size(height));
    let start = truth.first().or(estimate.first()).copied();

    let mut layers: Vec<Layer<'static>> = trace.walls.iter().map(wall).collect();
    layers.push(path("encoders alone", Role::Encoders, LINE, encoders));
    layers.extend((!truth.is_empty()).then(|| path("true", Role::Truth, BROAD, truth)));
    layers.push(path("estimated", Role::Estimate, LINE, estimate));
    let dot = |at| Layer { label: "start", role: Role::Ink, shape: Shape::Dot(at) };
    layers.extend(start.map(dot));
    Chart {
        title: "Trajectory".into(),
        x: Axis::linear("X (m)", x),
        y: Axis::linear("Y (m)", y),
        height,
        layers,
    }
}

/// Figure 3.
fn heading(trace: &Trace) -> Chart<'static> {
    let degrees = |tick: &Tick| {
        let truth = tick.truth?.pose.heading;
        Some(wrap(tick.estimate.pose.heading - truth).to_degrees())
    };
    let error = over_time(trace, degrees);
    let sigma = over_time(trace, |tick| Some(deviation::<HEADING>(tick).to_degrees()));
    let minus: Vec<Point> = sigma.iter().map(|(time, sigma)| (*time, -sigma)).collect();
    let title = if error.is_empty() { "Deviation of heading" } else { "Error of heading" };
    let y = legible(error.iter().chain(&sigma).chain(&minus));
    let mut layers = vec![band(minus, sigma)];
    layers.extend(
        (!error.is_empty()).then(|| line("estimate − truth", Role::Error, HAIRLINE, error)),
    );
    chart_over_time(trace, title.into(), Axis::linear("heading (°)", y), layers)
}

/// Figures 4 and 5.
fn position(trace: &Trace, name: &str, state: usize, along: fn(&Pose) -> f64) -> Chart<'static> {
    let millimetres = |tick: &Tick| {
        let truth = along(&tick.truth?.pose);
        Some((along(&tick.estimate.pose) - truth).abs() * MM_PER_M)
    };
    let error = over_time(trace, millimetres);
    let sigma =
        over_time(trace, |tick| tick.estimate.deviation.get(state).map(|sigma| sigma * MM_PER_M));
    let y = magnitude(&format!("{name} (mm)"), &sigma, &error);
    let mut layers = Vec::new();
    layers.extend(
        (!error.is_empty()).then(|| line("|estimate − truth|", Role::Error, HAIRLINE, error)),
    );
    layers.push(line("σ", Role::Estimate, LINE, sigma));
    chart_over_time(trace, format!("Deviation of {name}"), y, layers)
}

/// Figure 6.
fn scale_left(trace: &Trace) -> Chart<'static> {
    let of = |calibration: Calibration| calibration.scale_left * PER_MILLE;
    let beside = |sigmas: f64| {
        move |tick: &Tick| {
            let sigma = deviation::<SCALE_LEFT>(tick) * PER_MILLE;
            Some(of(tick.estimate.calibration) + sigmas * sigma)
        }
    };
    let estimate = over_time(trace, |tick| Some(of(tick.estimate.calibration)));
    let (lower, upper) = (over_time(trace, beside(-1.0)), over_time(trace, beside(1.0)));
    let truth = over_time(trace, |tick| tick.truth?.calibration.map(of));
    let y = legible(estimate.iter().chain(&lower).chain(&upper).chain(&truth));
    let mut layers = vec![band(lower, upper), line("estimated", Role::Estimate, LINE, estimate)];
    layers.extend((!truth.is_empty()).then_some(Layer {
        label: "true",
        role: Role::Truth,
        shape: Shape::Dotted(truth),
    }));
    let title = "Scale error of the left wheel, S_L";
    chart_over_time(trace, title.into(), Axis::linear("S_L (10⁻³)", y), layers)
}

fn chart_over_time(
    trace: &Trace,
    title: String,
    y: Axis,
    layers: Vec<Layer<'static>>,
) -> Chart<'static> {
    // From zero, the start of the run, even if the first tick is later.
    let times = span(trace.ticks.iter().map(|tick| tick.time).chain([0.0])).unwrap_or(0.0..0.0);
    let x = Axis::linear("time (s)", times.start..times.end.max(times.start + LEAST_TIME));
    Chart { title, x, y, height: TIME_HEIGHT, layers }
}

fn line(label: &'static str, role: Role, width: u16, points: Vec<Point>) -> Layer<'static> {
    Layer { label, role, shape: Shape::Line(width, points) }
}

fn path(label: &'static str, role: Role, width: u16, points: Vec<Point>) -> Layer<'static> {
    Layer { label, role, shape: Shape::Path(width, points) }
}

fn band(lower: Vec<Point>, upper: Vec<Point>) -> Layer<'static> {
    Layer { label: "±σ", role: Role::Band, shape: Shape::Band(lower, upper) }
}

fn wall(wall: &sonarfix_sim::trace::Wall) -> Layer<'static> {
    line("walls", Role::Wall, BROAD, vec![wall.from.into(), wall.to.into()])
}

fn places(trace: &Trace, pose: impl Fn(&Tick) -> Option<Pose>) -> Vec<Point> {
    let points = trace.ticks.iter().filter_map(pose).map(|pose| (pose.x, pose.y));
    points.filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
}

fn over_time(trace: &Trace, value: impl Fn(&Tick) -> Option<f64>) -> Vec<Point> {
    let points = trace.ticks.iter().filter_map(|tick| Some((tick.time, value(tick)?)));
    points.filter(|(time, value)| time.is_finite() && value.is_finite()).collect()
}

fn deviation<const STATE: usize>(tick: &Tick) -> f64 {
    tick.estimate.deviation.get(STATE).copied().unwrap_or(f64::NAN)
}

/// The angle in (−π, π].
fn wrap(angle: f64) -> f64 {
    PI - (PI - angle).rem_euclid(TAU)
}

/// Minimum and maximum of the finite values.
fn span(values: impl IntoIterator<Item = f64>) -> Option<Range<f64>> {
    values.into_iter().filter(|value| value.is_finite()).fold(None, |span, value| {
        let Range { start, end } = span.unwrap_or(value..value);
        Some(start.min(value)..end.max(value))
    })
}

/// The range, extended to a minimum length.
fn widened(range: Range<f64>, least: f64) -> Range<f64> {
    let short = (least - (range.end - range.start)).max(0.0);
    range.start - short / 2.0..range.end + short / 2.0
}

/// The extent of the trajectory figure: the map and the truth; without a map, the paths. Dead
/// reckoning is excluded, because it may drift arbitrarily far.
fn floor(trace: &Trace, truth: &[Point], estimate: &[Point]) -> (Range<f64>, Range<f64>) {
    let walls = trace.walls.iter().flat_map(|wall| [wall.from, wall.to]).map(Point::from);
    let mut points: Vec<Point> = walls.chain(truth.iter().copied()).collect();
    if points.is_empty() {
        points.extend_from_slice(estimate);
    }
    let x = span(points.iter().map(|point| point.0)).unwrap_or(0.0..0.0);
    let y = span(points.iter().map(|point| point.1)).unwrap_or(0.0..0.0);
    let margin = MARGIN * (x.end - x.start).max(y.end - y.start);
    let blank = |range: Range<f64>| widened(range.start - margin..range.end + margin, LEAST_SPAN);
    (blank(x), blank(y))
}

/// The height at which the map fills the width of the figure, within the limits.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the heights allowed"
)]
fn floor_height(x: &Range<f64>, y: &Range<f64>) -> u16 {
    let (width, height) = plot_size(FLOOR_HEIGHT.start);
    let around = f64::from(FLOOR_HEIGHT.start) - height;
    let fitting = around + width * (y.end - y.start) / (x.end - x.start);
    fitting.clamp(FLOOR_HEIGHT.start.into(), FLOOR_HEIGHT.end.into()) as u16
}

/// Extends one of two ranges to give both axes the same scale.
fn equal_scale(
    x: Range<f64>,
    y: Range<f64>,
    (width, height): (f64, f64),
) -> (Range<f64>, Range<f64>) {
    let per_pixel = ((x.end - x.start) / width).max((y.end - y.start) / height);
    (widened(x, per_pixel * width), widened(y, per_pixel * height))
}

/// The range of the values, without tails that would dwarf the rest.
fn legible<'a>(points: impl Iterator<Item = &'a Point>) -> Range<f64> {
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
fn magnitude(label: &str, sigma: &[Point], error: &[Point]) -> Axis {
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
