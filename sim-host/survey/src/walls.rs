//! The walls of a map from its lines: where they begin and end, and how exactly they are known.

#![expect(
    clippy::indexing_slicing,
    reason = "lines, spans and columns have the lengths of the track"
)]

use nalgebra::{Matrix2, Vector2};

use crate::evidence::{Placed, placed};
use crate::line::{Line, Span};
use crate::track::{GAP, Track, clusters};

/// Fewest echoes of a part of a wall.
const FEWEST: usize = 3;
/// Largest residual of an echo that supports a wall, metres.
const INLIER: f64 = 0.025;
/// Farthest extension to a corner that answers, and to one that does not, metres.
const CORNER: f64 = 1.6;
const GUESSED: f64 = 0.5;
/// Fewest echoes of a corner.
const CORNER_ECHOES: usize = 3;

/// A wall of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MappedWall {
    /// Its ends, with the robot's side on the left of the direction from the first to the second.
    pub from: Vector2<f64>,
    /// Its other end.
    pub to: Vector2<f64>,
    /// Echoes from it.
    pub echoes: usize,
    /// Standard deviation of its distance, metres.
    pub accuracy: f64,
    /// Whether its ends are corners with other walls.
    pub corners: [bool; 2],
    /// Whether the maps forwards and backwards in time agree on it.
    pub is_confirmed: bool,
}

impl MappedWall {
    /// The distance between this wall's middle part and another wall on the same side; `None` if the other one is not beside it.
    #[must_use]
    pub fn apart(&self, other: &Self) -> Option<f64> {
        const PARALLEL: f64 = 0.996;
        let along = (self.to - self.from).normalize();
        let theirs = (other.to - other.from).normalize();
        if along.dot(&theirs) < PARALLEL {
            return None;
        }
        let [from, to] = [other.from, other.to].map(|end| along.dot(&(end - self.from)));
        let (low, high) = (from.max(0.0), to.min(self.length()));
        if high - low < 0.3 * self.length().min(other.length()) {
            return None;
        }
        let at = self.from + along * f64::midpoint(low, high);
        let relative = at - other.from;
        Some((theirs.x * relative.y - theirs.y * relative.x).abs())
    }

    /// Its length, metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        (self.to - self.from).norm()
    }
}

/// A part of a line that echoes support.
#[derive(Debug, Clone, Copy)]
struct Part {
    line: usize,
    span: Span,
    echoes: usize,
    corners: [bool; 2],
}

/// The walls of a track.
#[must_use]
pub fn walls(track: &Track) -> Vec<MappedWall> {
    let mut parts = parts(track);
    let placed = placed(&track.problem, &track.state, track.known);
    extend_to_corners(track, &mut parts, &placed);
    let accuracies = accuracies(track, &parts);
    let wall = |(part, accuracy): (&Part, f64)| {
        let line = &track.state.lines[part.line];
        let [at_from, at_to] = part.corners;
        MappedWall {
            from: line.point(part.span.from),
            to: line.point(part.span.to),
            echoes: part.echoes,
            accuracy,
            corners: [at_from, at_to],
            is_confirmed: false,
        }
    };
    parts.iter().zip(accuracies).map(wall).collect()
}

fn parts(track: &Track) -> Vec<Part> {
    let mut feet: Vec<Vec<f64>> = vec![Vec::new(); track.state.lines.len()];
    for (k, line) in track.problem.matches.iter().enumerate() {
        if let Some((line, sighting)) = line.zip(track.sighting(k)) {
            let at = &track.state.lines[line];
            if (at.distance(&sighting.at) - sighting.distance).abs() < INLIER {
                feet[line].push(at.along(&sighting.at));
            }
        }
    }
    let mut parts = Vec::new();
    for (line, feet) in feet.into_iter().enumerate() {
        for span in clusters(feet.clone(), GAP) {
            let echoes = feet.iter().filter(|&&at| span.has(at, 1e-9)).count();
            if echoes >= FEWEST && span.length() > 0.1 {
                parts.push(Part { line, span, echoes, corners: [false; 2] });
            }
        }
    }
    parts
}

/// Extends walls to the concave corners that they form, if the corner answers or is near.
fn extend_to_corners(track: &Track, parts: &mut [Part], placed: &[Placed]) {
    // The nearest corner at each end of each part: position along its line.
    let mut corners: Vec<[Option<f64>; 2]> = vec![[None; 2]; parts.len()];
    for one in 0..parts.len() {
        for other in 0..parts.len() {
            let Some((end, along, farthest)) = corner(track, &parts[one], &parts[other]) else {
                continue;
            };
            let line = &track.state.lines[parts[one].line];
            let point = line.point(along);
            let answers = || corner_echoes(track, placed, &point) >= CORNER_ECHOES;
            let gap = if end == 0 {
                Span { from: along, to: parts[one].span.from }
            } else {
                Span { from: parts[one].span.to, to: along }
            };
            let is_wall = farthest <= GUESSED || (farthest <= CORNER && answers());
            if !is_wall || is_open(track, placed, parts[one].line, &gap) {
                continue;
            }
            let is_nearer = |found: f64| (end == 0) == (along > found);
            if corners[one][end].is_none_or(is_nearer) {
                corners[one][end] = Some(along);
            }
        }
    }
    for (part, [from, to]) in parts.iter_mut().zip(corners) {
        part.span.from = from.unwrap_or(part.span.from);
        part.span.to = to.unwrap_or(part.span.to);
        part.corners = [from.is_some(), to.is_some()];
    }
}

/// The corner of a part with another: which end (0 or 1), its position along the line, and how far the farther of both
/// parts ends before it. `None` if they form none on the robot's side.
fn corner(track: &Track, part: &Part, other: &Part) -> Option<(usize, f64, f64)> {
    const INSIDE: f64 = 0.15;
    let (a, b) = (&track.state.lines[part.line], &track.state.lines[other.line]);
    let crossing = intersection(a, b)?;
    let (along, across) = (a.along(&crossing), b.along(&crossing));
    let before = |span: &Span, at: f64| (span.from - at).max(at - span.to);
    let (gap, other_gap) = (before(&part.span, along), before(&other.span, across));
    let middle = |line: &Line, span: &Span| line.point(f64::midpoint(span.from, span.to));
    let is_concave =
        b.distance(&middle(a, &part.span)) > 0.0 && a.distance(&middle(b, &other.span)) > 0.0;
    let ends_there = |span: &Span, at: f64, gap: f64| {
        gap > 0.0 || (at - span.from).abs().min((at - span.to).abs()) < INSIDE
    };
    let fits = is_concave
        && ends_there(&part.span, along, gap)
        && ends_there(&other.span, across, other_gap);
    let end = usize::from(along > f64::midpoint(part.span.from, part.span.to));
    fits.then_some((end, along, gap.max(other_gap)))
}

/// The intersection of two lines at an angle of 60° to 120°.
fn intersection(a: &Line, b: &Line) -> Option<Vector2<f64>> {
    let (of_a, of_b) = (a.normal(), b.normal());
    if of_a.dot(&of_b).abs() > 0.5 {
        return None;
    }
    let matrix = Matrix2::new(of_a.x, of_a.y, of_b.x, of_b.y);
    Some(matrix.try_inverse()? * Vector2::new(a.offset, b.offset))
}

/// Number of echoes from a corner, of those that no line explains.
fn corner_echoes(track: &Track, placed: &[Placed], corner: &Vector2<f64>) -> usize {
    const CONE: f64 = 0.3;
    const NEAR: f64 = 0.05;
    let is_echo = |place: &&Placed| {
        let apart = corner - place.sonar.at;
        let off = sonarfix_batch::odometry::wrap(place.sonar.direction - apart.y.atan2(apart.x));
        track.problem.matches[place.ping].is_none()
            && place.range.is_some_and(|range| (range - apart.norm()).abs() < NEAR)
            && off.abs() < CONE
    };
    placed.iter().filter(is_echo).count()
}

/// Whether pings pass through a part of a line.
fn is_open(track: &Track, placed: &[Placed], line: usize, gap: &Span) -> bool {
    const SURE: f64 = 0.14;
    const MOST: usize = 2;
    let at = &track.state.lines[line];
    let farthest = 0.65 * track.problem.robot.reach[1];
    let passes = |place: &&Placed| {
        let distance = at.distance(&place.sonar.at);
        distance > 0.1
            && distance < farthest
            && at.off_axis(place.sonar.direction).abs() < SURE
            && gap.has(at.along(&place.sonar.at), -0.1)
            && place.range.is_none_or(|range| range > distance + 0.1)
    };
    placed.iter().filter(passes).count() > MOST
}

/// The standard deviation of each part's distance from the path beside it: that of the mean of its echoes. Echoes from one
/// place share their errors, so that four of them count as one; off-axis bias and range scale leave some millimetres in any case.
fn accuracies(track: &Track, parts: &[Part]) -> Vec<f64> {
    const DEPENDENT: f64 = 4.0;
    const SYSTEMATIC: f64 = 0.003;
    #[expect(clippy::cast_precision_loss, reason = "numbers of echoes")]
    let of_mean = |part: &Part| (DEPENDENT / part.echoes as f64).sqrt();
    let accuracy = |part: &Part| SYSTEMATIC.hypot(track.problem.range_noise * of_mean(part));
    parts.iter().map(accuracy).collect()
}
