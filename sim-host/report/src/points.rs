//! Decimation of long series, and clipping of lines.

use std::ops::Range;

/// A point of a plot, in the units of its axes.
pub(super) type Point = (f64, f64);

/// Maximum number of points of a line, to limit the file size.
const MOST_POINTS: usize = 2_000;
/// Number of buckets of a series, each with at most four points. On a plot 640 pixels wide a bucket
/// is about a pixel wide.
const BUCKETS: usize = MOST_POINTS / 4;

/// Keeps the first, last, lowest and highest point of every bucket of a series over time.
///
/// A line through these covers the same pixels as the whole series (Jugel et al., "M4: A
/// Visualization-Oriented Time Series Data Aggregation", VLDB 2014).
pub(super) fn decimate(points: &[Point]) -> Vec<Point> {
    if points.len() <= MOST_POINTS {
        return points.to_vec();
    }
    points.chunks(points.len().div_ceil(BUCKETS)).flat_map(extremes).collect()
}

/// The first, last, lowest and highest point of a bucket, in the order of the series, each once.
fn extremes(bucket: &[Point]) -> Vec<Point> {
    let height = |a: &(usize, Point), b: &(usize, Point)| a.1.1.total_cmp(&b.1.1);
    let mut numbered = bucket.iter().copied().enumerate();
    let lowest = numbered.clone().min_by(height);
    let highest = numbered.clone().max_by(height);
    let mut kept: Vec<_> = [numbered.clone().next(), numbered.next_back(), lowest, highest]
        .into_iter()
        .flatten()
        .collect();
    kept.sort_unstable_by_key(|(index, _)| *index);
    kept.dedup_by_key(|(index, _)| *index);
    kept.into_iter().map(|(_, point)| point).collect()
}

/// Removes points of a path that are within a tolerance of the line between others. The tolerance
/// doubles until few enough points are left. Corners stay.
pub(super) fn simplify(points: &[Point], tolerance: f64) -> Vec<Point> {
    let least = tolerance.max(f64::EPSILON); // doubling zero would not terminate
    let tolerances = std::iter::successors(Some(least), |tolerance| Some(2.0 * tolerance));
    let mut paths = tolerances.map(|tolerance| without_detours(points, tolerance));
    paths.find(|path| path.len() <= MOST_POINTS).unwrap_or_default()
}

/// The algorithm of Ramer (1972) and Douglas and Peucker (1973): a stretch becomes its chord if no
/// point is farther away than the tolerance; otherwise it is split at the farthest point.
fn without_detours(points: &[Point], tolerance: f64) -> Vec<Point> {
    let mut kept: Vec<Point> = points.first().copied().into_iter().collect();
    let mut stretches = vec![points];
    while let Some(stretch) = stretches.pop() {
        let [first, between @ .., last] = stretch else {
            continue;
        };
        let distances = between.iter().map(|point| distance(*point, *first, *last)).enumerate();
        match distances.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((index, far)) if far > tolerance => {
                stretches.extend(stretch.get(index + 1..));
                stretches.extend(stretch.get(..index + 2));
            }
            _ => kept.push(*last),
        }
    }
    kept
}

/// The distance of a point from a segment.
fn distance(point: Point, from: Point, to: Point) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (px, py) = (point.0 - from.0, point.1 - from.1);
    let length_squared = dx * dx + dy * dy;
    let part = if length_squared > 0.0 { (px * dx + py * dy) / length_squared } else { 0.0 };
    let part = part.clamp(0.0, 1.0);
    (px - part * dx).hypot(py - part * dy)
}

/// Clips a line to the pieces inside a rectangle.
pub(super) fn clip(points: &[Point], x: &Range<f64>, y: &Range<f64>) -> Vec<Vec<Point>> {
    let mut pieces: Vec<Vec<Point>> = Vec::new();
    for (from, to) in points.iter().zip(points.iter().skip(1)) {
        let Some((enter, leave)) = clip_segment(*from, *to, x, y) else {
            continue;
        };
        match pieces.last_mut() {
            Some(piece) if piece.last() == Some(&enter) => piece.push(leave),
            _ => pieces.push(vec![enter, leave]),
        }
    }
    pieces
}

/// The part of a segment inside a rectangle, by Liang and Barsky's method (1984): each side of the
/// rectangle narrows the stretch of the segment, as fractions of its length, that may be inside.
fn clip_segment(from: Point, to: Point, x: &Range<f64>, y: &Range<f64>) -> Option<(Point, Point)> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let sides = [
        (-dx, from.0 - x.start),
        (dx, x.end - from.0),
        (-dy, from.1 - y.start),
        (dy, y.end - from.1),
    ];
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (outward, room) in sides {
        if outward < 0.0 {
            enter = enter.max(room / outward);
        } else if outward > 0.0 {
            leave = leave.min(room / outward);
        } else if room < 0.0 {
            return None; // parallel to this side, and beyond it
        }
    }
    // The ends are returned unchanged, so that the next segment joins exactly.
    let at = |part: f64| (from.0 + part * dx, from.1 + part * dy);
    let start = if enter > 0.0 { at(enter) } else { from };
    let end = if leave < 1.0 { at(leave) } else { to };
    (enter <= leave).then_some((start, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_series_is_unchanged() {
        let points: Vec<Point> = (0..2_000).map(|n| (f64::from(n), 1.0)).collect();
        assert_eq!(decimate(&points), points);
    }

    /// One spike up and one down, each a single point among 36,000, survive, and so do the ends.
    #[test]
    fn decimation_keeps_extremes_and_ends() {
        let mut points: Vec<Point> =
            (0..36_000).map(|n| (f64::from(n), (f64::from(n) / 100.0).sin())).collect();
        points[12_345].1 = 50.0;
        points[23_456].1 = -70.0;
        let kept = decimate(&points);
        assert!(kept.len() <= 2_000, "{}", kept.len());
        for index in [0, 12_345, 23_456, 35_999] {
            assert!(kept.contains(&points[index]), "point {index} is lost");
        }
        assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0), "out of order, or twice");
    }

    /// A lap keeps its corners exactly, and no points between them.
    #[test]
    fn a_thinned_path_keeps_its_corners() {
        let along = |n: i32| f64::from(n) * 0.01;
        let east = (0..5_000).map(|n| (along(n), 0.0));
        let north = (0..5_000).map(|n| (along(5_000), along(n)));
        let back = (0..5_000).map(|n| (along(5_000 - n), along(5_000)));
        let path: Vec<Point> = east.chain(north).chain(back).collect();
        let corners = [(0.0, 0.0), (50.0, 0.0), (50.0, 50.0), (along(1), 50.0)];
        assert_eq!(simplify(&path, 0.001), corners);
    }

    /// Noise above the tolerance does not keep every point: the tolerance grows.
    #[test]
    fn a_noisy_path_is_short_too() {
        let path: Vec<Point> =
            (0..20_000).map(|n| (f64::from(n) * 0.01, f64::from(n * 7_919 % 101) * 1e-3)).collect();
        let kept = simplify(&path, 1e-6);
        assert!(kept.len() <= MOST_POINTS, "{}", kept.len());
        assert_eq!((kept.first(), kept.last()), (path.first(), path.last()));
    }

    #[test]
    fn a_path_without_motion_is_reduced_to_its_ends() {
        assert_eq!(simplify(&vec![(1.0, 1.0); 5_000], 0.0), [(1.0, 1.0); 2]);
        assert!(simplify(&[], 0.1).is_empty());
    }

    #[test]
    fn a_line_that_leaves_the_area_and_returns_becomes_two() {
        let line = [(0.5, 0.5), (0.5, 2.0), (0.7, 2.0), (0.7, 0.5), (0.6, 0.5)];
        let pieces = clip(&line, &(0.0..1.0), &(0.0..1.0));
        let first = vec![(0.5, 0.5), (0.5, 1.0)];
        let second = vec![(0.7, 1.0), (0.7, 0.5), (0.6, 0.5)];
        assert_eq!(pieces, [first, second]);
    }

    #[test]
    fn a_line_that_passes_by_is_not_drawn() {
        assert!(clip(&[(-1.0, 0.5), (-0.5, 0.9)], &(0.0..1.0), &(0.0..1.0)).is_empty());
        assert!(clip(&[(-1.0, 0.5), (0.5, 2.5)], &(0.0..1.0), &(0.0..1.0)).is_empty());
    }
}
