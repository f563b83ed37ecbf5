//! New lines from the echoes that no line explains.
//!
//! An echo of a wall comes from a point of the circle of its range about the sonar, near the axis. The wall is a tangent of
//! the circles of all its echoes. Votes for tangents (Hough) propose lines. A small or round object answers from every
//! direction as well. A line is therefore only accepted if a point and circles explain its echoes worse, which needs a drive
//! along the wall.

#![expect(clippy::indexing_slicing, reason = "bins within their table")]

use std::collections::HashMap;
use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2};
use sonarfix_batch::odometry::wrap;

use crate::line::Line;
use crate::problem::from_axis;

/// Width of the bins: direction (radians), offset (metres).
const BINS: (f64, f64) = (TAU / 120.0, 0.04);
/// Half of the directions for which an echo votes, radians.
const CONE: f64 = 0.28;
/// Gates of the supporters while a line is refined, metres.
const GATES: [f64; 4] = [0.07, 0.05, 0.035, 0.03];
/// Fewest echoes of a new line.
const FEWEST: usize = 7;
/// Shortest drive along a new line, metres.
const BASELINE: f64 = 0.3;
/// Largest RMS residual of a new line, metres.
const ROUGHEST: f64 = 0.016;
/// Angle to the building's axes beyond which a new line is slanted, radians.
const SLANTED: f64 = 0.1;
/// Radii of the objects that a line is compared with, metres.
const RADII: [f64; 3] = [0.0, 0.12, 0.3];
/// By how much more the squares of such an object must sum up to, in variances of a range.
const BETTER: f64 = 12.0;

/// An echo in the estimated frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// The ping, as an index into the chain.
    pub ping: usize,
    /// The pose before it.
    pub pose: usize,
    /// Position of the sonar.
    pub at: Vector2<f64>,
    /// Direction of its axis, radians.
    pub direction: f64,
    /// The distance measured, metres.
    pub distance: f64,
}

/// The best new line, and the pings that support it.
#[must_use]
pub fn propose(
    sightings: &[Sighting],
    noise: f64,
    axes: Option<f64>,
) -> Option<(Line, Vec<usize>)> {
    let mut best: Option<(Line, Vec<usize>)> = None;
    for start in peaks(sightings) {
        let Some((line, supporters)) = refine(sightings, start) else { continue };
        let is_larger = best.as_ref().is_none_or(|(_, pings)| supporters.len() > pings.len());
        if is_larger && is_line(&line, &supporters, noise, axes) {
            best = Some((line, supporters.iter().map(|sighting| sighting.ping).collect()));
        }
    }
    best
}

/// The bins with the most votes.
#[expect(clippy::cast_possible_truncation, reason = "a building has some metres")]
fn peaks(sightings: &[Sighting]) -> Vec<Line> {
    const KEPT: usize = 6;
    let mut votes: HashMap<(i32, i32), u32> = HashMap::new();
    for sighting in sightings {
        let middle = (sighting.direction / BINS.0).round() as i32;
        let half = (CONE / BINS.0) as i32;
        for bin in middle - half..=middle + half {
            let angle = f64::from(bin) * BINS.0;
            let offset = angle.cos() * sighting.at.x + angle.sin() * sighting.at.y;
            let row = ((offset + sighting.distance) / BINS.1).floor() as i32;
            for row in row - 1..=row {
                *votes.entry((bin.rem_euclid(120), row)).or_default() += 1;
            }
        }
    }
    let mut bins: Vec<_> = votes.into_iter().filter(|&(_, count)| count >= 5).collect();
    // Also by bin: the order of a hash map differs from run to run.
    bins.sort_by_key(|&(bin, count)| (std::cmp::Reverse(count), bin));
    let mut kept: Vec<(i32, i32)> = Vec::new();
    for (bin, _) in bins {
        let near = |other: &(i32, i32)| {
            let turn = (bin.0 - other.0).rem_euclid(120);
            turn.min(120 - turn) <= 3 && (bin.1 - other.1).abs() <= 3
        };
        if !kept.iter().any(near) {
            kept.push(bin);
        }
        if kept.len() == KEPT {
            break;
        }
    }
    let line = |(bin, row): (i32, i32)| Line {
        angle: wrap(f64::from(bin) * BINS.0),
        offset: f64::from(row + 1) * BINS.1,
    };
    kept.into_iter().map(line).collect()
}

/// Least squares on the supporters, with narrowing gates.
fn refine(sightings: &[Sighting], mut line: Line) -> Option<(Line, Vec<Sighting>)> {
    let mut supporters = Vec::new();
    for gate in GATES {
        let fits = |sighting: &&Sighting| {
            line.off_axis(sighting.direction).abs() <= CONE + 0.08
                && (line.distance(&sighting.at) - sighting.distance).abs() <= gate
        };
        supporters = sightings.iter().filter(fits).copied().collect();
        if supporters.len() < FEWEST {
            return None;
        }
        let (mut matrix, mut rhs) = (Matrix2::zeros(), Vector2::zeros());
        for sighting in &supporters {
            let residual = line.distance(&sighting.at) - sighting.distance;
            let row = Vector2::new(-line.along(&sighting.at), 1.0);
            matrix += row * row.transpose();
            rhs -= row * residual;
        }
        // Towards the direction at first: the drive along the wall may be short.
        matrix[(0, 0)] += 1e-3;
        let step = matrix.try_inverse()? * rhs;
        line = Line { angle: wrap(line.angle + step.x), offset: line.offset + step.y };
    }
    Some((line, supporters))
}

/// Whether the largest part of the supporters without a gap is explained by the line, and not by a round object.
fn is_line(line: &Line, supporters: &[Sighting], noise: f64, axes: Option<f64>) -> bool {
    let part = largest_part(line, supporters);
    let ends = part.first().zip(part.last());
    let Some((from, to)) = ends.filter(|_| part.len() >= FEWEST) else { return false };
    let baseline = line.along(&to.at) - line.along(&from.at);
    // A wall that is slanted against the building's axes is rarer than a wrong line.
    let is_slanted = axes.is_some_and(|axes| from_axis(line.angle - axes).abs() > SLANTED);
    if baseline < BASELINE * if is_slanted { 2.0 } else { 1.0 } {
        return false;
    }
    let residual = |sighting: &Sighting| line.distance(&sighting.at) - sighting.distance;
    let squares: f64 = part.iter().map(|sighting| residual(sighting).powi(2)).sum();
    #[expect(clippy::cast_precision_loss, reason = "some pings")]
    let count = part.len() as f64;
    if squares > count * ROUGHEST * ROUGHEST {
        return false;
    }
    let better = BETTER * noise * noise * if is_slanted { 3.0 } else { 1.0 };
    RADII.iter().all(|&radius| squares_of_circle(line, &part, radius) > squares + better)
}

/// Whether most echoes of a line come from round objects: a circle explains them better. They are compared in pieces, because
/// several round objects can have one tangent; pieces that are too short to distinguish do not count.
#[must_use]
pub fn is_round(line: &Line, sightings: &[Sighting], noise: f64) -> bool {
    const PIECE: f64 = 0.9;
    const SHORTEST: f64 = 0.35;
    let residual = |sighting: &Sighting| line.distance(&sighting.at) - sighting.distance;
    let (mut round, mut all) = (0, 0);
    for part in parts(line, sightings) {
        let start = part.first().map_or(0.0, |first| line.along(&first.at));
        let piece = |sighting: &Sighting| ((line.along(&sighting.at) - start) / PIECE).floor();
        for piece in part.chunk_by(|a, b| (piece(a) - piece(b)).abs() < 0.5) {
            let ends = piece.first().zip(piece.last());
            let length = ends.map_or(0.0, |(a, b)| line.along(&b.at) - line.along(&a.at));
            if piece.len() < 4 || length < SHORTEST {
                continue;
            }
            all += piece.len();
            let squares: f64 = piece.iter().map(|sighting| residual(sighting).powi(2)).sum();
            let better = 0.6 * squares - 6.0 * noise * noise;
            if RADII.iter().any(|&radius| squares_of_circle(line, piece, radius) < better) {
                round += piece.len();
            }
        }
    }
    2 * round > all
}

/// The largest part of the sightings, in order along the line, whose gaps are short. The tangent of two small objects has a
/// gap between them.
fn largest_part(line: &Line, sightings: &[Sighting]) -> Vec<Sighting> {
    parts(line, sightings).into_iter().max_by_key(Vec::len).unwrap_or_default()
}

/// The parts of the sightings without gaps, in order along the line.
fn parts(line: &Line, sightings: &[Sighting]) -> Vec<Vec<Sighting>> {
    const SHORT: f64 = 0.6;
    let mut ordered = sightings.to_vec();
    ordered.sort_by(|a, b| line.along(&a.at).total_cmp(&line.along(&b.at)));
    let parts = ordered.chunk_by(|a, b| line.along(&b.at) - line.along(&a.at) <= SHORT);
    parts.map(<[Sighting]>::to_vec).collect()
}

/// The sum of the squares of a circle that is fitted to the sightings.
fn squares_of_circle(line: &Line, sightings: &[Sighting], radius: f64) -> f64 {
    let Some(middle) = sightings.get(sightings.len() / 2) else { return 0.0 };
    let mut centre = line.point(line.along(&middle.at)) + line.normal() * radius;
    let mut squares = f64::INFINITY;
    for _ in 0..8 {
        let (mut matrix, mut rhs, mut sum) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
        for sighting in sightings {
            let apart = centre - sighting.at;
            let length = apart.norm().max(1e-3);
            let (row, residual) = (apart / length, length - radius - sighting.distance);
            matrix += row * row.transpose();
            rhs -= row * residual;
            sum += residual * residual;
        }
        squares = sum.min(squares);
        matrix += Matrix2::identity() * 1e-6;
        let Some(inverse) = matrix.try_inverse() else { break };
        centre += inverse * rhs;
    }
    squares
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// Echoes along a drive of 2.4 m at y = 0.
    fn echoes(distance: impl Fn(&Vector2<f64>) -> Option<(f64, f64)>) -> Vec<Sighting> {
        let at = (0_u8..80).map(|k| Vector2::new(0.03 * f64::from(k), 0.0));
        let heard = at.enumerate().filter_map(|(ping, at)| {
            let (distance, direction) = distance(&at)?;
            Some(Sighting { ping, pose: ping, at, direction, distance })
        });
        heard.collect()
    }

    /// The echo of a round object, if it is within the cone of a beam along y.
    fn round(at: &Vector2<f64>, centre: [f64; 2], radius: f64) -> Option<(f64, f64)> {
        let apart = Vector2::from(centre) - at;
        let is_heard = (apart.y.atan2(apart.x) - 1.57).abs() < 0.3;
        is_heard.then(|| (apart.norm() - radius, 1.57))
    }

    #[test]
    fn a_wall_is_a_line() {
        let wall = echoes(|at| Some((1.0 + 0.02 * at.x, 1.5)));
        let (line, pings) = propose(&wall, 0.005, None).unwrap();
        assert_eq!(pings.len(), 80);
        assert!((line.distance(&Vector2::zeros()) - 1.0).abs() < 0.005, "{line:?}");
        assert!((line.angle - FRAC_PI_2 - 0.02).abs() < 0.005, "{line:?}");
        assert!(!is_round(&line, &wall, 0.005));
    }

    #[test]
    fn round_objects_are_no_lines() {
        for (distance, radius) in [(0.6, 0.0), (1.0, 0.02), (1.0, 0.15), (0.8, 0.3)] {
            let object = echoes(|at| round(at, [0.6, distance + radius], radius));
            assert_eq!(propose(&object, 0.005, None), None, "{distance} {radius}");
        }
    }

    #[test]
    fn the_tangent_of_two_legs_is_no_line() {
        let legs = echoes(|at| {
            let [one, other] = [0.5, 1.7].map(|x| round(at, [x, 0.8], 0.0));
            let both = one.into_iter().chain(other);
            both.min_by(|a, b| a.0.total_cmp(&b.0))
        });
        let tangent = Line { angle: FRAC_PI_2, offset: 0.81 };
        let near = legs
            .iter()
            .filter(|sighting| (tangent.distance(&sighting.at) - sighting.distance).abs() < 0.03);
        assert!(is_round(&tangent, &near.copied().collect::<Vec<_>>(), 0.005));
    }
}
