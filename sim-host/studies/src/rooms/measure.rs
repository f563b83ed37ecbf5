//! What the cells of the page are coloured by.

use super::sums::Sums;

/// How good a figure is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// As required.
    Good,
    /// Less sure of itself than it could be.
    Cautious,
    /// Beyond the requirement, in three steps.
    Fair,
    /// See `Fair`.
    Poor,
    /// See `Fair`.
    Bad,
}

/// A figure of a cell.
#[derive(Debug, Clone, Copy)]
pub struct Measure {
    /// The head of its column.
    pub name: &'static str,
    /// Its value.
    pub of: fn(&Sums) -> f64,
    /// Decimals.
    pub decimals: usize,
    /// How good it is.
    pub level: fn(&Sums) -> Level,
}

impl Measure {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self { name: "NEES", of: Sums::nees, decimals: 1, level: |sums| consistency(sums.nees()) },
        Self {
            name: "scale",
            of: Sums::range_scale,
            decimals: 1,
            level: |sums| below(sums.range_scale().abs(), [0.5, 1.0, 2.0]),
        },
        Self {
            name: "RMS",
            of: |sums| 1e3 * sums.rms(),
            decimals: 0,
            level: |sums| below(sums.rms() / sums.bound(), [1.5, 3.0, 6.0]),
        },
        Self {
            name: "far",
            of: |sums| percent(sums, sums.far),
            decimals: 0,
            level: |sums| below(percent(sums, sums.far), [0.5, 3.0, 10.0]),
        },
        Self {
            name: "false",
            of: |sums| percent(sums, sums.falsely),
            decimals: 0,
            level: |sums| below(percent(sums, sums.falsely), [0.5, 3.0, 10.0]),
        },
        Self {
            name: "lost",
            of: |sums| percent(sums, sums.lost),
            decimals: 0,
            level: |sums| below(percent(sums, sums.lost), [0.1, 1.0, 5.0]),
        },
    ];
}

fn percent(sums: &Sums, count: u32) -> f64 {
    100.0 * sums.share(count)
}

/// The level of a mean NEES over its number of states.
fn consistency(nees: f64) -> Level {
    if nees < 0.8 { Level::Cautious } else { below(nees, [1.3, 2.0, 4.0]) }
}

/// The level of a value by the limits of the first three; a value that is not a number is the last.
fn below(value: f64, [good, fair, poor]: [f64; 3]) -> Level {
    let levels = [(good, Level::Good), (fair, Level::Fair), (poor, Level::Poor)];
    levels.into_iter().find(|(limit, _)| value <= *limit).map_or(Level::Bad, |(_, level)| level)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_that_is_not_sure_enough_differs_from_one_that_is_too_sure() {
        use Level::{Bad, Cautious, Fair, Good, Poor};
        let levels = [0.5, 0.9, 1.5, 3.0, 9.0, f64::NAN].map(consistency);
        assert_eq!(levels, [Cautious, Good, Fair, Poor, Bad, Bad]);
    }
}
