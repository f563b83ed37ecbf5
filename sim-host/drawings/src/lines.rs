//! Straight lines in an image of thin lines.
//!
//! A line starts at a pixel that no line explains. It follows the direction with the most such pixels, both ways. A fit by
//! least squares gives it a better direction, which it follows again, until it gains no more pixels. The line then explains
//! its pixels. It may cross other lines, whose pixels keep it connected. The direction of a short line is uncertain; it takes
//! that of a long line that is parallel or perpendicular to it within the uncertainty.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, PI};

use anyhow::ensure;

use super::drawn::MAX_SEGMENTS;
use super::thin::{Bitmap, Pixel};

/// Directions that are tried.
const DIRECTIONS: u32 = 180;
/// Largest distance of a pixel from its line, pixels.
const TOLERANCE: f64 = 1.0;
/// Pixels that may be missing in a line, as a jump from one to the next.
const GAP: i32 = 2;
/// Distance within which the ends of lines meet, pixels.
const CORNER: f64 = 2.0;
/// Sine of the smallest angle at which lines meet: 20°.
const STEEP: f64 = 0.342;
/// Largest number of fits of a line.
const FITS: usize = 16;
/// Most pixels in lines that are tried, in all. A wall takes some thousands, of which most are not its own.
const MOST_TRIED: usize = 50_000_000;
/// Pixels that are missing at the two ends of a line that is tried.
const TRIED_ENDS: usize = 6;
/// Side of the squares in which the ends of lines are looked up, pixels.
const SQUARE: f64 = 16.0;

/// A line between two points, pixels; the centre of pixel (0, 0) is (0, 0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// One end.
    pub from: [f64; 2],
    /// The other end.
    pub to: [f64; 2],
    /// RMS distance of its pixels, pixels.
    pub scatter: f64,
}

/// A line without ends: a point and a direction.
#[derive(Debug, Clone, Copy)]
struct Ray {
    at: [f64; 2],
    along: [f64; 2],
}

fn coordinates((x, y): Pixel) -> [f64; 2] {
    [f64::from(x), f64::from(y)]
}

impl Ray {
    fn new(at: [f64; 2], direction: f64) -> Self {
        let (sin, cos) = direction.sin_cos();
        Self { at, along: [cos, sin] }
    }

    /// The place of a point along the line, and its distance to the left.
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([x0, y0], [cos, sin]) = (self.at, self.along);
        let (x, y) = (x - x0, y - y0);
        [x * cos + y * sin, y * cos - x * sin]
    }

    fn point(&self, along: f64) -> [f64; 2] {
        [self.at[0] + along * self.along[0], self.at[1] + along * self.along[1]]
    }

    /// The line of least squares through pixels.
    fn fit(pixels: &[Pixel]) -> Option<Self> {
        let count = f64::from(u32::try_from(pixels.len()).ok()?);
        let sum =
            |of: &dyn Fn([f64; 2]) -> f64| pixels.iter().map(|&p| of(coordinates(p))).sum::<f64>();
        let at = [sum(&|[x, _]| x) / count, sum(&|[_, y]| y) / count];
        let xx = sum(&|[x, _]| (x - at[0]).powi(2));
        let yy = sum(&|[_, y]| (y - at[1]).powi(2));
        let xy = sum(&|[x, y]| (x - at[0]) * (y - at[1]));
        (pixels.len() > 1).then(|| Self::new(at, (2.0 * xy).atan2(xx - yy) / 2.0))
    }

    /// The nearest pixel to the line at each step from a pixel on it, in one direction.
    fn march(&self, on: &Bitmap, from: Pixel, sign: i32) -> Vec<Pixel> {
        let [cos, sin] = self.along;
        let is_flat = cos.abs() >= sin.abs();
        let slope = if is_flat { sin / cos } else { cos / sin };
        // Coordinates along and across the axis that is nearer to the line.
        let [x0, y0] = self.at;
        let (main0, cross0) = if is_flat { (x0, y0) } else { (y0, x0) };
        let start = if is_flat { from.0 } else { from.1 };
        let (mut found, mut missing) = (Vec::new(), 0);
        let mut step = start;
        while missing <= GAP {
            step += sign;
            let cross = cross0 + slope * (f64::from(step) - main0);
            let pixel =
                nearest(on, cross, |cross| if is_flat { (step, cross) } else { (cross, step) });
            match pixel.filter(|&pixel| self.place(coordinates(pixel))[1].abs() <= TOLERANCE) {
                Some(pixel) => {
                    missing = 0;
                    found.push(pixel);
                }
                None => missing += 1,
            }
        }
        found
    }

    /// All pixels of the line that are connected with one of them.
    fn follow(&self, on: &Bitmap, seed: Pixel) -> Vec<Pixel> {
        let mut pixels = self.march(on, seed, -1);
        pixels.reverse();
        pixels.push(seed);
        pixels.extend(self.march(on, seed, 1));
        pixels
    }
}

/// The nearest pixel that is on across a line, of the three about it.
#[expect(clippy::cast_possible_truncation, reason = "a coordinate of an image")]
fn nearest(on: &Bitmap, cross: f64, pixel: impl Fn(i32) -> Pixel) -> Option<Pixel> {
    let middle = cross.round() as i32;
    let side = if cross > f64::from(middle) { 1 } else { -1 };
    let candidates = [middle, middle + side, middle - side];
    candidates.into_iter().map(pixel).find(|&pixel| on.is_on(pixel))
}

/// The lines that are at least `shortest` pixels long, and the number of pixels that belong to none.
///
/// # Errors
/// If there are more lines than a map may have, or so many pixels beside each other that they are noise.
pub fn find(on: &Bitmap, shortest: f64) -> anyhow::Result<(Vec<Line>, usize)> {
    let mut left = on.clone();
    let (mut lines, mut unexplained, mut tried) = (Vec::new(), 0, 0);
    for seed in on.pixels() {
        if !left.is_on(seed) {
            continue;
        }
        let line = line_from(on, &left, seed, &mut tried);
        let is_map = tried <= MOST_TRIED && lines.len() <= MAX_SEGMENTS;
        ensure!(
            is_map,
            "it is noise or a pattern: more than {MAX_SEGMENTS} lines, or {MOST_TRIED} pixels in lines that were tried. \
             Remove what is no wall from the image, or give a larger --shortest"
        );
        match line.filter(|(line, _)| length(line) >= shortest) {
            Some((line, pixels)) => {
                explain(&mut left, &line);
                for pixel in pixels {
                    left.set(pixel, false);
                }
                lines.push(line);
            }
            None => unexplained += 1,
        }
        left.set(seed, false);
    }
    align(&mut lines);
    join_corners(&mut lines);
    Ok((lines, unexplained))
}

/// The line with the most pixels of `left` through a pixel, and its pixels.
fn line_from(
    on: &Bitmap,
    left: &Bitmap,
    seed: Pixel,
    tried: &mut usize,
) -> Option<(Line, Vec<Pixel>)> {
    let of = |direction: u32| {
        let ray = Ray::new(coordinates(seed), PI * f64::from(direction) / f64::from(DIRECTIONS));
        let pixels = ray.follow(on, seed);
        *tried += pixels.len() + TRIED_ENDS;
        let new = pixels.iter().filter(|&&pixel| left.is_on(pixel)).count();
        (new, pixels)
    };
    let (_, mut pixels) = (0..DIRECTIONS).map(of).max_by_key(|(new, _)| *new)?;
    let mut ray = Ray::fit(&pixels)?;
    for _ in 0..FITS {
        // A pixel in the middle is on the line; the seed may be beside it.
        let middle = pixels.get(pixels.len() / 2).copied()?;
        let next = ray.follow(on, middle);
        if next == pixels {
            break;
        }
        pixels = next;
        ray = Ray::fit(&pixels)?;
    }
    let ends =
        [pixels.first()?, pixels.last()?].map(|&end| ray.point(ray.place(coordinates(end))[0]));
    let squares: f64 = pixels.iter().map(|&p| ray.place(coordinates(p))[1].powi(2)).sum();
    let count = f64::from(u32::try_from(pixels.len()).ok()?);
    let scatter = (squares / count).sqrt();
    Some((Line { from: ends[0], to: ends[1], scatter }, pixels))
}

/// Turns the pixels of a line off.
#[expect(clippy::cast_possible_truncation, reason = "coordinates of an image")]
fn explain(left: &mut Bitmap, line: &Line) {
    let ray = Ray::new(line.from, direction(line));
    let end = length(line);
    for step in 0..=(end.ceil() as i32) {
        let [x, y] = ray.point(f64::from(step)).map(|value| value.round() as i32);
        for (dx, dy) in (-2..=2).flat_map(|dx| (-2..=2).map(move |dy| (dx, dy))) {
            let pixel = (x + dx, y + dy);
            let [along, across] = ray.place(coordinates(pixel));
            if across.abs() <= TOLERANCE && (-1.0..=end + 1.0).contains(&along) {
                left.set(pixel, false);
            }
        }
    }
}

/// The length of a line, pixels.
#[must_use]
pub fn length(line: &Line) -> f64 {
    (line.to[0] - line.from[0]).hypot(line.to[1] - line.from[1])
}

fn direction(line: &Line) -> f64 {
    (line.to[1] - line.from[1]).atan2(line.to[0] - line.from[0])
}

/// The uncertainty of a line's direction: three quarters of a pixel at both ends.
fn uncertainty(line: &Line) -> f64 {
    1.5 / length(line).max(1.0)
}

/// Turns short lines about their middle into the direction of the longest line that is parallel or perpendicular to
/// them within the uncertainty of both.
fn align(lines: &mut [Line]) {
    lines.sort_by(|a, b| length(b).total_cmp(&length(a)));
    let mut fixed: Vec<(f64, f64)> = Vec::new();
    for line in lines {
        let own = (direction(line), uncertainty(line));
        let off = |&(other, _): &(f64, f64)| {
            let turn = (other - own.0).rem_euclid(FRAC_PI_2);
            if turn > FRAC_PI_2 / 2.0 { turn - FRAC_PI_2 } else { turn }
        };
        let of = fixed.iter().find(|other| off(other).abs() <= own.1 + other.1);
        let Some(turn) = of.map(off) else {
            fixed.push(own);
            continue;
        };
        let ([x1, y1], [x2, y2]) = (line.from, line.to);
        let middle = [f64::midpoint(x1, x2), f64::midpoint(y1, y2)];
        let half = length(line) / 2.0;
        let ray = Ray::new(middle, own.0 + turn);
        (line.from, line.to) = (ray.point(-half), ray.point(half));
    }
}

/// Moves the ends of lines that meet to where they meet: the nearest crossing within [`CORNER`].
fn join_corners(lines: &mut [Line]) {
    let ends = Ends::of(lines);
    let mut moves = vec![[None::<f64>; 2]; lines.len()];
    for (other, crossed) in lines.iter().enumerate() {
        ends.near(crossed, |at, end| {
            let (Some(line), Some(of)) = (lines.get(at), moves.get_mut(at)) else { return };
            let (ray, here) = (Ray::new(line.from, direction(line)), [0.0, length(line)]);
            let (Some(here), Some(moved)) = (here.get(end), of.get_mut(end)) else { return };
            let crossing = (at != other).then(|| crossing(&ray, crossed)).flatten();
            let off = |along: f64| (along - here).abs();
            let nearest = moved.map_or(CORNER, off);
            let is_better =
                |along: &f64| off(*along) < nearest || moved.is_none() && off(*along) <= CORNER;
            *moved = crossing.filter(is_better).or(*moved);
        });
    }
    for (line, [from, to]) in lines.iter_mut().zip(moves) {
        let ray = Ray::new(line.from, direction(line));
        line.from = from.map_or(line.from, |along| ray.point(along));
        line.to = to.map_or(line.to, |along| ray.point(along));
    }
}

/// The ends of lines by the square in which they are.
struct Ends(HashMap<Pixel, Vec<(usize, usize)>>);

impl Ends {
    fn of(lines: &[Line]) -> Self {
        let mut squares: HashMap<Pixel, Vec<(usize, usize)>> = HashMap::new();
        for (at, line) in lines.iter().enumerate() {
            for (end, point) in [line.from, line.to].into_iter().enumerate() {
                squares.entry(square(point)).or_default().push((at, end));
            }
        }
        Self(squares)
    }

    /// Passes the ends near a line, as the number of their line and 0 or 1: all within half a square of it or of its
    /// continuation by as much, and others. An end may be passed several times.
    fn near(&self, line: &Line, mut pass: impl FnMut(usize, usize)) {
        let ray = Ray::new(line.from, direction(line));
        let (step, end) = (SQUARE / 2.0, length(line) + SQUARE / 2.0);
        let mut along = -step;
        while along <= end + step {
            let (column, row) = square(ray.point(along));
            for at in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (column + dx, row + dy))) {
                for &(line, end) in self.0.get(&at).into_iter().flatten() {
                    pass(line, end);
                }
            }
            along += step;
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "coordinates of an image")]
fn square([x, y]: [f64; 2]) -> Pixel {
    ((x / SQUARE).floor() as i32, (y / SQUARE).floor() as i32)
}

/// The place along a ray at which it crosses a line, or would if that were longer by [`CORNER`]; `None` if they are almost
/// parallel.
fn crossing(ray: &Ray, line: &Line) -> Option<f64> {
    let ([a, left], [b, right]) = (ray.place(line.from), ray.place(line.to));
    let across = right - left;
    if across.abs() < length(line) * STEEP {
        return None;
    }
    let part = -left / across;
    let beyond = CORNER / length(line);
    (-beyond..=1.0 + beyond).contains(&part).then_some(a + part * (b - a))
}
