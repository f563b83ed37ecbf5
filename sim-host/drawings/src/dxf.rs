//! Drawings in DXF, as text: LINE, LWPOLYLINE and POLYLINE of the model space. The file is read pair by pair and never held
//! as a whole.

use std::io::{BufRead, Read};

use anyhow::{Context, bail, ensure};

use super::drawn::{Drawing, Frame, Imported};

/// Largest number of entities that are read.
pub const MAX_ENTITIES: u64 = 1_000_000;
/// Largest number of pairs of code and value that are read, in all sections.
pub const MAX_PAIRS: u64 = 20_000_000;
/// Longest line, bytes.
const MAX_LINE: u64 = 4_096;

/// A group code and its value.
type Pair = (i32, String);

struct Pairs<R> {
    reader: R,
    count: u64,
}

impl<R: BufRead> Pairs<R> {
    fn line(&mut self) -> anyhow::Result<Option<String>> {
        let mut bytes = Vec::new();
        self.reader.by_ref().take(MAX_LINE + 1).read_until(b'\n', &mut bytes)?;
        ensure!(
            bytes.len() as u64 <= MAX_LINE,
            "it is no DXF: a line is longer than {MAX_LINE} bytes"
        );
        // Older files have names in other encodings than UTF-8.
        Ok((!bytes.is_empty()).then(|| String::from_utf8_lossy(&bytes).trim().to_owned()))
    }

    fn next(&mut self) -> anyhow::Result<Option<Pair>> {
        let Some(code) = self.line()? else { return Ok(None) };
        self.count += 1;
        let at = self.count.saturating_mul(2);
        ensure!(
            self.count <= MAX_PAIRS,
            "it has more than {MAX_PAIRS} pairs of lines: remove what is no wall"
        );
        ensure!(!code.starts_with("AutoCAD Binary DXF"), "it is binary: save it as DXF text");
        let code = code.parse().with_context(|| format!("line {}: no group code", at - 1))?;
        let value = self.line()?.with_context(|| format!("line {at}: the value is missing"))?;
        Ok(Some((code, value)))
    }
}

/// What is known of an entity.
#[derive(Default)]
struct Entity {
    kind: String,
    layer: String,
    is_paper: bool,
    flags: i64,
    xs: Vec<f64>,
    ys: Vec<f64>,
    end: [Option<f64>; 2],
    has_bulge: bool,
}

impl Entity {
    fn take(&mut self, code: i32, value: &str) -> anyhow::Result<()> {
        let number = || -> anyhow::Result<f64> {
            let number: f64 = value.parse().with_context(|| format!("`{value}` is no number"))?;
            ensure!(number.is_finite(), "`{value}` is no finite number");
            Ok(number)
        };
        match code {
            8 => value.clone_into(&mut self.layer),
            67 => self.is_paper = value == "1",
            70 => self.flags = value.parse().unwrap_or(0),
            10 => self.xs.push(number()?),
            20 => self.ys.push(number()?),
            11 => self.end[0] = Some(number()?),
            21 => self.end[1] = Some(number()?),
            42 => self.has_bulge |= number()?.abs() > 1e-12,
            _ => {}
        }
        let most = super::MAX_SEGMENTS;
        ensure!(self.xs.len().max(self.ys.len()) <= most, "a polyline has more than {most} points");
        Ok(())
    }

    fn points(&self) -> Vec<[f64; 2]> {
        self.xs.iter().zip(&self.ys).map(|(x, y)| [*x, *y]).collect()
    }
}

struct Reading<'f> {
    drawing: Drawing,
    frame: &'f Frame,
    unit: Option<f64>,
    layers: &'f [String],
    /// The polyline whose vertices follow.
    polyline: Option<Entity>,
    entities: u64,
}

/// Reads a drawing. Without a unit in the frame that of the file applies. Only the entities on `layers` are read, if any
/// are named.
///
/// # Errors
/// If it is no DXF, is larger than the limits of this module, has no unit, or no wall.
pub fn read(file: impl BufRead, frame: &Frame, layers: &[String]) -> anyhow::Result<Imported> {
    let mut pairs = Pairs { reader: file, count: 0 };
    let mut reading = Reading {
        drawing: Drawing::default(),
        frame,
        unit: frame.unit,
        layers,
        polyline: None,
        entities: 0,
    };
    let (mut section, mut variable) = (String::new(), String::new());
    let mut entity: Option<Entity> = None;
    let mut has_section = false;
    while let Some((code, value)) = pairs.next()? {
        let at = |error: anyhow::Error| error.context(format!("line {}", pairs.count * 2));
        match (code, section.as_str()) {
            (0, _) => {
                if let Some(entity) = entity.take() {
                    reading.finish(entity).map_err(at)?;
                }
                match value.as_str() {
                    "SECTION" | "ENDSEC" => section.clear(),
                    "EOF" => break,
                    _ if section == "ENTITIES" => {
                        entity = Some(Entity { kind: value, ..Entity::default() });
                    }
                    _ => {}
                }
                has_section |= code == 0;
            }
            (2, "") => section = value,
            (9, "HEADER") => variable = value,
            (70, "HEADER") if variable == "$INSUNITS" => reading.insunits(&value)?,
            (_, "ENTITIES") => {
                if let Some(entity) = &mut entity {
                    entity.take(code, &value).map_err(at)?;
                }
            }
            _ => {}
        }
    }
    ensure!(has_section, "it is no DXF: it has no section");
    if let Some(entity) = entity {
        reading.finish(entity)?;
    }
    reading.end()
}

impl Reading<'_> {
    fn insunits(&mut self, value: &str) -> anyhow::Result<()> {
        let unit = match value {
            "1" => 0.0254,
            "2" => 0.3048,
            "4" => 1e-3,
            "5" => 1e-2,
            "6" => 1.0,
            "0" => return Ok(()),
            other if self.unit.is_none() => {
                bail!("the unit {other} of $INSUNITS is not known: give --unit")
            }
            _ => return Ok(()),
        };
        self.unit = self.unit.or(Some(unit));
        Ok(())
    }

    fn finish(&mut self, entity: Entity) -> anyhow::Result<()> {
        self.entities += 1;
        ensure!(
            self.entities <= MAX_ENTITIES,
            "it has more than {MAX_ENTITIES} entities: remove what is no wall"
        );
        match entity.kind.as_str() {
            "VERTEX" => {
                if let Some(polyline) = &mut self.polyline {
                    polyline.xs.extend(&entity.xs);
                    polyline.ys.extend(&entity.ys);
                    polyline.has_bulge |= entity.has_bulge;
                    let most = super::MAX_SEGMENTS;
                    ensure!(polyline.xs.len() <= most, "a polyline has more than {most} points");
                }
                Ok(())
            }
            "SEQEND" => match self.polyline.take() {
                Some(polyline) => self.draw(&polyline),
                None => Ok(()),
            },
            "POLYLINE" => {
                // Its own point is its elevation.
                let (xs, ys) = (Vec::new(), Vec::new());
                self.polyline = Some(Entity { xs, ys, ..entity });
                Ok(())
            }
            _ => self.draw(&entity),
        }
    }

    fn draw(&mut self, entity: &Entity) -> anyhow::Result<()> {
        let kind = entity.kind.as_str();
        let is_line = matches!(kind, "LINE" | "LWPOLYLINE" | "POLYLINE");
        if !is_line {
            self.drawing.drop(format!("{kind} entities: no straight lines"));
            return Ok(());
        }
        if entity.is_paper {
            self.drawing.drop("entities of the paper space");
            return Ok(());
        }
        if !self.layers.is_empty() && !self.layers.contains(&entity.layer) {
            self.drawing.drop(format!("entities on the layer \"{}\"", entity.layer));
            return Ok(());
        }
        if kind == "POLYLINE" && entity.flags & (16 | 64) != 0 {
            self.drawing.drop("POLYLINE meshes");
            return Ok(());
        }
        if entity.has_bulge {
            self.drawing.drop(format!("{kind} entities with arcs"));
            return Ok(());
        }
        let unit = self.unit.context("the file names no unit: give --unit")?;
        let mut points = entity.points();
        if let ("LINE", [Some(x), Some(y)]) = (kind, entity.end) {
            points.push([x, y]);
        }
        let points: Vec<[f64; 2]> = points.iter().map(|&p| self.frame.place(unit, p)).collect();
        if points.len() < 2 {
            self.drawing.drop(format!("{kind} entities with fewer than two points"));
        }
        let is_closed = kind != "LINE" && entity.flags & 1 != 0;
        self.drawing.chain(&entity.layer, &points, is_closed)
    }

    fn end(mut self) -> anyhow::Result<Imported> {
        if let Some(unit) = self.unit {
            let [x, y] = self.frame.origin;
            self.drawing
                .note(format!("scale: one unit is {unit} m; its origin is at ({x}, {y}) m"));
        }
        self.drawing.end()
    }
}
