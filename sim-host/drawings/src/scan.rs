//! Scanned floor plans: lines with their thickness in an image.

use std::path::Path;

use anyhow::Context;

use super::drawn::{Drawing, Frame, Imported};
use super::grid;
use super::image::Image;
use super::lines::{self, Line};
use super::thin::Bitmap;

/// Groups of pixels whose box is smaller are text or dirt, metres.
const LETTER: f64 = 0.5;
/// Holes in lines up to this size are closed, metres and pixels.
const HOLE: f64 = 0.03;
const HOLE_PIXELS: f64 = 4.0;
/// Thicker areas are no walls, metres.
const THICKEST: f64 = 0.6;
/// The size of the pixels in which lines are looked for, metres.
const COARSE: f64 = 0.02;
/// The darkest two of so many pixels are ink, not dirt.
const INKS: usize = 1_000;
/// The share of the contrast from which on a pixel is ink, because thin lines are grey; and deviations of the paper's noise.
const LINE: f64 = 0.25;
const NOISE: f64 = 4.0;
/// Points of a line at which its thickness is measured.
const SAMPLES: u16 = 25;

/// Reads the lines of a scanned plan of at least `shortest` metres: an image whose pixels have the length `frame.unit`, or a grid.
///
/// # Errors
/// If a file cannot be read, is too large, or has no line.
pub fn read(file: &Path, frame: &Frame, shortest: f64) -> anyhow::Result<Imported> {
    let is_grid = file.extension().is_some_and(|ending| ending == "yaml" || ending == "yml");
    if is_grid {
        let (ink, place) = grid::ink(file, frame)?;
        return of_ink(ink, &place, frame, shortest);
    }
    of_image(&sonarfix_map::read_bytes(file)?, frame, shortest)
}

/// Reads the lines of a scanned plan, as [`read`] does, from the bytes of an image.
///
/// # Errors
/// If it is no image, is too large, or has no line.
pub fn of_image(bytes: &[u8], frame: &Frame, shortest: f64) -> anyhow::Result<Imported> {
    let resolution = frame.unit.context(
        "--unit: the length of a pixel is unknown. Measure a wall, divide its length in metres by its pixels, and give the result",
    )?;
    grid::check_resolution(resolution)?;
    let image = Image::read(bytes)?;
    let place = grid::Place { resolution, origin: [0.0; 3] };
    of_ink(dark(&image), &place, frame, shortest)
}

/// The dark pixels of an image, or the bright ones of a dark one. The threshold lies between the grey of the paper, which is the
/// median, and that of the ink. Less than a hundredth of a plan may be ink: that is too little for a threshold that separates two classes.
fn dark(image: &Image) -> Bitmap {
    let mut sorted = image.grey.clone();
    sorted.sort_unstable();
    let grey = |part: usize| sorted.get(sorted.len() * part / INKS).copied().unwrap_or(0);
    let paper = grey(INKS / 2);
    let is_dark = paper < 128;
    let ink = if is_dark { grey(INKS - 2) } else { grey(2) };
    // The noise of the paper, on its side without ink.
    let (even, part) = if is_dark { (grey(INKS / 6), -1.0) } else { (grey(INKS - INKS / 6), 1.0) };
    let noise = f64::from(even.abs_diff(paper));
    let contrast = f64::from(ink.abs_diff(paper));
    let threshold = f64::from(paper) - part * (LINE * contrast).max(NOISE * noise);
    grid::bitmap(image, |grey| (f64::from(grey) < threshold) != is_dark)
}

/// The lines of ink.
fn of_ink(
    mut ink: Bitmap,
    place: &grid::Place,
    frame: &Frame,
    shortest: f64,
) -> anyhow::Result<Imported> {
    let r = place.resolution;
    let mut drawing = Drawing::of_pixels(place.resolution);
    drawing.note(place.note());
    ink.switch_small(false, grid::pixels((HOLE / r).max(HOLE_PIXELS)));
    let small = ink.switch_small(true, grid::pixels(LETTER / r));
    if small > 0 {
        drawing.note(format!("dropped: text and dirt smaller than {LETTER} m ({small} pixels)"));
    }
    let solid = ink.remove_solid(grid::pixels(THICKEST / r).max(3));
    if solid > 0 {
        drawing.note(format!("dropped: areas thicker than {THICKEST} m ({solid} pixels)"));
    }
    // The middle of a thick line is ragged by a pixel: a small one does not matter, and the lines are measured in the image itself.
    let times = (COARSE / r).clamp(1.0, 64.0).floor();
    let mut thinned = ink.coarser(grid::pixels(times));
    thinned.thin();
    let (found, unexplained) = lines::find(&thinned, (shortest / (times * r)).max(3.0))?;
    if unexplained > 0 {
        drawing
            .note(format!("dropped: pixels of no straight line of {shortest} m ({unexplained})"));
    }
    for line in found {
        let [from, to] =
            [line.from, line.to].map(|end| end.map(|value| times * (value + 0.5) - 0.5));
        let (line, thickness) = measured(&ink, Line { from, to, ..line });
        let [from, to] = [line.from, line.to].map(|point| place.of(point, frame));
        drawing.stroke(from, to, thickness * r)?;
    }
    drawing.end()
}

/// A line in the middle of its ink and to the end of it, and its thickness, pixels.
fn measured(ink: &Bitmap, line: Line) -> (Line, f64) {
    let length = lines::length(&line);
    let along = [(line.to[0] - line.from[0]) / length, (line.to[1] - line.from[1]) / length];
    let across = [-along[1], along[0]];
    let at = |from: [f64; 2], by: f64, direction: [f64; 2]| {
        [from[0] + by * direction[0], from[1] + by * direction[1]]
    };
    let sample = |number: u16| {
        let part = (f64::from(number) + 0.5) / f64::from(SAMPLES);
        let middle = at(line.from, part * length, along);
        let [left, right] =
            [1.0, -1.0].map(|sign| ink_from(ink, middle, across.map(|it| sign * it)));
        (part, left + right, 0.5 * (left - right))
    };
    let samples: Vec<(f64, f64, f64)> = (0..SAMPLES).map(sample).collect();
    let thickness = median(samples.iter().map(|sample| sample.1));
    // Where another line crosses, the ink is thicker.
    let is_plain = |sample: &&(f64, f64, f64)| sample.1 <= 1.3 * thickness + 1.0;
    let half = |is_second: bool| {
        let of_half = samples.iter().filter(is_plain).filter(|it| (it.0 > 0.5) == is_second);
        median(of_half.map(|sample| sample.2))
    };
    // The middles of the two halves are at a quarter and at three quarters.
    let (first, second) = (half(false), half(true));
    let [begin, end] = [1.5 * first - 0.5 * second, 1.5 * second - 0.5 * first];
    let from = at(line.from, begin, across);
    let to = at(line.to, end, across);
    let reach = |point, sign: f64| ink_from(ink, point, along.map(|it| sign * it)).min(thickness);
    let (back, on) = (reach(from, -1.0), reach(to, 1.0));
    let is_thick = thickness > 2.0;
    let [back, on] = if is_thick { [back, on] } else { [0.0; 2] };
    (Line { from: at(from, -back, along), to: at(to, on, along), ..line }, thickness)
}

/// How far the ink reaches from a point in a direction, pixels.
#[expect(clippy::cast_possible_truncation, reason = "a coordinate of an image")]
fn ink_from(ink: &Bitmap, from: [f64; 2], direction: [f64; 2]) -> f64 {
    const STEP: f64 = 0.25;
    /// Pixels beyond which nothing is a line.
    const MOST: f64 = 400.0;
    let mut by = 0.0;
    while by < MOST {
        let next = |from: f64, direction: f64| (from + (by + STEP) * direction).round() as i32;
        if !ink.is_on((next(from[0], direction[0]), next(from[1], direction[1]))) {
            break;
        }
        by += STEP;
    }
    by
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
