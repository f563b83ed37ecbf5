//! Occupancy grids of ROS's `map_server`: a YAML file and an image.

use std::path::Path;

use anyhow::{Context, bail, ensure};
use sonarfix_map::Floor;

use super::drawn::{Drawing, Frame, Imported};
use super::image::{Image, MAX_PIXELS};
use super::lines;
use super::thin::Bitmap;

/// Thicker areas are no walls, metres.
const THICKEST: f64 = 0.3;
/// Pixels of the largest image that is written: [`MAX_PIXELS`].
const MOST: f64 = 67_108_864.0;
/// Value of a free pixel in a written image; an occupied one is 0.
const FREE: u8 = 254;

/// The keys of the YAML file.
#[derive(Debug, Clone, PartialEq)]
struct Keys {
    image: String,
    resolution: f64,
    origin: [f64; 3],
    occupied: f64,
    is_negated: bool,
}

/// Parses the flat YAML of `map_server`.
fn keys(text: &str) -> anyhow::Result<Keys> {
    let value = |key: &str| {
        let lines = text.lines().filter_map(|line| line.split_once(':'));
        lines.into_iter().find(|(name, _)| name.trim() == key).map(|(_, value)| {
            let value = value.split(" #").next().unwrap_or_default().trim();
            value.trim_matches(['"', '\'']).to_owned()
        })
    };
    let number = |key: &str, text: &str| -> anyhow::Result<f64> {
        let number: Option<f64> = text.trim().parse().ok();
        number
            .filter(|number| number.is_finite())
            .with_context(|| format!("{key}: `{text}` is no number"))
    };
    let real = |key: &str| -> anyhow::Result<Option<f64>> {
        value(key).map(|text| number(key, &text)).transpose()
    };
    let resolution = real("resolution")?.context("`resolution` is missing")?;
    check_resolution(resolution)?;
    let origin = value("origin").context("`origin` is missing")?;
    let origin = origin.trim_matches(['[', ']']).split(',').map(|text| number("origin", text));
    let origin: Vec<f64> = origin.collect::<anyhow::Result<_>>()?;
    let origin = <[f64; 3]>::try_from(origin).ok().context("origin: three numbers are expected")?;
    if let Some(mode) = value("mode").filter(|mode| mode != "trinary" && mode != "scale") {
        bail!("mode: `{mode}` is not read; trinary and scale are");
    }
    Ok(Keys {
        image: value("image").filter(|image| !image.is_empty()).context("`image` is missing")?,
        resolution,
        origin,
        occupied: real("occupied_thresh")?.unwrap_or(0.65),
        is_negated: value("negate").is_some_and(|negate| negate == "1" || negate == "true"),
    })
}

/// Reads a grid; lines shorter than `shortest` metres are left out. The ends of a wall are those of a straight line of
/// pixels, each within a pixel.
///
/// # Errors
/// If a file cannot be read, is too large, or has no wall.
pub fn read(yaml: &Path, frame: &Frame, shortest: f64) -> anyhow::Result<Imported> {
    let (bitmap, place) = ink(yaml, frame)?;
    walls(bitmap, &place, frame, shortest)
}

/// The occupied pixels of a grid, and its place.
///
/// # Errors
/// If a file cannot be read or is too large, or the frame has a unit.
pub(super) fn ink(yaml: &Path, frame: &Frame) -> anyhow::Result<(Bitmap, Place)> {
    ensure!(frame.unit.is_none(), "--unit: the unit of a grid is its resolution, in metres");
    let keys = keys(&sonarfix_map::read_text(yaml)?)?;
    let file = yaml.with_file_name(&keys.image);
    let image = sonarfix_map::read_bytes(&file).map_err(anyhow::Error::new);
    let image = image.and_then(|bytes| Image::read(&bytes));
    let image = image.with_context(|| format!("the image {}", file.display()))?;
    let place = Place { resolution: keys.resolution, origin: keys.origin };
    Ok((occupied(&image, &keys), place))
}

/// The place of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The size of a cell, metres.
    pub resolution: f64,
    /// The lower left corner: x and y, metres, and the turn, radians.
    pub origin: [f64; 3],
}

impl Place {
    /// The place of a pixel in the map.
    pub(super) fn of(&self, [column, row]: [f64; 2], frame: &Frame) -> [f64; 2] {
        let [x0, y0, yaw] = self.origin;
        let (sin, cos) = yaw.sin_cos();
        let (x, y) = ((column + 0.5) * self.resolution, (row + 0.5) * self.resolution);
        frame.place(1.0, [x0 + x * cos - y * sin, y0 + x * sin + y * cos])
    }

    /// The note about it.
    pub(super) fn note(&self) -> String {
        let (r, [x0, y0, yaw]) = (self.resolution, self.origin);
        format!(
            "scale: a pixel is {r} m; the lower left corner is at ({x0}, {y0}) m, turned by {yaw} rad"
        )
    }
}

/// Finds the walls among occupied cells, rows from the bottom, as [`read`] does.
///
/// # Errors
/// If the grid is too large or not of this size, its resolution is out of range, or it has no wall.
pub fn of_cells(
    occupied: &[bool],
    [width, height]: [usize; 2],
    place: &Place,
    frame: &Frame,
    shortest: f64,
) -> anyhow::Result<Imported> {
    check_resolution(place.resolution)?;
    let is_whole = width.checked_mul(height) == Some(occupied.len());
    ensure!(
        is_whole && occupied.len() as u64 <= MAX_PIXELS,
        "the grid has more than {MAX_PIXELS} cells"
    );
    let mut bitmap = Bitmap::new(width, height);
    for (at, _) in occupied.iter().enumerate().filter(|(_, is_occupied)| **is_occupied) {
        let (column, row) = (i32::try_from(at % width)?, i32::try_from(at / width)?);
        bitmap.set((column, row), true);
    }
    walls(bitmap, place, frame, shortest)
}

pub(super) fn check_resolution(resolution: f64) -> anyhow::Result<()> {
    ensure!(
        (1e-3..=10.0).contains(&resolution),
        "resolution: {resolution} m is not within 1 mm and 10 m"
    );
    Ok(())
}

fn walls(
    mut bitmap: Bitmap,
    place: &Place,
    frame: &Frame,
    shortest: f64,
) -> anyhow::Result<Imported> {
    let mut drawing = Drawing::of_pixels(place.resolution);
    let r = place.resolution;
    drawing.note(place.note());
    drawing.note(format!(
        "uncertain: each end by {r} m, the direction of a wall of length L by {r} m / L"
    ));
    let solid = bitmap.remove_solid(pixels(THICKEST / r).max(3));
    if solid > 0 {
        drawing.note(format!("dropped: areas thicker than {THICKEST} m ({solid} pixels)"));
    }
    bitmap.thin();
    let (found, unexplained) = lines::find(&bitmap, (shortest / r).max(3.0))?;
    if unexplained > 0 {
        drawing
            .note(format!("dropped: pixels of no straight line of {shortest} m ({unexplained})"));
    }
    let place = |pixel: [f64; 2]| place.of(pixel, frame);
    for line in &found {
        if line.scatter > 0.5 {
            drawing.note(format!(
                "uncertain: the wall from {:.2?} to {:.2?} is not straight (RMS {:.2} m)",
                place(line.from),
                place(line.to),
                line.scatter * r
            ));
        }
        drawing.wall("", place(line.from), place(line.to))?;
    }
    drawing.end()
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 300")]
pub(super) fn pixels(count: f64) -> usize {
    count.ceil().clamp(0.0, 300.0) as usize
}

/// The occupied pixels.
fn occupied(image: &Image, keys: &Keys) -> Bitmap {
    bitmap(image, |grey| {
        let light = f64::from(grey) / 255.0;
        let occupancy = if keys.is_negated { light } else { 1.0 - light };
        occupancy > keys.occupied
    })
}

/// The pixels of these greys.
pub(super) fn bitmap(image: &Image, is_on: impl Fn(u8) -> bool) -> Bitmap {
    let mut bitmap = Bitmap::new(image.width, image.height);
    for (at, _) in image.grey.iter().enumerate().filter(|(_, grey)| is_on(**grey)) {
        let (column, row) = (at % image.width, image.height - 1 - at / image.width);
        let coordinate = |value| i32::try_from(value).unwrap_or(i32::MAX);
        bitmap.set((coordinate(column), coordinate(row)), true);
    }
    bitmap
}

/// A map as a grid: the text of the YAML file, and its image in PGM, whose file is called `name`. Walls are lines of one pixel.
///
/// # Errors
/// If the image would be too large.
pub fn write(floor: &Floor, name: &str, resolution: f64) -> anyhow::Result<(String, Vec<u8>)> {
    let ends = || floor.named_walls().iter().flat_map(|wall| [wall.from(), wall.to()]);
    let fold = |of: fn([f64; 2]) -> f64| {
        ends().map(of).fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)))
    };
    let margin = 4.0 * resolution;
    let ((left, right), (bottom, top)) = (fold(|[x, _]| x), fold(|[_, y]| y));
    let (left, bottom) = (left - margin, bottom - margin);
    let count = |span: f64| ((span + margin) / resolution).ceil();
    let (columns, rows) = (count(right - left), count(top - bottom));
    ensure!(
        columns * rows <= MOST,
        "the image would have {columns} × {rows} pixels, at most {MAX_PIXELS} are written: use a coarser --resolution"
    );
    let (width, height) = (whole(columns), whole(rows));
    let mut image = Image { width, height, grey: vec![FREE; width * height] };
    for wall in floor.named_walls() {
        let pixel = |[x, y]: [f64; 2]| [(x - left) / resolution, (y - bottom) / resolution];
        draw(&mut image, pixel(wall.from()), pixel(wall.to()));
    }
    let text = format!(
        "image: {name}\nmode: trinary\nresolution: {resolution}\norigin: [{left}, {bottom}, 0.0]\n\
         negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    );
    Ok((text, image.pgm()))
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of pixels")]
fn whole(count: f64) -> usize {
    count.max(0.0) as usize
}

/// Draws a line, a pixel for each step along the nearer axis.
fn draw(image: &mut Image, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
    let steps = (x2 - x1).abs().max((y2 - y1).abs()).ceil().max(1.0);
    for step in 0..=u32::try_from(whole(steps)).unwrap_or(u32::MAX) {
        let part = f64::from(step) / steps;
        let (x, y) = (whole(x1 + (x2 - x1) * part), whole(y1 + (y2 - y1) * part));
        let row = image.height.saturating_sub(1).saturating_sub(y);
        if let Some(pixel) = image.grey.get_mut(row * image.width + x) {
            *pixel = 0;
        }
    }
}
