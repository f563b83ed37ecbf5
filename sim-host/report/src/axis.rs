//! The axes of a figure: range, tick positions and tick labels.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};

/// Approximate maximum number of ticks on an axis.
const TICKS: u8 = 8;

/// Tick steps within a decade.
const STEPS: [f64; 3] = [1.0, 2.0, 5.0];

/// Decades beyond which a logarithmic axis marks powers of ten only.
const CROWDED: f64 = 2.5;

/// An axis, in what is plotted: on a logarithmic axis, the logarithm of the value.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    /// Label, with the unit.
    pub(super) label: String,
    /// Range.
    pub(super) range: Range<f64>,
    /// Tick positions.
    ticks: Vec<f64>,
    scale: Scale,
}

/// The scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scale {
    /// Linear; all tick labels have the same number of decimals.
    Linear { decimals: usize },
    /// Logarithmic, base 10.
    Logarithmic,
    /// A name for each whole number from zero.
    Named(&'static [&'static str]),
}

impl Axis {
    /// A linear axis.
    pub(super) fn linear(label: &str, range: Range<f64>) -> Self {
        let step = nice_step((range.end - range.start) / f64::from(TICKS));
        let first = (range.start / step).ceil();
        let ticks = std::iter::successors(Some(first), |n| Some(n + 1.0))
            .map(|n| n * step)
            .take_while(|tick| *tick <= range.end)
            .take(usize::from(TICKS) + 1) // where a step is below the resolution of f64
            .collect();
        let scale = Scale::Linear { decimals: decimals(step) };
        Self { label: label.into(), range, ticks, scale }
    }

    /// A logarithmic axis over a range of positive values.
    pub(super) fn logarithmic(label: &str, values: &Range<f64>) -> Self {
        let range = values.start.log10()..values.end.log10();
        let steps = if range.end - range.start > CROWDED { &STEPS[..1] } else { &STEPS[..] };
        let ticks = std::iter::successors(Some(range.start.floor()), |n| Some(n + 1.0))
            .take_while(|decade| *decade <= range.end)
            .flat_map(|decade| steps.iter().map(move |step| decade + step.log10()))
            .filter(|tick| range.contains(tick))
            .collect();
        Self { label: label.into(), range, ticks, scale: Scale::Logarithmic }
    }

    /// An axis with a name for each whole number from zero.
    pub(super) fn named(label: &str, names: &'static [&'static str]) -> Self {
        let ticks: Vec<f64> = (0_u8..).take(names.len()).map(f64::from).collect();
        let range = -0.4..ticks.last().copied().unwrap_or(0.0) + 0.4;
        Self { label: label.into(), range, ticks, scale: Scale::Named(names) }
    }

    /// The same with every second tick.
    pub(super) fn sparse(&self) -> Self {
        Self { ticks: self.ticks.iter().step_by(2).copied().collect(), ..self.clone() }
    }

    /// Range, kind and label for the script of a page.
    pub(super) fn attribute(&self) -> String {
        let kind = match self.scale {
            Scale::Linear { .. } => "linear".to_owned(),
            Scale::Logarithmic => "logarithmic".to_owned(),
            Scale::Named(names) => format!("named:{}", names.join(",")),
        };
        let Range { start, end } = self.range;
        format!("{start} {end} {kind} {}", super::escape::escape(&self.label))
    }

    /// Tick positions.
    pub(super) fn ticks(&self) -> &[f64] {
        &self.ticks
    }

    /// The position of a value on the axis. On a logarithmic axis a value more than a decade below
    /// the range, or zero, is placed a decade below.
    pub(super) fn place(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear { .. } | Scale::Named(_) => value,
            Scale::Logarithmic => value.log10().max(self.range.start - 1.0),
        }
    }

    /// The label of a tick.
    pub(super) fn text(&self, tick: f64) -> String {
        let (value, decimals) = match self.scale {
            Scale::Linear { decimals } => (tick, decimals),
            Scale::Logarithmic => (10.0_f64.powf(tick), decimals(10.0_f64.powf(tick))),
            Scale::Named(names) => {
                let mut numbered = names.iter().zip(0_u8..);
                let named = numbered.find(|(_, n)| (f64::from(*n) - tick).abs() < 0.5);
                return named.map_or_else(String::new, |(name, _)| (*name).to_owned());
            }
        };
        let text = format!("{value:.decimals$}");
        match text.strip_prefix('-') {
            Some(zero) if zero.bytes().all(|byte| matches!(byte, b'0' | b'.')) => zero.into(),
            Some(magnitude) => format!("−{magnitude}"),
            None => text,
        }
    }
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    #[expect(clippy::cast_possible_truncation, reason = "a place on a picture, in pixels")]
    fn map(&self, place: &f64, (from, to): (i32, i32)) -> i32 {
        let part = (place - self.range.start) / (self.range.end - self.range.start);
        from + (part * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        // No minor grid lines.
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

/// The smallest of 1, 2 or 5 times a power of ten that is no less than `step`.
fn nice_step(step: f64) -> f64 {
    let decade = 10.0_f64.powf(step.log10().floor());
    STEPS.into_iter().map(|nice| nice * decade).find(|nice| *nice >= step).unwrap_or(10.0 * decade)
}

/// Decimals needed to write a value of one significant digit.
fn decimals(value: f64) -> usize {
    const MOST: usize = 9;
    // The product of a power and a digit, such as 3 × 0.1, may round down.
    (0..MOST).find(|n| value * power_of_ten(*n) >= 1.0 - 1e-9).unwrap_or(MOST)
}

fn power_of_ten(n: usize) -> f64 {
    (0..n).fold(1.0, |power, _| power * 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis) -> Vec<String> {
        axis.ticks.iter().map(|tick| axis.text(*tick)).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_cross_zero_without_a_sign() {
        let axis = Axis::linear("", -0.5..0.45);
        assert_eq!(texts(&axis), ["−0.4", "−0.2", "0.0", "0.2", "0.4"]);
        assert_eq!(
            texts(&Axis::linear("", 0.0..1248.0)),
            ["0", "200", "400", "600", "800", "1000", "1200"]
        );
    }

    #[test]
    fn logarithmic_ticks_read_as_values() {
        let axis = Axis::logarithmic("", &(0.4..60.0));
        assert_eq!(texts(&axis), ["0.5", "1", "2", "5", "10", "20", "50"]);
    }

    #[test]
    fn many_decades_keep_powers_of_ten_only() {
        let axis = Axis::logarithmic("", &(0.05..600.0));
        assert_eq!(texts(&axis), ["0.1", "1", "10", "100"]);
    }

    #[test]
    fn zero_has_a_place_below_a_logarithmic_axis() {
        let axis = Axis::logarithmic("", &(1.0..10.0));
        assert!((axis.place(0.0) + 1.0).abs() < 1e-12);
        assert!((axis.place(10.0) - 1.0).abs() < 1e-12);
    }
}
