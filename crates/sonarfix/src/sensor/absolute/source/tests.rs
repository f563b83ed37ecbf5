//! Eqs. (41) and (23) against densities in `f64`.

use proptest::prelude::*;

use super::*;
use crate::geometry::units::Duration;

/// The density of a measurement at this NIS, and that of an outlier, which is at most the density at the estimate.
fn densities(fit: &Fit) -> (f64, f64) {
    let turn = core::f64::consts::TAU;
    let numbers = 2 * i32::from(fit.has_position) + i32::from(fit.has_heading);
    let peak = (turn.powi(numbers) * f64::from(fit.determinant)).powf(-0.5);
    // Anywhere in 100 m², in any direction.
    let position = if fit.has_position { 0.01 } else { 1.0 };
    let heading = if fit.has_heading { 1.0 / turn } else { 1.0 };
    (peak * (-0.5 * f64::from(fit.nis)).exp(), (position * heading).min(peak))
}

proptest! {
    /// Association and evidence are those of Bayes' rule.
    #[test]
    fn a_measurement_is_explained_by_the_rule_of_bayes(
        nis in prop_oneof![0.0_f32..30.0, 30.0_f32..150.0], exponent in -20.0_f32..6.0,
        (has_position, has_heading) in prop_oneof![Just((true, true)), Just((true, false)), Just((false, true))],
        outliers in 0.05_f32..0.95,
    ) {
        let fit = Fit { nis, determinant: exponent.exp(), has_position, has_heading };
        let (right, outlier) = densities(&fit);
        let prior = f64::from(outliers);
        let all = (1.0 - prior) * right + prior * outlier;
        let Probabilities { association, evidence } = fit.explain(outliers);
        let expected = (1.0 - prior) * right / all;
        prop_assert!((f64::from(association) - expected).abs() <= 1e-4 * expected, "{association} {expected}");
        let expected = (0.3 + 0.7 * outlier / all).ln();
        prop_assert!((f64::from(evidence) - expected).abs() <= 1e-4, "{evidence} {expected}");
    }

    /// The probability of the next outlier: at least 0.8 of that before, at most 0.95, and with its distance to 0.05 halved after 5 s.
    #[test]
    fn a_source_recovers(outlier in 0.0_f32..=1.0, before in 0.05_f32..=0.95, ticks in 0..60_000_000_u64) {
        let start = Instant::from_ticks(7_000_000);
        let mut sources = Sources::new(start);
        let source = sources.of(true);
        source.record(outlier, before, start);
        let level = f64::from(outlier).max(0.8 * f64::from(before)).min(0.95);
        #[expect(clippy::cast_precision_loss, reason = "a minute")]
        let age = ticks as f64 * 1e-6;
        let expected = 0.05 + (level - 0.05).max(0.0) * 5.0 / (5.0 + age);
        let is = source.outliers(start + Duration::from_ticks(ticks));
        prop_assert!((f64::from(is) - expected).abs() < 1e-6, "{is} {expected}");
        // Before it was recorded, as then.
        let then = source.outliers(start);
        prop_assert_eq!(source.outliers(Instant::from_ticks(1_000)).to_bits(), then.to_bits());
        // Nothing is known of the other source.
        prop_assert!((sources.of(false).outliers(start) - 0.05).abs() < 1e-9);
    }
}

/// Beyond the largest exponent an outlier is certain, and the evidence stays finite.
#[test]
fn the_largest_innovation_has_finite_evidence() {
    for nis in [161.0, 1e6, f32::MAX] {
        let fit = Fit { nis, determinant: 1e-6, has_position: true, has_heading: true };
        let Probabilities { association, evidence } = fit.explain(0.05);
        assert!((0.0..1e-20).contains(&association), "{association}");
        // ln(0.3 + 0.7/0.05).
        assert!((evidence - 2.660_26).abs() < 1e-4, "{evidence}");
    }
}
