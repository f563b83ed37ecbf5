//! Drawings in SVG: the straight lines of `line`, `polyline`, `polygon`, `rect` and `path`, with all transforms.

use std::fmt::Write as _;
use std::str::FromStr;

use anyhow::{Context, bail, ensure};
use roxmltree::{Document, Node, ParsingOptions};
use sonarfix_map::Floor;
use svgtypes::{
    Length, LengthUnit, PointsParser, SimplePathSegment, SimplifyingPathParser, Transform, ViewBox,
};

use super::drawn::{Drawing, Frame, Imported};

/// Largest number of elements and texts that are read.
pub const MAX_NODES: u32 = 1_000_000;
/// Largest depth of nested elements.
const MAX_DEPTH: usize = 256;

struct Reading<'f> {
    drawing: Drawing,
    frame: &'f Frame,
    unit: f64,
}

/// Reads a drawing. The unit of the frame is metres per user unit of the outermost coordinates, without one it follows
/// from width and view box of the file. y of the map is −y of the drawing.
///
/// # Errors
/// If it is no SVG, contains entities or a document type, is too large, has no scale or no wall.
pub fn read(text: &str, frame: &Frame) -> anyhow::Result<Imported> {
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| match error {
        roxmltree::Error::DtdDetected => anyhow::anyhow!(
            "it has a document type, which could define entities: remove the line <!DOCTYPE …>"
        ),
        roxmltree::Error::NodesLimitReached => {
            anyhow::anyhow!("it has more than {MAX_NODES} elements")
        }
        other => anyhow::Error::new(other).context("it is no XML"),
    })?;
    let root = document.root_element();
    ensure!(root.tag_name().name() == "svg", "it is no SVG");
    let unit = match frame.unit {
        Some(unit) => unit,
        None => {
            scale(root).context("its scale is not known: give --unit, the length of a user unit")?
        }
    };
    let mut reading = Reading { drawing: Drawing::default(), frame, unit };
    let [x, y] = frame.origin;
    reading.drawing.note(format!(
        "scale: one user unit is {unit} m; the origin of the drawing is at ({x}, {y}) m, y upwards"
    ));
    reading.take(root, &Transform::default(), 0)?;
    reading.drawing.end()
}

/// Metres per user unit, from the width and the view box.
fn scale(root: Node<'_, '_>) -> Option<f64> {
    let width = Length::from_str(root.attribute("width")?).ok()?;
    let unit = match width.unit {
        LengthUnit::Mm => 1e-3,
        LengthUnit::Cm => 1e-2,
        LengthUnit::In => 0.0254,
        LengthUnit::Pt => 0.0254 / 72.0,
        LengthUnit::Pc => 0.0254 / 6.0,
        // Pixels are the size on a screen, not that of a room.
        _ => return None,
    };
    let scale = match root.attribute("viewBox") {
        Some(text) => width.number / ViewBox::from_str(text).ok()?.w * unit,
        // A user unit is a pixel of 1/96 inch.
        None => 0.0254 / 96.0,
    };
    let usual = [1.0, 1e-1, 1e-2, 1e-3, 0.0254, 0.3048];
    let rounded = usual.into_iter().find(|usual| (scale / usual - 1.0).abs() < 1e-12);
    (scale.is_finite() && scale > 0.0).then_some(rounded.unwrap_or(scale))
}

impl Reading<'_> {
    fn take(&mut self, node: Node<'_, '_>, outer: &Transform, depth: usize) -> anyhow::Result<()> {
        ensure!(depth <= MAX_DEPTH, "its elements are nested deeper than {MAX_DEPTH}");
        if !node.is_element() {
            return Ok(());
        }
        let kind = node.tag_name().name();
        let own = match node.attribute("transform") {
            Some(text) => {
                Transform::from_str(text).with_context(|| format!("transform=\"{text}\""))?
            }
            None => Transform::default(),
        };
        let all = product(outer, &own);
        match kind {
            "svg" if depth > 0 => self.drawing.drop("nested svg elements"),
            "svg" | "g" | "a" => {
                for child in node.children() {
                    self.take(child, &all, depth + 1)?;
                }
            }
            "line" | "polyline" | "polygon" | "rect" | "path" => {
                self.shape(node, kind, &all).with_context(|| format!("the element {kind}"))?;
            }
            // No drawing.
            "title" | "desc" | "metadata" | "style" | "namedview" | "script" => {}
            other => self.drawing.drop(format!("{other} elements")),
        }
        Ok(())
    }

    fn shape(&mut self, node: Node<'_, '_>, kind: &str, to: &Transform) -> anyhow::Result<()> {
        let number = |name: &str| -> anyhow::Result<f64> {
            let Some(text) = node.attribute(name) else { return Ok(0.0) };
            let length = Length::from_str(text).with_context(|| format!("{name}=\"{text}\""))?;
            match length.unit {
                LengthUnit::None | LengthUnit::Px => Ok(length.number),
                _ => bail!("{name}=\"{text}\": a length in user units is expected"),
            }
        };
        let name = name(node);
        match kind {
            "line" => {
                let ends = [[number("x1")?, number("y1")?], [number("x2")?, number("y2")?]];
                self.chain(&name, &ends, false, to)
            }
            "rect" => {
                if number("rx")? > 0.0 || number("ry")? > 0.0 {
                    self.drawing.note(format!(
                        "uncertain: the round corners of \"{name}\" are read as sharp ones"
                    ));
                }
                let [x, y, w, h] =
                    [number("x")?, number("y")?, number("width")?, number("height")?];
                let corners = [[x, y], [x + w, y], [x + w, y + h], [x, y + h]];
                self.chain(&name, &corners, true, to)
            }
            "path" => self.path(&name, node.attribute("d").unwrap_or_default(), to),
            _ => {
                let points = PointsParser::from(node.attribute("points").unwrap_or_default());
                let points: Vec<[f64; 2]> = points.map(|(x, y)| [x, y]).collect();
                self.chain(&name, &points, kind == "polygon", to)
            }
        }
    }

    fn path(&mut self, name: &str, data: &str, to: &Transform) -> anyhow::Result<()> {
        let (mut points, mut start): (Vec<[f64; 2]>, _) = (Vec::new(), None);
        for segment in SimplifyingPathParser::from(data) {
            match segment? {
                SimplePathSegment::MoveTo { x, y } => {
                    self.chain(name, &points, false, to)?;
                    points = vec![[x, y]];
                    start = Some([x, y]);
                }
                SimplePathSegment::LineTo { x, y } => points.push([x, y]),
                SimplePathSegment::CurveTo { x, y, .. }
                | SimplePathSegment::Quadratic { x, y, .. } => {
                    self.drawing.drop("curves of paths");
                    self.chain(name, &points, false, to)?;
                    points = vec![[x, y]];
                }
                SimplePathSegment::ClosePath => {
                    points.extend(start);
                    self.chain(name, &points, false, to)?;
                    points.clear();
                }
            }
            let most = super::MAX_SEGMENTS;
            ensure!(points.len() <= most, "a path has more than {most} points");
        }
        self.chain(name, &points, false, to)
    }

    fn chain(
        &mut self,
        name: &str,
        points: &[[f64; 2]],
        is_closed: bool,
        to: &Transform,
    ) -> anyhow::Result<()> {
        let place = |&[x, y]: &[f64; 2]| {
            let (u, v) = (to.a * x + to.c * y + to.e, to.b * x + to.d * y + to.f);
            self.frame.place(self.unit, [u, -v])
        };
        let points: Vec<[f64; 2]> = points.iter().map(place).collect();
        self.drawing.chain(name, &points, is_closed)
    }
}

/// The transform that applies `inner` first.
fn product(outer: &Transform, inner: &Transform) -> Transform {
    Transform {
        a: outer.a * inner.a + outer.c * inner.b,
        b: outer.b * inner.a + outer.d * inner.b,
        c: outer.a * inner.c + outer.c * inner.d,
        d: outer.b * inner.c + outer.d * inner.d,
        e: outer.a * inner.e + outer.c * inner.f + outer.e,
        f: outer.b * inner.e + outer.d * inner.f + outer.f,
    }
}

/// The name of an element: its title, its label in Inkscape, or its id.
fn name(node: Node<'_, '_>) -> String {
    let title = node.children().find(|child| child.tag_name().name() == "title");
    let title = title.and_then(|title| title.text());
    let label = node.attributes().find(|attribute| attribute.name() == "label");
    let label = label.map(|label| label.value());
    title.or(label).or(node.attribute("id")).unwrap_or_default().trim().to_owned()
}

/// Writes a map as a drawing whose user unit is a metre, at its size in millimetres: one line with a title for each wall.
#[must_use]
pub fn write(floor: &Floor) -> String {
    let ends = || floor.named_walls().iter().flat_map(|wall| [wall.from(), wall.to()]);
    let span = |of: fn([f64; 2]) -> f64| {
        let (low, high) = ends()
            .map(of)
            .fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
        // A margin, so that walls at the edge are drawn; at least a metre of it in all.
        (low.floor() - 0.5, high.ceil() + 0.5)
    };
    let ((left, right), (bottom, top)) = (span(|[x, _]| x), span(|[_, y]| y));
    let (width, height) = (right - left, top - bottom);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}mm\" height=\"{}mm\" \
         viewBox=\"{left} {} {width} {height}\">\n<g transform=\"scale(1 -1)\" fill=\"none\" \
         stroke=\"black\" stroke-width=\"0.02\">\n",
        width * 1e3,
        height * 1e3,
        -top
    );
    for wall in floor.named_walls() {
        let ([x1, y1], [x2, y2]) = (wall.from(), wall.to());
        let name = escaped(wall.name());
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"><title>{name}</title></line>"
        );
    }
    text + "</g>\n</svg>\n"
}

fn escaped(text: &str) -> String {
    let control = |c: char| if c.is_control() { ' ' } else { c };
    let text: String = text.chars().map(control).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
