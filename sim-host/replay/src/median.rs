//! A median of any number of values, in memory of a fixed size.

/// Ratio of successive bin edges: the relative error of the median is half of its excess over 1.
const RATIO: f64 = 1.01;
/// The upper edge of the first bin: a micrometre is negligible.
const SMALLEST: f64 = 1e-6;
/// Bins up to 10⁴ m: ln(10¹⁰) / ln(1.01), and one for smaller values.
const BINS: usize = 2316;

/// A histogram with logarithmic bins.
#[derive(Debug, Clone)]
pub struct Median {
    bins: Vec<u64>,
    count: u64,
}

impl Default for Median {
    fn default() -> Self {
        Self { bins: vec![0; BINS], count: 0 }
    }
}

impl Median {
    /// Adds a value, not negative.
    pub fn add(&mut self, value: f64) {
        let bin = (value / SMALLEST).ln() / RATIO.ln();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "`as` saturates: what is tiny goes to the first bin, what is huge to the last"
        )]
        let bin = (bin.ceil().max(0.0) as usize).min(BINS - 1);
        if let Some(count) = self.bins.get_mut(bin) {
            *count += 1;
            self.count += 1;
        }
    }

    /// The median, within half a per cent; `None` without values.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        let mut before = 0;
        let bin = self.bins.iter().position(|count| {
            before += count;
            before > 0 && 2 * before >= self.count
        })?;
        let bin = i32::try_from(bin).unwrap_or(i32::MAX);
        Some(SMALLEST * RATIO.powi(bin) / RATIO.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Half a per cent from the true median, over the whole range.
        #[test]
        fn the_median_is_right_to_half_a_per_cent(
            exponents in prop::collection::vec(-5.9_f64..3.9, 1..200)
        ) {
            let mut values: Vec<f64> = exponents.iter().map(|e| 10_f64.powf(*e)).collect();
            let mut median = Median::default();
            for value in &values {
                median.add(*value);
            }
            values.sort_by(f64::total_cmp);
            let exact = values[(values.len() - 1) / 2];
            let got = median.value().unwrap();
            prop_assert!((got / exact - 1.0).abs() < 0.0051, "{got} instead of {exact}");
        }
    }

    #[test]
    fn extremes_have_a_bin() {
        let mut median = Median::default();
        assert_eq!(median.value(), None);
        for value in [0.0, 1e-30, 1e30] {
            median.add(value);
        }
        assert!(median.value().unwrap() < 1.01e-6);
    }
}
