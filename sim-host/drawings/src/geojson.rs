//! `GeoJSON` (RFC 7946): line strings and polygons, in degrees or in metres.

use std::fmt::Write as _;

use anyhow::{Context, bail, ensure};
use serde_json::{Value, json};
use sonarfix_map::Floor;

use super::drawn::{Drawing, Frame, Imported};

/// Largest depth of nested collections.
const MAX_DEPTH: usize = 16;
/// The ellipsoid of WGS 84: half axis, metres, and square of the eccentricity.
const A: f64 = 6_378_137.0;
const E2: f64 = 6.694_379_990_14e-3;

/// A point of the earth that is the origin of a map whose y axis points north.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// Longitude, degrees.
    pub longitude: f64,
    /// Latitude, degrees.
    pub latitude: f64,
}

impl Anchor {
    /// Metres per degree of longitude and of latitude: the radii of curvature of the ellipsoid here. At 1 km from the anchor
    /// the plane deviates by less than 0.2 m at a latitude of 50°.
    fn metres_per_degree(&self) -> [f64; 2] {
        let (sin, cos) = self.latitude.to_radians().sin_cos();
        let w = (1.0 - E2 * sin * sin).sqrt();
        [(A / w * cos).to_radians(), (A * (1.0 - E2) / (w * w * w)).to_radians()]
    }
}

/// How coordinates become metres.
enum Scale {
    Metres(f64),
    Degrees(Anchor),
}

struct Reading<'f> {
    drawing: Drawing,
    frame: &'f Frame,
    scale: Scale,
}

/// Reads a map. The coordinates are degrees with an anchor, otherwise of the unit of the frame, or metres if the file was
/// written by [`write()`] without an anchor.
///
/// # Errors
/// If it is no `GeoJSON`, its unit is not known, or it has no wall.
pub fn read(text: &str, frame: &Frame, anchor: Option<Anchor>) -> anyhow::Result<Imported> {
    let root: Value = serde_json::from_str(text).context("it is no JSON")?;
    let is_ours = root.pointer("/sonarfix/unit").and_then(Value::as_str) == Some("m");
    let scale = match (anchor, frame.unit) {
        (Some(anchor), None) => Scale::Degrees(anchor),
        (Some(_), Some(_)) => {
            bail!("its coordinates are degrees or lengths: give --anchor or --unit")
        }
        (None, Some(unit)) => Scale::Metres(unit),
        (None, None) if is_ours => Scale::Metres(1.0),
        (None, None) => bail!(
            "give --anchor LON,LAT, the place of the map's origin, if its coordinates are degrees, or --unit if they are lengths"
        ),
    };
    let mut reading = Reading { drawing: Drawing::default(), frame, scale };
    let [x, y] = frame.origin;
    let note = match &reading.scale {
        Scale::Metres(unit) => {
            format!("scale: one unit is {unit} m; its origin is at ({x}, {y}) m")
        }
        Scale::Degrees(at) => {
            let (lon, lat) = (at.longitude, at.latitude);
            format!("scale: degrees, y north; {lon}, {lat} is at ({x}, {y}) m")
        }
    };
    reading.drawing.note(note);
    reading.take(&root, "", 0)?;
    reading.drawing.end()
}

impl Reading<'_> {
    fn take(&mut self, value: &Value, name: &str, depth: usize) -> anyhow::Result<()> {
        ensure!(depth <= MAX_DEPTH, "its collections are nested deeper than {MAX_DEPTH}");
        let items = |key: &str| value.get(key).and_then(Value::as_array).into_iter().flatten();
        let coordinates = value.get("coordinates").unwrap_or(&Value::Null);
        match value.get("type").and_then(Value::as_str) {
            Some("FeatureCollection") => {
                items("features").try_for_each(|item| self.take(item, "", depth + 1))
            }
            Some("GeometryCollection") => {
                items("geometries").try_for_each(|item| self.take(item, name, depth + 1))
            }
            Some("Feature") => {
                let name = value.pointer("/properties/name").and_then(Value::as_str);
                let geometry = value.get("geometry").filter(|geometry| !geometry.is_null());
                let Some(geometry) = geometry else {
                    self.drawing.drop("features without a geometry");
                    return Ok(());
                };
                self.take(geometry, name.unwrap_or_default(), depth + 1)
            }
            Some("LineString") => self.line(coordinates, name),
            Some("MultiLineString" | "Polygon") => self.lines(coordinates, name),
            Some("MultiPolygon") => {
                array(coordinates)?.iter().try_for_each(|rings| self.lines(rings, name))
            }
            Some(kind @ ("Point" | "MultiPoint")) => {
                self.drawing.drop(format!("{kind} geometries"));
                Ok(())
            }
            Some(other) => bail!("`{other}` is no type of GeoJSON"),
            None => bail!("it is no GeoJSON: the member `type` is missing"),
        }
    }

    fn lines(&mut self, lines: &Value, name: &str) -> anyhow::Result<()> {
        array(lines)?.iter().try_for_each(|line| self.line(line, name))
    }

    fn line(&mut self, line: &Value, name: &str) -> anyhow::Result<()> {
        let points = array(line)?.iter().map(|point| self.point(point));
        let points = points.collect::<anyhow::Result<Vec<_>>>()?;
        self.drawing.chain(name, &points, false)
    }

    fn point(&self, point: &Value) -> anyhow::Result<[f64; 2]> {
        let number =
            |at| point.get(at).and_then(Value::as_f64).context("a position without numbers");
        let (x, y): (f64, f64) = (number(0)?, number(1)?);
        Ok(match &self.scale {
            Scale::Metres(unit) => self.frame.place(*unit, [x, y]),
            Scale::Degrees(anchor) => {
                ensure!(
                    x.abs() <= 180.0 && y.abs() <= 90.0,
                    "the position {x}, {y} is not in degrees"
                );
                let [east, north] = anchor.metres_per_degree();
                let at = [(x - anchor.longitude) * east, (y - anchor.latitude) * north];
                self.frame.place(1.0, at)
            }
        })
    }
}

fn array(value: &Value) -> anyhow::Result<&Vec<Value>> {
    value.as_array().context("the coordinates are no list")
}

/// Writes a map, one feature for each wall: in degrees with an anchor, otherwise in metres, which the member `sonarfix`
/// states.
#[must_use]
pub fn write(floor: &Floor, anchor: Option<Anchor>) -> String {
    let place = |[x, y]: [f64; 2]| match anchor {
        None => [x, y],
        Some(anchor) => {
            let [east, north] = anchor.metres_per_degree();
            [anchor.longitude + x / east, anchor.latitude + y / north]
        }
    };
    let head = match anchor {
        None => "{\"type\":\"FeatureCollection\",\"sonarfix\":{\"unit\":\"m\"},\"features\":[",
        Some(_) => "{\"type\":\"FeatureCollection\",\"features\":[",
    };
    let mut text = head.to_owned();
    for (at, wall) in floor.named_walls().iter().enumerate() {
        let feature = json!({
            "type": "Feature",
            "properties": { "name": wall.name() },
            "geometry": { "type": "LineString", "coordinates": [place(wall.from()), place(wall.to())] },
        });
        // Writing to a string does not fail.
        let _ = write!(text, "{}\n{feature}", if at == 0 { "" } else { "," });
    }
    text + "\n]}\n"
}
