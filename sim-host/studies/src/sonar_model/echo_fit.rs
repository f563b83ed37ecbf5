//! The parameters of the echo model of the core, fitted to recorded pings.

use sonarfix_map::devices::NXT_ECHO;

use super::cells::{Cell, Cells, ROW};

/// Rows within 20° of the normal: a localizer aims within them.
const WITHIN: usize = 4;
/// Rows within 15°, where a wall is fully audible.
const FULLY: usize = 3;
/// Rows within 35°, where half of the walls or more are heard below 0.6 m.
const HEARD: usize = 7;
/// Rows of the audibility, up to 45°.
const AUDIBLE: usize = 9;

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct EchoFit {
    /// For each range: the number of pings, and the shares without an echo, of shorter and of longer ranges.
    pub by_range: Vec<(u32, [f64; 3])>,
    /// The shares of the longest ranges: `missed`, `short`, `long`.
    pub far: [f64; 3],
    /// The share of perpendicular returns by row, relative to that within 15°, mean over the ranges.
    pub audible: Vec<f64>,
    /// Angle at which it is one half, degrees; infinite if it never is.
    pub half_angle: f64,
    /// For each range: root mean square of what the preset's lateness leaves of the bias by angle, metres.
    pub systematic: [f64; 3],
}

impl EchoFit {
    /// The fit to measured cells.
    #[must_use]
    pub fn of(measured: &Cells) -> Self {
        let by_range: Vec<_> = (0..3).map(|column| shares(measured, column)).collect();
        let far = by_range.last().map_or([f64::NAN; 3], |(_, shares)| *shares);
        let audible: Vec<f64> = (0..AUDIBLE).map(|row| audible(measured, row)).collect();
        let half_angle = half_angle(&audible);
        let systematic = [0, 1, 2].map(|column| systematic(measured, column));
        Self { by_range, far, audible, half_angle, systematic }
    }
}

fn column(
    measured: &Cells,
    rows: std::ops::Range<usize>,
    column: usize,
) -> impl Iterator<Item = &Cell> {
    let rows = measured.rows().iter().skip(rows.start).take(rows.len());
    rows.filter_map(move |row| row.get(column))
}

fn shares(measured: &Cells, of: usize) -> (u32, [f64; 3]) {
    let mut counts = [0; 3];
    let mut pings = 0;
    for cell in column(measured, 0..WITHIN, of) {
        pings += cell.pings();
        for (sum, count) in counts.iter_mut().zip(cell.clutter()) {
            *sum += count;
        }
    }
    (pings, counts.map(|count| share(count, pings)))
}

fn audible(measured: &Cells, row: usize) -> f64 {
    let heard = |rows: std::ops::Range<usize>, of: usize| {
        let cells: Vec<&Cell> = column(measured, rows, of).collect();
        let pings: u32 = cells.iter().map(|cell| cell.pings()).sum();
        let heard: u32 = cells.iter().map(|cell| cell.perpendicular()).sum();
        (pings > 0).then(|| share(heard, pings))
    };
    let ratios = (0..3).filter_map(|of| Some(heard(row..row + 1, of)? / heard(0..FULLY, of)?));
    let ratios: Vec<f64> = ratios.collect();
    let sum: f64 = ratios.iter().sum();
    // Not a number without pings.
    sum / f64::from(u32::try_from(ratios.len()).unwrap_or(u32::MAX))
}

#[expect(clippy::cast_precision_loss, reason = "a dozen rows")]
fn half_angle(audible: &[f64]) -> f64 {
    let middle = |row: usize| (row as f64 + 0.5) * ROW;
    for (row, pair) in audible.windows(2).enumerate() {
        if let [before, after] = pair
            && *before >= 0.5
            && *after < 0.5
        {
            return middle(row) + ROW * (before - 0.5) / (before - after);
        }
    }
    f64::INFINITY
}

/// Each row is weighted by its perpendicular returns.
#[expect(clippy::cast_precision_loss, reason = "a dozen rows")]
fn systematic(measured: &Cells, of: usize) -> f64 {
    let [late, per_radian] = [NXT_ECHO.late, NXT_ECHO.late_per_radian].map(|it| f64::from(it.0));
    let (mut sum, mut weight) = (0.0, 0.0);
    for (row, cell) in column(measured, 0..HEARD, of).enumerate() {
        let off = ((row as f64 + 0.5) * ROW).to_radians();
        let left = cell.bias().unwrap_or(f64::NAN) - late - per_radian * off;
        let returns = f64::from(cell.perpendicular());
        if returns > 0.0 {
            sum += returns * left * left;
            weight += returns;
        }
    }
    (sum / weight).sqrt()
}

fn share(count: u32, of: u32) -> f64 {
    f64::from(count) / f64::from(of.max(1))
}

#[cfg(test)]
mod tests {
    use sonarfix_sim::world::World;
    use sonarfix_sim::world::segment::Segment;

    use super::*;
    use crate::sonar_model::cells::Beam;

    /// At the longest range, of 20 pings within 20° one is missed, two are short and three long; at 32° half of the walls are heard.
    #[test]
    fn a_fit_returns_the_shares_that_it_was_given() {
        let mut cells = Cells::default();
        for distance in [0.4, 0.8, 2.0] {
            let world = World::of(vec![Segment::new([distance, -9.0], [distance, 9.0])]);
            let mut count = |degrees: f64, reading: Option<f64>| {
                let axis = degrees.to_radians();
                cells.count(Beam { world: &world, from: [0.0, 0.0], axis, reading });
            };
            for n in 0..20_u32 {
                let reading = match n {
                    _ if distance < 1.1 => Some(distance),
                    0 => None,
                    1 | 2 => Some(0.5 * distance),
                    3..=5 => Some(1.5 * distance),
                    _ => Some(distance),
                };
                count(f64::from(n % 4) * 5.0 + 2.0, reading);
            }
            for n in 0..10_u32 {
                count(22.0, Some(distance));
                count(27.0, Some(distance));
                count(32.0, (n % 2 == 0).then_some(distance));
                count(37.0, None);
            }
        }
        let fit = EchoFit::of(&cells);
        for (found, expected) in fit.far.into_iter().zip([0.05, 0.1, 0.15]) {
            assert!((found - expected).abs() < 1e-12, "{fit:?}");
        }
        assert_eq!(fit.by_range[1].0, 20);
        // Within 15° all pings are heard, at the longest range 10 of 15; at 30–35° one half: 0.75 of it.
        let at_32 = (0.5 + 0.5 + 0.75) / 3.0;
        assert!((fit.audible[6] - at_32).abs() < 1e-12 && fit.audible[7] < 1e-12, "{fit:?}");
        let half = 32.5 + 5.0 * (at_32 - 0.5) / at_32;
        assert!((fit.half_angle - half).abs() < 1e-9, "{}", fit.half_angle);
    }

    /// Perpendicular ranges as late as the preset says, and 6 mm more at 12°: a fifth of the pings.
    #[test]
    fn what_lateness_leaves_is_systematic() {
        let mut cells = Cells::default();
        let world = World::of(vec![Segment::new([0.4, -9.0], [0.4, 9.0])]);
        for (degrees, more) in [(2.5_f64, 0.0), (7.5, 0.0), (12.5, 0.006), (17.5, 0.0), (22.5, 0.0)]
        {
            let axis = degrees.to_radians();
            let late = f64::from(NXT_ECHO.late_per_radian.0) * axis;
            let reading = Some(0.4 + late + more);
            cells.count(Beam { world: &world, from: [0.0, 0.0], axis, reading });
        }
        let [near, ..] = EchoFit::of(&cells).systematic;
        assert!((near - 0.006 / 5.0_f64.sqrt()).abs() < 1e-9, "{near}");
    }
}
