//! A map with a quantity along a path, as SVG: the uncertainty by place.
//!
//! The colours are those of viridis (van der Walt and Smith, 2015), whose lightness is monotonic for
//! every kind of colour vision and in monochrome print; the darkest is the worst.

use std::fmt::Write as _;
use std::ops::Range;

use sonarfix_map::{Outline, Scenario};

use super::axis::Axis;
use super::escape::escape;
use super::palette::{Role, hex};

/// Width of the map itself, pixels.
const WIDTH: f64 = 640.0;
/// Maximum height, pixels; a taller map is made narrower.
const HEIGHT: f64 = 640.0;
/// Margin around the map, pixels.
const EDGE: f64 = 14.0;
/// Height of title and legend above it, pixels.
const HEAD: f64 = 62.0;
/// Width of the strip with the colour scale, pixels.
const SCALE: f64 = 84.0;
/// Height of the strip with the scale bar, pixels.
const FOOT: f64 = 26.0;
/// Width of the colour bar, pixels.
const BAR: f64 = 16.0;
/// Average width of a letter, pixels.
const LETTER: f64 = 7.2;
/// Widths of lines, pixels.
const PATH: f64 = 5.0;
const BLIND: f64 = 12.0;
const WALL: f64 = 1.8;

/// Number of colours.
const STEPS: u8 = 32;
/// Viridis from its yellow-green, visible on white, to its darkest.
const COLOURS: [(f64, f64, f64); 6] = [
    (170.0, 220.0, 50.0),
    (53.0, 183.0, 121.0),
    (33.0, 144.0, 141.0),
    (49.0, 104.0, 142.0),
    (68.0, 57.0, 131.0),
    (68.0, 1.0, 84.0),
];

/// An unmapped object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unmapped {
    /// A disc: centre and radius, metres.
    Round([f64; 2], f64),
    /// A face, with its ends, metres.
    Face([f64; 2], [f64; 2]),
}

/// A point of the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heat {
    /// Position, metres.
    pub at: [f64; 2],
    /// Value, in the unit of the label; positive.
    pub value: f64,
    /// Whether the point is marked.
    pub marked: bool,
}

/// A map with the quantity along a path.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeatMap {
    /// Title, also for screen readers.
    pub title: String,
    /// Quantity of the colours, with its unit.
    pub label: String,
    /// Meaning of the marks; empty without marks.
    pub mark: String,
    /// The walls, from end to end, metres.
    pub walls: Vec<[[f64; 2]; 2]>,
    /// Unmapped objects.
    pub unmapped: Vec<Unmapped>,
    /// The path, in order. Where it overlaps, the worse value is on top.
    pub path: Vec<Heat>,
    /// The values of the first and the last colour; by default the range of the path.
    pub range: Option<Range<f64>>,
}

/// The transformation from metres to pixels.
struct Place {
    per_metre: f64,
    left: f64,
    bottom: f64,
    /// The map's south-western corner.
    origin: [f64; 2],
    /// Width and height of the map, pixels.
    size: [f64; 2],
}

impl Place {
    fn of(&self, [x, y]: [f64; 2]) -> (f64, f64) {
        let (x, y) = (x - self.origin[0], y - self.origin[1]);
        (self.left + x * self.per_metre, self.bottom - y * self.per_metre)
    }
}

impl HeatMap {
    /// The map of a scenario, with an empty path.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let unmapped =
            scenario.surroundings.obstacles.iter().map(|obstacle| match obstacle.outline {
                Outline::Circle { centre, radius } => Unmapped::Round(centre, radius),
                Outline::Face { from, to } => Unmapped::Face(from, to),
            });
        let plan = scenario.path.plan();
        let corners = std::iter::once(&plan.start).chain(&plan.corners);
        Self {
            title: scenario.name.clone(),
            walls: scenario
                .floor
                .named_walls()
                .iter()
                .map(|wall| [wall.from(), wall.to()])
                .collect(),
            unmapped: unmapped.collect(),
            path: corners.map(|&at| Heat { at, value: 0.0, marked: false }).collect(),
            ..Self::default()
        }
    }

    /// The least and the greatest finite value of the path.
    #[must_use]
    pub fn values(&self) -> Option<Range<f64>> {
        let values = self.path.iter().map(|heat| heat.value).filter(|v| *v > 0.0 && v.is_finite());
        values.fold(None, |range, value| {
            let Range { start, end } = range.unwrap_or(value..value);
            Some(value.min(start)..value.max(end))
        })
    }

    /// The drawing, for a file or as part of a page.
    #[must_use]
    pub fn svg(&self) -> String {
        let mut svg = String::new();
        // Writing to a String does not fail.
        let _ = self.write(&mut svg);
        svg
    }

    fn write(&self, svg: &mut String) -> std::fmt::Result {
        let place = self.place();
        let values = self.range.clone().or_else(|| self.values());
        let axis = values.map(|values| Axis::logarithmic(&self.label, &widened(&values)));
        let scale = if axis.is_some() { SCALE } else { 0.0 };
        // Minimum width for title and legend.
        let width = (place.size[0] + 2.0 * EDGE).max(420.0) + scale;
        let height = place.bottom + EDGE + FOOT;
        let title = escape(&self.title);
        writeln!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\" aria-label=\"{title}\" \
             font-family=\"sans-serif\" font-size=\"13\" fill=\"{ink}\" stroke-linecap=\"round\" \
             stroke-linejoin=\"round\">\n<rect width=\"100%\" height=\"100%\" fill=\"{paper}\"/>\n\
             <text x=\"{EDGE}\" y=\"24\" font-size=\"16\" font-weight=\"bold\">{title}</text>",
            ink = colour_of(Role::Ink),
            paper = colour_of(Role::Paper),
        )?;
        self.write_legend(svg)?;
        self.write_walls(svg, &place)?;
        self.write_path(svg, &place, axis.as_ref())?;
        write_ends(svg, &place, &self.path)?;
        if let Some(axis) = &axis {
            write_scale(svg, axis, &place, width - scale)?;
        }
        write_metres(svg, &place)?;
        svg.push_str("</svg>\n");
        Ok(())
    }

    fn place(&self) -> Place {
        let ends = self.walls.iter().flatten().copied();
        let points: Vec<[f64; 2]> = ends.chain(self.path.iter().map(|heat| heat.at)).collect();
        let span = |of: fn(&[f64; 2]) -> f64| {
            let least = points.iter().map(of).fold(f64::INFINITY, f64::min);
            let most = points.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
            if least < most { (least, most) } else { (0.0, 1.0) }
        };
        let ((west, east), (south, north)) = (span(|point| point[0]), span(|point| point[1]));
        let per_metre = (WIDTH / (east - west)).min(HEIGHT / (north - south));
        let size = [per_metre * (east - west), per_metre * (north - south)];
        let bottom = HEAD + EDGE + size[1];
        Place { per_metre, left: EDGE, bottom, origin: [west, south], size }
    }

    fn write_legend(&self, svg: &mut String) -> std::fmt::Result {
        let mut x = EDGE;
        let mut entry = |svg: &mut String, sign: &str, text: &str| {
            let written = writeln!(
                svg,
                "<g transform=\"translate({x:.0} 46)\">{sign}\
                 <text x=\"28\" y=\"4\">{}</text></g>",
                escape(text)
            );
            x += 46.0 + text.chars().map(|_| LETTER).sum::<f64>();
            written
        };
        let line = |role, width| {
            let colour = colour_of(role);
            format!("<path d=\"M3 0H19\" stroke=\"{colour}\" stroke-width=\"{width}\"/>")
        };
        entry(svg, &line(Role::Wall, WALL), "walls of the map")?;
        if !self.unmapped.is_empty() {
            entry(svg, &line(Role::Encoders, WALL), "not in the map")?;
        }
        if self.path.iter().any(|heat| heat.marked) {
            let mark = format!(
                "{}<path d=\"M3 0H19\" stroke=\"{}\" stroke-width=\"{PATH}\"/>",
                line(Role::Gated, BLIND),
                step_colour(STEPS / 2),
            );
            entry(svg, &mark, &self.mark)?;
        }
        Ok(())
    }

    fn write_walls(&self, svg: &mut String, place: &Place) -> std::fmt::Result {
        let wall = colour_of(Role::Wall);
        write!(svg, "<path fill=\"none\" stroke=\"{wall}\" stroke-width=\"{WALL}\" d=\"")?;
        for ends in &self.walls {
            let [(x0, y0), (x1, y1)] = ends.map(|end| place.of(end));
            write!(svg, "M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}")?;
        }
        svg.push_str("\"/>\n");
        let unmapped = colour_of(Role::Encoders);
        writeln!(svg, "<g fill=\"none\" stroke=\"{unmapped}\" stroke-width=\"{WALL}\">")?;
        for thing in &self.unmapped {
            match *thing {
                Unmapped::Round(centre, radius) => {
                    let (x, y) = place.of(centre);
                    let radius = radius * place.per_metre;
                    writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\"/>")?;
                }
                Unmapped::Face(from, to) => {
                    let [(x0, y0), (x1, y1)] = [from, to].map(|end| place.of(end));
                    writeln!(svg, "<path d=\"M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}\"/>")?;
                }
            }
        }
        svg.push_str("</g>\n");
        Ok(())
    }

    /// The marks first, then the path from the best colour to the worst.
    fn write_path(&self, svg: &mut String, place: &Place, axis: Option<&Axis>) -> std::fmt::Result {
        let group = |svg: &mut String, colour: &str, width: f64, stretches: &str| {
            if stretches.is_empty() {
                return Ok(());
            }
            writeln!(
                svg,
                "<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" d=\"{stretches}\"/>"
            )
        };
        let marks = self.stretches(place, |heat| heat.marked);
        group(svg, &colour_of(Role::Gated), BLIND, &marks)?;
        let Some(axis) = axis else {
            let all = self.stretches(place, |_| true);
            return group(svg, &colour_of(Role::Estimate), 2.0, &all);
        };
        for step in 0..=STEPS {
            let stretches = self.stretches(place, |heat| step_of(axis, heat.value) == step);
            group(svg, &step_colour(step), PATH, &stretches)?;
        }
        Ok(())
    }

    /// The pieces of the path that start at a point with this property.
    fn stretches(&self, place: &Place, is: impl Fn(&Heat) -> bool) -> String {
        let mut path = String::new();
        let mut pen: Option<(f64, f64)> = None;
        for (here, next) in self.path.iter().zip(self.path.iter().skip(1)) {
            if !is(here) {
                pen = None;
                continue;
            }
            let ((x0, y0), (x1, y1)) = (place.of(here.at), place.of(next.at));
            if pen.is_none() {
                let _ = write!(path, "M{x0:.1} {y0:.1}");
                pen = Some((x0, y0));
            }
            // Turns on the spot, and moves below a pixel.
            let is_far = pen.is_some_and(|(x, y)| (x1 - x).hypot(y1 - y) >= 0.7);
            if is_far {
                let _ = write!(path, "L{x1:.1} {y1:.1}");
                pen = Some((x1, y1));
            }
        }
        path
    }
}

/// A range with a nonzero width on a logarithmic axis.
fn widened(values: &Range<f64>) -> Range<f64> {
    const LEAST: f64 = 1.1;
    if values.end >= LEAST * values.start {
        return values.clone();
    }
    values.start / LEAST..values.end * LEAST
}

/// The position of a value between the first and the last colour, from 0 to 1.
fn share(axis: &Axis, place: f64) -> f64 {
    ((place - axis.range.start) / (axis.range.end - axis.range.start)).clamp(0.0, 1.0)
}

/// NaN is the worst.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to STEPS")]
fn step_of(axis: &Axis, value: f64) -> u8 {
    if !value.is_finite() {
        return STEPS;
    }
    (share(axis, axis.place(value)) * f64::from(STEPS)).round() as u8
}

/// The colour of a step.
fn step_colour(step: u8) -> String {
    colour_at(f64::from(step) / f64::from(STEPS))
}

/// The interpolated colour at a share of the scale, from 0, the best, to 1.
pub(crate) fn colour_at(share: f64) -> String {
    let intervals = COLOURS.len() - 1;
    #[expect(clippy::cast_precision_loss, reason = "some colours")]
    let place = share * intervals as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
    let below = (place as usize).min(intervals - 1);
    #[expect(clippy::cast_precision_loss, reason = "some colours")]
    let part = place - below as f64;
    let at = |index: usize| COLOURS.get(index).copied().unwrap_or_default();
    let ((r0, g0, b0), (r1, g1, b1)) = (at(below), at(below + 1));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255")]
    let mix = |from: f64, to: f64| (from + part * (to - from)).round() as u8;
    hex((mix(r0, r1), mix(g0, g1), mix(b0, b1)))
}

fn colour_of(role: Role) -> String {
    let colour = role.rgb();
    hex((colour.0, colour.1, colour.2))
}

/// Start and end of the path.
fn write_ends(svg: &mut String, place: &Place, path: &[Heat]) -> std::fmt::Result {
    let (Some(start), Some(end)) = (path.first(), path.last()) else {
        return Ok(());
    };
    let ink = colour_of(Role::Ink);
    let ((x0, y0), (x1, y1)) = (place.of(start.at), place.of(end.at));
    if (x1 - x0).hypot(y1 - y0) < 40.0 {
        write_label(svg, (x0, y0), "start, end")?;
    } else {
        write_label(svg, (x0, y0), "start")?;
        write_label(svg, (x1, y1), "end")?;
    }
    writeln!(svg, "<circle cx=\"{x0:.1}\" cy=\"{y0:.1}\" r=\"5\" fill=\"{ink}\"/>")?;
    let (left, top) = (x1 - 4.0, y1 - 4.0);
    writeln!(svg, "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"8\" height=\"8\" fill=\"{ink}\"/>")
}

/// A label beside a point, on a pale background.
fn write_label(svg: &mut String, (x, y): (f64, f64), word: &str) -> std::fmt::Result {
    let paper = colour_of(Role::Paper);
    let (x, y) = (x + 9.0, y - 8.0);
    writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" stroke=\"{paper}\" stroke-width=\"4\" \
         paint-order=\"stroke\">{word}</text>"
    )
}

/// The colour bar, the worst on top.
fn write_scale(svg: &mut String, axis: &Axis, place: &Place, left: f64) -> std::fmt::Result {
    let (top, height) = (HEAD + EDGE, place.size[1].max(160.0));
    let each = height / f64::from(STEPS + 1);
    for step in 0..=STEPS {
        let y = top + each * f64::from(STEPS - step);
        let colour = step_colour(step);
        // Slightly too high, so that there is no gap between two.
        writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{y:.2}\" width=\"{BAR}\" height=\"{:.2}\" fill=\"{colour}\"/>",
            each + 0.3
        )?;
    }
    for &tick in axis.ticks() {
        let y = top + height * (1.0 - share(axis, tick));
        let (from, text) = (left + BAR, left + BAR + 8.0);
        writeln!(
            svg,
            "<path d=\"M{from:.1} {y:.1}h5\" stroke=\"{ink}\"/><text x=\"{text:.1}\" y=\"{:.1}\">{}</text>",
            y + 4.5,
            axis.text(tick),
            ink = colour_of(Role::Ink),
        )?;
    }
    let (x, y) = (left + SCALE - 14.0, top + 0.5 * height);
    writeln!(
        svg,
        "<text transform=\"translate({x:.1} {y:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        escape(&axis.label)
    )
}

/// A scale bar of a round length.
fn write_metres(svg: &mut String, place: &Place) -> std::fmt::Result {
    let room = 0.3 * place.size[0] / place.per_metre;
    let lengths = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];
    let metres = lengths.into_iter().rev().find(|length| *length <= room).unwrap_or(0.1);
    let (x, y, long) = (EDGE, place.bottom + 22.0, metres * place.per_metre);
    writeln!(
        svg,
        "<path d=\"M{x} {:.1}v8h{long:.1}v-8\" fill=\"none\" stroke=\"{ink}\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\">{metres} m</text>",
        y - 6.0,
        x + long + 8.0,
        y + 3.0,
        ink = colour_of(Role::Ink),
    )
}
