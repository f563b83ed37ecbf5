//! A chart as data, and its drawing as SVG.

use std::error::Error;
use std::ops::Range;

use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text};
use plotters::prelude::{Cartesian2d, Color, DashedLineSeries, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontDesc, FontFamily, FontStyle, ShapeStyle, TextStyle};

use super::axis::Axis;
use super::escape::escape;
use super::palette::Role;
use super::points::{Point, clip, decimate, simplify};

/// Plotters rounds to whole pixels. A figure is drawn this many times larger than shown, for subpixel
/// positions.
const OVERSAMPLING: u16 = 4;

/// Width of a figure, pixels: half of a wide page.
pub(super) const WIDE: u16 = 720;
/// Width of a figure on a narrow page, pixels, where letters are as large as in a wide one.
pub(super) const NARROW: u16 = 360;
/// Height of the strip with title and one line of legend, pixels; of each further line.
const HEAD: u16 = 58;
const LEGEND_LINE: u16 = 20;
/// Width of the strip with the labels of the vertical axis, pixels.
const LEFT: u16 = 66;
/// Margin beside the label of the vertical axis, pixels, part of that width.
const EDGE: u16 = 6;
/// Height of the strip with the labels of the horizontal axis, pixels.
const BOTTOM: u16 = 46;
/// Margin to the right of the plot, pixels: half of the last tick's label.
const RIGHT: u16 = 20;

/// Sizes of letters, pixels.
const TITLE: u16 = 16;
const TEXT: u16 = 13;
/// Average width of a letter, as a fraction of its size: the font of an SVG is unknown.
const LETTER: f64 = 0.54;

/// Opacity of a band: the grid shows through.
const BAND_OPACITY: f64 = 0.35;

/// Widths of lines, in quarters of a pixel. The thinnest is for the grid and for noise.
pub(super) const HAIRLINE: u16 = 3;
/// The usual line.
pub(super) const LINE: u16 = 6;
/// A line that stays visible beneath another.
pub(super) const BROAD: u16 = 12;

/// The error of a failed drawing.
pub type DrawError = Box<dyn Error + Send + Sync>;

type Root<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Plot<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, Axis>>;

/// A chart: axes, and layers from the bottom up.
pub(super) struct Chart<'l> {
    /// Title, also for screen readers.
    pub(super) title: String,
    /// The horizontal axis.
    pub(super) x: Axis,
    /// The vertical axis.
    pub(super) y: Axis,
    /// Width of the whole figure, pixels.
    pub(super) width: u16,
    /// Height of the whole figure, pixels.
    pub(super) height: u16,
    /// Layers, the lowest first.
    pub(super) layers: Vec<Layer<'l>>,
}

/// One layer of a chart.
pub(super) struct Layer<'l> {
    /// Label in the legend; layers with the same label share an entry.
    pub(super) label: &'l str,
    /// Role, which determines the colour.
    pub(super) role: Role,
    /// Shape.
    pub(super) shape: Shape,
}

/// The shape of a layer. Points are values, not axis positions.
pub(super) enum Shape {
    /// A line over the horizontal axis, with its width in quarters of a pixel.
    Line(u16, Vec<Point>),
    /// A path in any direction, with its width in quarters of a pixel.
    Path(u16, Vec<Point>),
    /// A dotted line.
    Dotted(Vec<Point>),
    /// The area between a lower and an upper line.
    Band(Vec<Point>, Vec<Point>),
    /// A dot.
    Dot(Point),
    /// Small dots over the horizontal axis.
    Dots(Vec<Point>),
}

/// What separates the parts of a figure in the output of plotters; no user's text has it.
const MARK: &str = "\u{1}part";

/// Width and height of the plot area of a figure with these layers, pixels.
pub(super) fn plot_size(width: u16, height: u16, layers: &[Layer<'_>]) -> (f64, f64) {
    let above = head(width, layers);
    (f64::from(width - LEFT - RIGHT), f64::from(height.saturating_sub(above + BOTTOM)))
}

/// Height of the strip above the plot, pixels.
fn head(width: u16, layers: &[Layer<'_>]) -> u16 {
    let lines = legend(width, layers).last().map_or(0, |(_, (_, line))| *line);
    HEAD + lines * LEGEND_LINE
}

/// The entries of the legend, each label once, with their left ends in drawn pixels and their lines.
fn legend<'l, 'a>(width: u16, layers: &'a [Layer<'l>]) -> Vec<(&'a Layer<'l>, (i32, u16))> {
    let (left, right) = (scaled_i32(LEFT), scaled_i32(width));
    let (mut x, mut line) = (left, 0);
    let mut entries: Vec<(&Layer<'_>, (i32, u16))> = Vec::new();
    for layer in layers {
        if entries.iter().any(|(seen, _)| seen.label == layer.label) {
            continue;
        }
        let end = x + legend_width(layer.label);
        if end > right && x > left {
            (x, line) = (left, line + 1);
        }
        entries.push((layer, (x, line)));
        x += legend_width(layer.label) + 3 * scaled_i32(6);
    }
    entries
}

impl Chart<'_> {
    /// Draws the chart.
    pub(super) fn svg(&self) -> Result<String, DrawError> {
        let mut svg = String::new();
        let size = (scaled(self.width), scaled(self.height));
        {
            let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            root.fill(&Role::Paper.rgb())?;
            self.draw_head(&root)?;
            mark(&root)?;
            let mut plot = self.draw_axes(&root)?;
            mark(&root)?;
            for layer in &self.layers {
                self.draw_layer(&mut plot, layer)?;
            }
            root.present()?;
        }
        Ok(self.with_title(&svg))
    }

    /// The title, and under it the legend.
    fn draw_head(&self, root: &Root<'_>) -> Result<(), DrawError> {
        let left = scaled_i32(LEFT);
        let title = text_style(TITLE, FontStyle::Bold, HPos::Left);
        root.draw(&Text::new(self.title.clone(), (left, scaled_i32(17)), title))?;
        for (layer, (x, line)) in legend(self.width, &self.layers) {
            draw_legend(root, layer, (x, scaled_i32(42 + line * LEGEND_LINE)))?;
        }
        Ok(())
    }

    fn draw_axes<'a, 'b>(&self, root: &'a Root<'b>) -> Result<Plot<'a, 'b>, DrawError> {
        let sparse = |axis: &Axis| if self.width < WIDE { axis.sparse() } else { axis.clone() };
        let mut plot = ChartBuilder::on(root)
            .margin_top(scaled(head(self.width, &self.layers)))
            .margin_right(scaled(RIGHT))
            .x_label_area_size(scaled(BOTTOM))
            .margin_left(scaled(EDGE))
            .y_label_area_size(scaled(LEFT - EDGE))
            .build_cartesian_2d(sparse(&self.x), self.y.clone())?;
        plot.configure_mesh()
            .light_line_style(Role::Grid.rgb().mix(0.0))
            .bold_line_style(Role::Grid.rgb().stroke_width(u32::from(HAIRLINE)))
            .axis_style(Role::Ink.rgb().stroke_width(u32::from(HAIRLINE)))
            .label_style(text_style(TEXT, FontStyle::Normal, HPos::Center))
            .axis_desc_style(text_style(TEXT, FontStyle::Normal, HPos::Center))
            .set_all_tick_mark_size(scaled(5))
            .x_desc(self.x.label.as_str())
            .y_desc(self.y.label.as_str())
            .x_label_formatter(&|tick| self.x.text(*tick))
            .y_label_formatter(&|tick| self.y.text(*tick))
            .draw()?;
        Ok(plot)
    }

    fn draw_layer(&self, plot: &mut Plot<'_, '_>, layer: &Layer<'_>) -> Result<(), DrawError> {
        let colour = layer.role.rgb();
        match &layer.shape {
            Shape::Line(width, points) => {
                self.draw_line(plot, colour.stroke_width((*width).into()), &self.series(points))?;
            }
            Shape::Path(width, points) => {
                self.draw_line(plot, colour.stroke_width((*width).into()), &self.path(points))?;
            }
            Shape::Dotted(points) => {
                let style = colour.stroke_width(LINE.into());
                for piece in self.visible(&self.series(points)) {
                    plot.draw_series(DashedLineSeries::new(piece, scaled(2), scaled(4), style))?;
                }
            }
            Shape::Band(lower, upper) => {
                let style = colour.mix(BAND_OPACITY).filled();
                plot.draw_series([Polygon::new(self.outline(lower, upper), style)])?;
            }
            Shape::Dots(points) => {
                // Lines of no length: with round ends they stay round where the figure is stretched.
                let style = colour.stroke_width(BROAD.into());
                let inside = |at: &Point| {
                    let is_in =
                        |range: &Range<f64>, value| (range.start..=range.end).contains(&value);
                    is_in(&self.x.range, at.0) && is_in(&self.y.range, at.1)
                };
                let dots = self.series(points).into_iter().filter(inside);
                plot.draw_series(dots.map(|at| PathElement::new(vec![at, at], style)))?;
            }
            Shape::Dot(at) => {
                let at = (self.x.place(at.0), self.y.place(at.1));
                plot.draw_series([Circle::new(at, scaled(5), colour.filled())])?;
            }
        }
        Ok(())
    }

    fn draw_line(
        &self,
        plot: &mut Plot<'_, '_>,
        style: ShapeStyle,
        points: &[Point],
    ) -> Result<(), DrawError> {
        for piece in self.visible(points) {
            plot.draw_series([PathElement::new(piece, style)])?;
        }
        Ok(())
    }

    /// The visible pieces of a line.
    fn visible(&self, points: &[Point]) -> Vec<Vec<Point>> {
        clip(points, &self.x.range, &self.y.range)
    }

    /// A series over the horizontal axis, transformed and decimated.
    fn series(&self, points: &[Point]) -> Vec<Point> {
        decimate(&self.placed(points))
    }

    /// A path, transformed and simplified to within a drawn pixel.
    fn path(&self, points: &[Point]) -> Vec<Point> {
        let pixels = f64::from(scaled(self.width - LEFT - RIGHT));
        simplify(&self.placed(points), (self.x.range.end - self.x.range.start) / pixels)
    }

    /// The outline of a band, cut off at the top and the bottom of the plot.
    fn outline(&self, lower: &[Point], upper: &[Point]) -> Vec<Point> {
        let Range { start, end } = self.y.range;
        let below = self.series(lower);
        let above = self.series(upper);
        below
            .into_iter()
            .chain(above.into_iter().rev())
            .map(|(x, y)| (x, y.clamp(start, end)))
            .collect()
    }

    /// The axis positions of the points, without those that are not finite.
    fn placed(&self, points: &[Point]) -> Vec<Point> {
        let finite = points.iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        finite.map(|(x, y)| (self.x.place(*x), self.y.place(*y))).collect()
    }

    /// Replaces the opening tag by one with the display size, round line ends and joints, the title for
    /// screen readers, and what the script of the page needs to show values, zoom and pan; groups axes and curves.
    fn with_title(&self, svg: &str) -> String {
        let (_, content) = svg.split_once('>').unwrap_or_default();
        let (wide, high) = (scaled(self.width), scaled(self.height));
        let (width, height, title) = (self.width, self.height, escape(&self.title));
        let (x, y) = (self.x.attribute(), self.y.attribute());
        let plot = self.plot_area();
        let legend: Vec<String> = legend(self.width, &self.layers)
            .iter()
            .map(|(layer, _)| format!("{} {}", hex_upper(layer.role), escape(layer.label)))
            .collect();
        let legend = legend.join("\t");
        let grouped = grouped(content);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {wide} {high}\" stroke-linejoin=\"round\" \
             stroke-linecap=\"round\" role=\"img\" \
             data-plot=\"{plot}\" data-x=\"{x}\" data-y=\"{y}\" data-legend=\"{legend}\" \
             aria-label=\"{title}\">{grouped}"
        )
    }

    /// Left, top, width and height of the plot, drawn pixels.
    fn plot_area(&self) -> String {
        let top = head(self.width, &self.layers);
        let (wide, high) = (self.width - LEFT - RIGHT, self.height.saturating_sub(top + BOTTOM));
        [LEFT, top, wide, high].map(|pixels| scaled(pixels).to_string()).join(" ")
    }
}

/// Separates the parts of a figure.
fn mark(root: &Root<'_>) -> Result<(), DrawError> {
    let style = text_style(TEXT, FontStyle::Normal, HPos::Left);
    Ok(root.draw(&Text::new(MARK, (0, 0), style))?)
}

/// The content of an SVG with groups instead of the two marks: axes, and curves.
fn grouped(content: &str) -> String {
    let mut parts = content.split(MARK);
    let mut text = String::with_capacity(content.len());
    let mut next = || parts.next().unwrap_or_default();
    // Each mark is in a text element, which is removed.
    let before =
        |part: &str| part.rfind("<text").and_then(|at| part.get(..at)).unwrap_or(part).to_owned();
    let after = |part: &str| part.split_once("</text>").map_or("", |(_, rest)| rest).to_owned();
    text.push_str(&before(next()));
    text.push_str("<g class=\"axes\">");
    text.push_str(&before(&after(next())));
    text.push_str("</g>\n<g class=\"curves\">");
    let rest = after(next());
    let (curves, _) = rest.rsplit_once("</svg>").unwrap_or((&rest, ""));
    text.push_str(curves);
    text.push_str("</g>\n</svg>\n");
    text
}

fn hex_upper(role: Role) -> String {
    let colour = role.rgb();
    format!("#{:02X}{:02X}{:02X}", colour.0, colour.1, colour.2)
}

/// Draws one entry of the legend at its left end and the height of its line.
fn draw_legend(root: &Root<'_>, layer: &Layer<'_>, (x, y): (i32, i32)) -> Result<(), DrawError> {
    let (swatch, gap) = (scaled_i32(22), scaled_i32(6));
    let colour = layer.role.rgb();
    let ends = vec![(x, y), (x + swatch, y)];
    match &layer.shape {
        Shape::Line(width, _) | Shape::Path(width, _) => {
            let style = colour.stroke_width(u32::from((*width).max(LINE)));
            root.draw(&PathElement::new(ends, style))?;
        }
        Shape::Dotted(_) => {
            for start in (x..x + swatch).step_by(6 * usize::from(OVERSAMPLING)) {
                let dot = vec![(start, y), (start + scaled_i32(2), y)];
                root.draw(&PathElement::new(dot, colour.stroke_width(u32::from(LINE))))?;
            }
        }
        Shape::Band(..) => {
            let corners = [(x, y - scaled_i32(6)), (x + swatch, y + scaled_i32(6))];
            root.draw(&Rectangle::new(corners, colour.mix(BAND_OPACITY).filled()))?;
        }
        Shape::Dot(_) | Shape::Dots(_) => {
            root.draw(&Circle::new((x + swatch / 2, y), scaled(5), colour.filled()))?;
        }
    }
    let style = text_style(TEXT, FontStyle::Normal, HPos::Left);
    root.draw(&Text::new(layer.label, (x + swatch + gap, y), style))?;
    Ok(())
}

/// Width of an entry of the legend, drawn pixels.
fn legend_width(label: &str) -> i32 {
    scaled_i32(22) + scaled_i32(6) + text_width(label)
}

/// Approximate width of a text in the legend.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "a legend is some tens of letters"
)]
fn text_width(text: &str) -> i32 {
    (text.chars().count() as f64 * f64::from(scaled(TEXT)) * LETTER).round() as i32
}

fn text_style(size: u16, style: FontStyle, anchor: HPos) -> TextStyle<'static> {
    /// The SVG backend divides a size by this to get the font size.
    const BACKEND_DIVIDES_BY: f64 = 1.24;
    let size = f64::from(scaled(size)) * BACKEND_DIVIDES_BY;
    FontDesc::new(FontFamily::SansSerif, size, style)
        .color(&Role::Ink.rgb())
        .pos(Pos::new(anchor, VPos::Center))
}

/// Converts displayed pixels to drawn pixels.
fn scaled(pixels: u16) -> u32 {
    u32::from(pixels) * u32::from(OVERSAMPLING)
}

fn scaled_i32(pixels: u16) -> i32 {
    i32::from(pixels) * i32::from(OVERSAMPLING)
}
