//! The content of each figure. In the report of the paper's scenario, the figures that the paper has keep its numbers, 2 to 6.

mod calibration;
mod inputs;
mod pings;
mod spread;
mod values;

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use sonarfix_sim::trace::{Pose, Tick, Trace};
use sonarfix_sim::world::obstacle::{Obstacle, Outline};

use super::axis::Axis;
use super::chart::{
    BROAD, Chart, DrawError, HAIRLINE, LINE, Layer, NARROW, Shape, WIDE, plot_size,
};
use super::palette::Role;
use super::points::Point;
use values::{
    MM_PER_M, band, chart_over_time, legible, line, magnitude, over_time, path, span, widened,
};

pub(super) use values::Data;

/// Indices of the deviations in [`sonarfix_sim::STATES`].
const X: usize = 0;
const Y: usize = 1;
const HEADING: usize = 2;

/// Limits of the height of the trajectory figure, pixels: it follows the shape of the map.
const FLOOR_HEIGHT: Range<u16> = 400..780;

/// Margin around the map, as a fraction of its larger side.
const MARGIN: f64 = 0.04;
/// How much farther than the wheels a pose moves in a jump, metres.
const JUMP: f64 = 0.25;
/// Minimum extent of the trajectory figure, metres, for a robot that does not move.
const LEAST_SPAN: f64 = 1.0;

/// A drawn figure.
pub(super) struct Figure {
    /// The number of the corresponding figure of the paper, if it has one.
    pub(super) number: Option<u8>,
    /// The name of its file.
    pub(super) file: &'static str,
    /// The caption.
    pub(super) caption: String,
    /// What the paper calls things in it.
    pub(super) paper: &'static str,
    /// The picture.
    pub(super) svg: String,
    /// The picture for a narrow page.
    pub(super) narrow: String,
}

/// A figure before it is drawn.
struct Plan {
    number: Option<u8>,
    file: &'static str,
    caption: &'static str,
    paper: &'static str,
    /// The chart at a width; none if the run has nothing to show in it.
    chart: fn(Data<'_>, u16) -> Option<Chart<'static>>,
}

/// The figures, those of the paper in its order.
const PLANS: [Plan; 13] = [
    Plan {
        number: Some(2),
        file: "trajectory.svg",
        caption: "The path over the floor: with the localizer and by the encoders \
                  alone. Both axes have the same scale. A path that is far \
                  off the map is cut off; where a pose jumps, it has a gap. Furniture and people are not in the map; a dotted line is where one walks.",
        paper: " In the paper, A is the localizer and B the encoders alone.",
        chart: |data, width| Some(trajectory(data.trace, width)),
    },
    Plan {
        number: Some(3),
        file: "heading-error.svg",
        caption: "Estimated minus true heading, where the truth is known, and one standard \
                  deviation of the filter on either side of zero. Initial values that would \
                  dwarf the rest are clipped.",
        paper: "",
        chart: |data, width| Some(heading(data.trace, width)),
    },
    Plan {
        number: Some(4),
        file: "sigma-x.svg",
        caption: "Standard deviation of X and, where the truth is known, the absolute error.",
        paper: "",
        chart: |data, width| Some(position(data.trace, width, "X", X, |pose| pose.x)),
    },
    Plan {
        number: Some(5),
        file: "sigma-y.svg",
        caption: "The same for Y. A deviation grows while no wall across its axis is measured, \
                  and grows more slowly once the errors of the encoders are estimated.",
        paper: "",
        chart: |data, width| Some(position(data.trace, width, "Y", Y, |pose| pose.y)),
    },
    Plan {
        number: Some(6),
        file: "scale-left.svg",
        caption: calibration::CAPTION,
        paper: "",
        chart: |data, width| calibration::chart(data.trace, width, &calibration::SCALE_LEFT),
    },
    Plan {
        number: None,
        file: "scale-right.svg",
        caption: "The same for the scale error of the right wheel.",
        paper: "",
        chart: |data, width| calibration::chart(data.trace, width, &calibration::SCALE_RIGHT),
    },
    Plan {
        number: None,
        file: "track-width.svg",
        caption: "The same for the track width.",
        paper: "",
        chart: |data, width| calibration::chart(data.trace, width, &calibration::TRACK_WIDTH),
    },
    Plan {
        number: None,
        file: "range-scale.svg",
        caption: "The same for the scale error of the ranges.",
        paper: "",
        chart: |data, width| calibration::chart(data.trace, width, &calibration::RANGE_SCALE),
    },
    Plan {
        number: None,
        file: "gyro-bias.svg",
        caption: "The estimated bias of the gyro, one standard deviation on either side and, where it is known, the true value. \
                  A dot is a slip of a wheel: wheels and gyro turned differently by more than their noise.",
        paper: "",
        chart: |data, width| inputs::gyro_bias(data.trace, width),
    },
    Plan {
        number: None,
        file: "innovations.svg",
        caption: "Measured minus expected range of every ping with an echo, and three standard deviations of \
                  the innovation. Whether a range is used is decided by the probability that the echo is the wall's, \
                  which falls below the limit of 2 % near this band: \"gated\". Ranges with a lower weight may be clutter. \
                  Values far beyond the band are clipped.",
        paper: "",
        chart: |data, width| pings::innovations(data.trace, width),
    },
    Plan {
        number: None,
        file: "absolute.svg",
        caption: "Headings, positions and poses from outside: the root of their normalized innovation squared over its dimensions, \
                  which is about one where noise and covariance are as assumed. Outliers are gated; those that came too late are at zero. \
                  Values far above are clipped.",
        paper: "",
        chart: |data, width| inputs::absolute(data.trace, width),
    },
    Plan {
        number: None,
        file: "verdict.svg",
        caption: "The health verdict.",
        paper: "",
        chart: |data, width| Some(pings::verdict(data.trace, width)),
    },
    Plan {
        number: None,
        file: "spread.svg",
        caption: "",
        paper: "",
        chart: |data, width| spread::chart(data, width),
    },
];

/// Draws every figure; none for an empty trace.
///
/// # Errors
/// The name of the file and the error of the first figure that cannot be drawn.
pub(super) fn draw(data: Data<'_>) -> Result<Vec<Figure>, (&'static str, DrawError)> {
    if data.trace.ticks.is_empty() {
        return Ok(Vec::new());
    }
    let figure = |Plan { number, file, caption, paper, chart }| {
        let drawn = |width| {
            let svg = chart(data, width).map(|chart| chart.svg()).transpose();
            svg.map_err(|error| (file, error))
        };
        let Some((svg, narrow)) = drawn(WIDE)?.zip(drawn(NARROW)?) else {
            return Ok(None);
        };
        let spread = data.spread.filter(|_| caption.is_empty());
        let caption = spread.map_or_else(|| caption.to_owned(), spread::caption);
        Ok(Some(Figure { number, file, caption, paper, svg, narrow }))
    };
    PLANS.into_iter().filter_map(|plan| figure(plan).transpose()).collect()
}

/// Figure 2.
fn trajectory(trace: &Trace, width: u16) -> Chart<'static> {
    let truth = pieces(trace, |tick| tick.truth.map(|truth| truth.pose));
    let estimate = pieces(trace, |tick| Some(tick.estimate.pose));
    let encoders = pieces(trace, |tick| Some(tick.odometry)).concat();
    let (bounds_x, bounds_y) = floor(trace, &truth.concat(), &estimate.concat());
    let start = truth.iter().chain(&estimate).flatten().next().copied();

    let mut layers: Vec<Layer<'static>> = trace.walls.iter().map(wall).collect();
    layers.extend(trace.obstacles.iter().flat_map(obstacle));
    layers.push(path("encoders alone", Role::Encoders, LINE, encoders));
    layers.extend(truth.into_iter().map(|piece| path("true", Role::Truth, BROAD, piece)));
    layers.extend(estimate.into_iter().map(|piece| path("estimated", Role::Estimate, LINE, piece)));
    let dot = |at| Layer { label: "start", role: Role::Ink, shape: Shape::Dot(at) };
    layers.extend(start.map(dot));
    let height = floor_height(&bounds_x, &bounds_y, width, &layers);
    let (x, y) = equal_scale(bounds_x, bounds_y, plot_size(width, height, &layers));
    Chart {
        title: "Trajectory".into(),
        x: Axis::linear("X (m)", x),
        y: Axis::linear("Y (m)", y),
        width,
        height,
        layers,
    }
}

/// An obstacle at the start, and where it walks.
fn obstacle(obstacle: &Obstacle) -> Vec<Layer<'static>> {
    /// Corners of a circle.
    const CORNERS: u8 = 24;
    let outline = match obstacle.outline {
        Outline::Circle { centre: [x, y], radius } => (0..=CORNERS)
            .map(|n| TAU * f64::from(n) / f64::from(CORNERS))
            .map(|angle| (x + radius * angle.cos(), y + radius * angle.sin()))
            .collect(),
        Outline::Face(face) => face.ends().map(Point::from).to_vec(),
    };
    let first = outline.first().copied();
    let walk = obstacle.walk.zip(first).map(|(walk, (x, y))| {
        let shape = Shape::Dotted(vec![(x, y), (x + walk.by[0], y + walk.by[1])]);
        Layer { label: "furniture, people", role: Role::Obstacle, shape }
    });
    let outline = path("furniture, people", Role::Obstacle, LINE, outline);
    std::iter::once(outline).chain(walk).collect()
}

/// Figure 3.
fn heading(trace: &Trace, width: u16) -> Chart<'static> {
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
    chart_over_time(trace, width, title.into(), Axis::linear("heading (°)", y), layers)
}

/// Figures 4 and 5.
fn position(
    trace: &Trace,
    width: u16,
    name: &str,
    state: usize,
    along: fn(&Pose) -> f64,
) -> Chart<'static> {
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
    chart_over_time(trace, width, format!("Deviation of {name}"), y, layers)
}

fn wall(wall: &sonarfix_sim::trace::Wall) -> Layer<'static> {
    line("walls", Role::Wall, BROAD, vec![wall.from.into(), wall.to.into()])
}

/// The places of a pose. A new piece begins where it moves farther than the wheels: the robot was carried away, or has found
/// another pose, which is no path.
fn pieces(trace: &Trace, pose: impl Fn(&Tick) -> Option<Pose>) -> Vec<Vec<Point>> {
    let distance = |from: Point, to: Point| (to.0 - from.0).hypot(to.1 - from.1);
    let mut pieces: Vec<Vec<Point>> = Vec::new();
    let mut last: Option<(Point, Point)> = None;
    for tick in &trace.ticks {
        let place = |pose: Pose| (pose.x, pose.y);
        let Some(at) = pose(tick).map(place).filter(|(x, y)| x.is_finite() && y.is_finite()) else {
            continue;
        };
        let wheels = place(tick.odometry);
        let is_jump = last.is_some_and(|(before, wheels_before)| {
            distance(before, at) > distance(wheels_before, wheels) + JUMP
        });
        match pieces.last_mut() {
            Some(piece) if !is_jump => piece.push(at),
            _ => pieces.push(vec![at]),
        }
        last = Some((at, wheels));
    }
    pieces
}

fn deviation<const STATE: usize>(tick: &Tick) -> f64 {
    tick.estimate.deviation.get(STATE).copied().unwrap_or(f64::NAN)
}

/// The angle in (−π, π].
fn wrap(angle: f64) -> f64 {
    PI - (PI - angle).rem_euclid(TAU)
}

/// The extent of the trajectory figure: the map and the truth, and the estimate as far as it is not farther from them than they
/// are wide; without a map, the paths. Dead reckoning is excluded, because it may drift arbitrarily far.
fn floor(trace: &Trace, truth: &[Point], estimate: &[Point]) -> (Range<f64>, Range<f64>) {
    let walls = trace.walls.iter().flat_map(|wall| [wall.from, wall.to]).map(Point::from);
    let mut points: Vec<Point> = walls.chain(truth.iter().copied()).collect();
    if points.is_empty() {
        points.extend_from_slice(estimate);
    }
    let extent = |points: &[Point]| {
        let x = span(points.iter().map(|point| point.0)).unwrap_or(0.0..0.0);
        (x, span(points.iter().map(|point| point.1)).unwrap_or(0.0..0.0))
    };
    let (x, y) = extent(&points);
    let room = (x.end - x.start).max(y.end - y.start);
    let is_near = |at: f64, of: &Range<f64>| at >= of.start - room && at <= of.end + room;
    points.extend(estimate.iter().filter(|at| is_near(at.0, &x) && is_near(at.1, &y)));
    let (x, y) = extent(&points);
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
fn floor_height(x: &Range<f64>, y: &Range<f64>, width: u16, layers: &[Layer<'_>]) -> u16 {
    let (across, height) = plot_size(width, FLOOR_HEIGHT.start, layers);
    let around = f64::from(FLOOR_HEIGHT.start) - height;
    let fitting = around + across * (y.end - y.start) / (x.end - x.start);
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
