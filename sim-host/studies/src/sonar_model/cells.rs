//! Classification of pings as in the table of the recordings' README: by the distance of the wall on
//! the beam's axis, by the angle between axis and normal, and by the returned range.

use sonarfix_sim::angle;
use sonarfix_sim::world::World;
use sonarfix_sim::world::segment::{Point, distance};

/// Rows of 5° off the normal, up to 60°.
pub const ROWS: usize = 12;
/// Angle per row, degrees.
pub const ROW: f64 = 5.0;
/// Columns by the perpendicular distance, metres: below the first, between, from the second on.
pub const RANGES: [f64; 2] = [0.6, 1.1];
/// Tolerance of a range against a distance, metres.
const NEAR: f64 = 0.04;

/// One ping with its range.
#[derive(Clone, Copy)]
pub struct Beam<'a> {
    /// Position of the sonar, metres.
    pub world: &'a World,
    /// Of the sonar, metres.
    pub from: Point,
    /// Direction of the beam's axis, radians.
    pub axis: f64,
    /// Range, metres.
    pub reading: Option<f64>,
}

/// The class of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The perpendicular distance.
    Perpendicular,
    /// The distance along the axis.
    Axis,
    /// No echo.
    Silence,
    /// Another range.
    Other,
}

/// The counts of one cell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cell {
    counts: [u32; 4],
    /// Of the other ranges, those shorter than the perpendicular distance.
    short: u32,
    bias: f64,
}

impl Cell {
    /// Number of pings.
    #[must_use]
    pub fn pings(&self) -> u32 {
        self.counts.iter().sum()
    }

    /// Shares of the four outcomes, in the order of [`Outcome`]; `None` without pings.
    #[must_use]
    pub fn shares(&self) -> Option<[f64; 4]> {
        let pings = f64::from(self.pings());
        (pings > 0.0).then(|| self.counts.map(|count| f64::from(count) / pings))
    }

    /// Number of perpendicular returns.
    #[must_use]
    pub fn perpendicular(&self) -> u32 {
        let [perpendicular, ..] = self.counts;
        perpendicular
    }

    /// Numbers of pings without an echo, with a shorter range than the wall's, and with a longer one that is not that along
    /// the axis.
    #[must_use]
    pub fn clutter(&self) -> [u32; 3] {
        let [_, _, silence, other] = self.counts;
        [silence, self.short, other - self.short]
    }

    /// Mean error of the perpendicular returns, metres.
    #[must_use]
    pub fn bias(&self) -> Option<f64> {
        let [perpendicular, ..] = self.counts;
        (perpendicular > 0).then(|| self.bias / f64::from(perpendicular))
    }
}

/// All cells.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cells([[Cell; 3]; ROWS]);

impl Cells {
    /// Adds a ping, if the wall on its axis has a foot of the perpendicular and the angle has a row.
    pub fn count(&mut self, beam: Beam) {
        let Some((perpendicular, along_axis, off)) = beam.geometry() else {
            return;
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 17")]
        let row = (off.to_degrees() / ROW) as usize;
        let column = RANGES.iter().filter(|&&from| perpendicular >= from).count();
        let Some(cell) = self.0.get_mut(row).and_then(|row| row.get_mut(column)) else {
            return;
        };
        let outcome = outcome(beam.reading, perpendicular, along_axis);
        if let Some(count) = cell.counts.get_mut(outcome as usize) {
            *count += 1;
        }
        if outcome == Outcome::Other && beam.reading.is_some_and(|range| range < perpendicular) {
            cell.short += 1;
        }
        if outcome == Outcome::Perpendicular {
            cell.bias += beam.reading.map_or(0.0, |reading| reading - perpendicular);
        }
    }

    /// The rows, nearest to the normal first.
    #[must_use]
    pub fn rows(&self) -> &[[Cell; 3]] {
        &self.0
    }
}

impl Beam<'_> {
    /// Perpendicular distance, distance along the axis, and the angle between the two.
    fn geometry(&self) -> Option<(f64, f64, f64)> {
        let (wall, hit) = self.world.on_axis(self.from, self.axis)?;
        let segment = self.world.walls().get(wall)?;
        let (_, perpendicular) = segment.foot(self.from)?;
        let off = angle::wrap(self.axis - segment.normal_towards(self.from)).abs();
        Some((perpendicular, distance(self.from, hit), off))
    }
}

fn outcome(reading: Option<f64>, perpendicular: f64, along_axis: f64) -> Outcome {
    match reading {
        None => Outcome::Silence,
        Some(range) if (range - perpendicular).abs() <= NEAR => Outcome::Perpendicular,
        Some(range) if (range - along_axis).abs() <= NEAR => Outcome::Axis,
        Some(_) => Outcome::Other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_sim::world::segment::Segment;

    #[test]
    fn every_outcome_goes_into_the_cell_of_its_angle_and_range() {
        let world = World::of(vec![Segment::new([1.0, -5.0], [1.0, 5.0])]);
        let mut cells = Cells::default();
        // 1 m off, 32° off the normal: 1.18 m along the axis.
        let along = 1.0 / 32.0_f64.to_radians().cos();
        for reading in [Some(1.03), Some(along), None, Some(1.1), Some(0.5), Some(0.99)] {
            let axis = -32.0_f64.to_radians();
            cells.count(Beam { world: &world, from: [0.0, 0.0], axis, reading });
        }
        let filled: Vec<(usize, usize)> = cells
            .rows()
            .iter()
            .enumerate()
            .flat_map(|(r, row)| row.iter().enumerate().map(move |(c, cell)| (r, c, cell)))
            .filter(|(_, _, cell)| cell.pings() > 0)
            .map(|(r, c, _)| (r, c))
            .collect();
        assert_eq!(filled, [(6, 1)]);
        let cell = cells.rows()[6][1];
        assert_eq!(cell.counts, [2, 1, 1, 2]);
        assert_eq!((cell.perpendicular(), cell.clutter()), (2, [1, 1, 1]));
        assert!((cell.bias().unwrap() - 0.01).abs() < 1e-12);
    }

    #[test]
    fn a_beam_past_the_end_of_a_wall_is_not_assigned_to_it() {
        let world = World::of(vec![Segment::new([1.0, 0.2], [1.0, 5.0])]);
        let mut cells = Cells::default();
        let beam = Beam { world: &world, from: [0.0, 0.0], axis: 0.5, reading: Some(1.0) };
        cells.count(beam);
        assert_eq!(cells, Cells::default());
    }
}
