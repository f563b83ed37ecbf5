//! The drawing of a map: walls, their names where there is room, axes in metres, a scale bar.

use std::fmt::Write as _;
use std::ops::Range;

use sonarfix::map::Grid;
use sonarfix_map::{Floor, NamedWall};

use super::axis::Axis;
use super::escape::escape;
use super::palette::Role;

/// Largest width and height of the drawn map, pixels.
const MOST: (f64, f64) = (1120.0, 860.0);
/// Margins of the map: left (axis labels), top (title), right, bottom, pixels.
const MARGIN: (f64, f64, f64, f64) = (64.0, 44.0, 24.0, 64.0);
/// Minimum extent of a drawing, metres: a wall along an axis has no width.
const LEAST_SPAN: f64 = 0.1;
/// Margin around the walls, as a fraction of the larger side.
const BLANK: f64 = 0.03;
/// Maps with more walls than this are drawn without names.
const MOST_NAMES: usize = 60;
/// Size of letters, pixels, and their average width as a fraction of it.
const TEXT: f64 = 12.0;
const LETTER: f64 = 0.56;

/// Draws a floor as SVG, with the grid of its index if given.
#[must_use]
pub fn svg(title: &str, floor: &Floor, grid: Option<Grid>) -> String {
    let frame = Frame::around(floor);
    let mut svg = frame.open(title, [0.0, 0.0]);
    frame.axes(&mut svg);
    if let Some(grid) = grid {
        frame.grid(&mut svg, &grid);
    }
    frame.walls(&mut svg, floor.named_walls());
    if floor.named_walls().len() <= MOST_NAMES {
        for wall in floor.named_walls() {
            frame.name(&mut svg, wall);
        }
    }
    frame.scale_bar(&mut svg);
    svg.push_str("</svg>\n");
    svg
}

/// The transformation from map to drawing.
pub(crate) struct Frame {
    x: Range<f64>,
    y: Range<f64>,
    /// Pixels per metre.
    scale: f64,
}

impl Frame {
    pub fn around(floor: &Floor) -> Self {
        let ends = || floor.named_walls().iter().flat_map(|wall| [wall.from(), wall.to()]);
        let x = span(ends().map(|[x, _]| x));
        let y = span(ends().map(|[_, y]| y));
        let blank = BLANK * (x.end - x.start).max(y.end - y.start);
        let [x, y] = [x, y].map(|range| range.start - blank..range.end + blank);
        let scale = (MOST.0 / (x.end - x.start)).min(MOST.1 / (y.end - y.start));
        Self { x, y, scale }
    }

    fn width(&self) -> f64 {
        (self.x.end - self.x.start) * self.scale
    }

    fn height(&self) -> f64 {
        (self.y.end - self.y.start) * self.scale
    }

    /// The place of a legend: its left upper corner.
    pub fn legend(&self) -> (f64, f64) {
        let (left, top, _, bottom) = MARGIN;
        (left, top + self.height() + bottom)
    }

    /// The position of a map point in the drawing; the y axis is inverted.
    pub fn at(&self, [x, y]: [f64; 2]) -> (f64, f64) {
        let (left, top, ..) = MARGIN;
        (left + (x - self.x.start) * self.scale, top + (self.y.end - y) * self.scale)
    }

    /// The begin of the drawing, with room for a legend of this width and height below the map.
    pub fn open(&self, title: &str, legend: [f64; 2]) -> String {
        let (left, top, right, bottom) = MARGIN;
        let wide = left + self.width().max(legend[0]) + right;
        let high = top + self.height() + bottom + legend[1];
        let (title, paper, ink) = (escape(title), hex(Role::Paper), hex(Role::Ink));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{wide:.0}\" height=\"{high:.0}\" \
             viewBox=\"0 0 {wide:.0} {high:.0}\" role=\"img\" aria-label=\"{title}\" \
             font-family=\"sans-serif\" font-size=\"{TEXT}\" fill=\"{ink}\" stroke-linecap=\"round\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"{paper}\"/>\n\
             <text x=\"{left}\" y=\"26\" font-size=\"16\" font-weight=\"bold\">{title}</text>\n"
        )
    }

    /// The frame, with ticks in metres.
    pub fn axes(&self, svg: &mut String) {
        let (left, top, ..) = MARGIN;
        let (wide, high, line) = (self.width(), self.height(), hex(Role::Grid));
        put(
            svg,
            format_args!(
                "<g stroke=\"{line}\" fill=\"none\"><rect x=\"{left}\" y=\"{top}\" width=\"{wide:.1}\" height=\"{high:.1}\"/><path d=\""
            ),
        );
        let (across, up) = (Axis::linear("", self.x.clone()), Axis::linear("", self.y.clone()));
        let bottom = top + high;
        for tick in across.ticks() {
            let (x, _) = self.at([*tick, self.y.start]);
            put(svg, format_args!("M{x:.1} {bottom:.1}v5"));
        }
        for tick in up.ticks() {
            let (_, y) = self.at([self.x.start, *tick]);
            put(svg, format_args!("M{left} {y:.1}h-5"));
        }
        svg.push_str("\"/></g>\n<g text-anchor=\"middle\">");
        for tick in across.ticks() {
            let ((x, _), label) = (self.at([*tick, self.y.start]), across.text(*tick));
            put(svg, format_args!("<text x=\"{x:.1}\" y=\"{:.1}\">{label}</text>", bottom + 18.0));
        }
        svg.push_str("</g>\n<g text-anchor=\"end\">");
        for tick in up.ticks() {
            let ((_, y), label) = (self.at([self.x.start, *tick]), up.text(*tick));
            put(
                svg,
                format_args!("<text x=\"{:.1}\" y=\"{:.1}\">{label}</text>", left - 9.0, y + 4.0),
            );
        }
        svg.push_str("</g>\n");
    }

    /// The lines between the cells of an index.
    fn grid(&self, svg: &mut String, grid: &Grid) {
        let cell = f64::from(grid.cell_size().0);
        let (x, y) = (f64::from(grid.origin().x.0), f64::from(grid.origin().y.0));
        let line = |n: u16, from: f64| from + f64::from(n) * cell;
        let (right, top) = (line(grid.columns(), x), line(grid.rows(), y));
        let ((left, up), (wide, high)) = ((MARGIN.0, MARGIN.1), (self.width(), self.height()));
        let frame = format!("x=\"{left}\" y=\"{up}\" width=\"{wide:.1}\" height=\"{high:.1}\"");
        put(svg, format_args!("<clipPath id=\"frame\"><rect {frame}/></clipPath>\n"));
        put(
            svg,
            format_args!(
                "<path clip-path=\"url(#frame)\" stroke=\"{}\" fill=\"none\" d=\"",
                hex(Role::Grid)
            ),
        );
        for column in 0..=grid.columns() {
            self.line(svg, [line(column, x), y], [line(column, x), top]);
        }
        for row in 0..=grid.rows() {
            self.line(svg, [x, line(row, y)], [right, line(row, y)]);
        }
        svg.push_str("\"/>\n");
    }

    /// All walls as one path, thinner where there are many.
    pub fn walls(&self, svg: &mut String, walls: &[NamedWall]) {
        let width = match walls.len() {
            0..=100 => 3.0,
            101..=2_000 => 1.5,
            _ => 0.75,
        };
        let ink = hex(Role::Ink);
        put(
            svg,
            format_args!("<path stroke=\"{ink}\" stroke-width=\"{width}\" fill=\"none\" d=\""),
        );
        for wall in walls {
            self.line(svg, wall.from(), wall.to());
        }
        svg.push_str("\"/>\n");
    }

    fn line(&self, svg: &mut String, from: [f64; 2], to: [f64; 2]) {
        let ((x1, y1), (x2, y2)) = (self.at(from), self.at(to));
        put(svg, format_args!("M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}"));
    }

    /// A wall's name along it, on the side of the drawing's centre, if it fits.
    fn name(&self, svg: &mut String, wall: &NamedWall) {
        let ((x1, y1), (x2, y2)) = (self.at(wall.from()), self.at(wall.to()));
        #[expect(clippy::cast_precision_loss, reason = "letters of a name")]
        let needed = wall.name().chars().count() as f64 * TEXT * LETTER;
        let length = f64::hypot(x2 - x1, y2 - y1);
        if needed > length {
            return;
        }
        // From left to right or upwards, never upside down.
        let is_backward = x2 - x1 < -1e-6 || ((x2 - x1).abs() <= 1e-6 && y2 > y1);
        let (dx, dy) = if is_backward { (x1 - x2, y1 - y2) } else { (x2 - x1, y2 - y1) };
        let (x, y) = (0.5 * (x1 + x2), 0.5 * (y1 + y2));
        let (left, top, ..) = MARGIN;
        let inwards = (left + 0.5 * self.width() - x, top + 0.5 * self.height() - y);
        // A fifth of a letter is below its baseline.
        let below = dx * inwards.1 - dy * inwards.0 > 0.0;
        let off = if below { 1.0 + TEXT } else { -0.5 * TEXT };
        let angle = dy.atan2(dx).to_degrees();
        put(
            svg,
            format_args!(
                "<text text-anchor=\"middle\" fill=\"{}\" stroke=\"{}\" stroke-width=\"3\" paint-order=\"stroke\" transform=\"translate({x:.1} {y:.1}) rotate({angle:.1})\" y=\"{off:.1}\">{}</text>\n",
                hex(Role::Estimate),
                hex(Role::Paper),
                escape(wall.name())
            ),
        );
    }

    /// A scale bar of a round length, about a fifth of the drawing wide.
    pub fn scale_bar(&self, svg: &mut String) {
        let (left, top, ..) = MARGIN;
        let metres = round_below(0.25 * (self.x.end - self.x.start));
        let (wide, y) = (metres * self.scale, top + self.height() + 42.0);
        let label = if metres < 1.0 {
            format!("{:.0} cm", 100.0 * metres)
        } else {
            format!("{metres:.0} m")
        };
        put(
            svg,
            format_args!(
                "<path d=\"M{left} {:.1}v10m0 -5h{wide:.1}m0 -5v10\" stroke=\"{}\" fill=\"none\"/>\n\
             <text x=\"{:.1}\" y=\"{:.1}\">{label}</text>\n",
                y - 5.0,
                hex(Role::Ink),
                left + wide + 8.0,
                y + 4.0
            ),
        );
    }
}

/// The largest of 1, 2 or 5 times a power of ten that is at most a length.
fn round_below(length: f64) -> f64 {
    let decade = 10.0_f64.powf(length.log10().floor());
    [5.0, 2.0].into_iter().map(|step| step * decade).find(|&step| step <= length).unwrap_or(decade)
}

fn span(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| {
        (least.min(value), most.max(value))
    });
    let short = (0.5 * (LEAST_SPAN - (most - least))).max(0.0);
    least - short..most + short
}

pub(crate) fn hex(role: Role) -> String {
    let colour = role.rgb();
    format!("#{:02x}{:02x}{:02x}", colour.0, colour.1, colour.2)
}

/// Appends to a string, which does not fail.
pub(crate) fn put(text: &mut String, more: std::fmt::Arguments<'_>) {
    let _ = text.write_fmt(more);
}
