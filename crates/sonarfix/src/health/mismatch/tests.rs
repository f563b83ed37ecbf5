//! The tests of the robot file, against independent sums in f64.

use proptest::prelude::*;

use super::*;
use crate::config::Config;

fn prior() -> CalibrationPrior {
    Config::for_track_width(Metres(0.16)).prior
}

/// x̂ᵀ P₀⁻¹ x̂ by Cramer's rule, in f64.
fn distance(state: &StateEstimate, prior: &CalibrationPrior) -> f64 {
    let (right, left) = (f64::from(prior.scale_right), f64::from(prior.scale_left));
    let (r, l) = (f64::from(state.scale_right), f64::from(state.scale_left));
    let together = prior.difference_of(prior.scale_right, prior.scale_left).map_or(0.0, |apart| {
        0.5 * (right * right + left * left - f64::from(apart) * f64::from(apart))
    });
    let determinant = right * right * left * left - together * together;
    let scales = left * left * r * r - 2.0 * together * r * l + right * right * l * l;
    let width = f64::from(state.track_width_error.0) / f64::from(prior.track_width.0);
    scales / determinant + width * width
}

proptest! {
    /// The wheels are named if, and only if, they are beyond the quantile, with wheels that depend on each other or do not.
    #[test]
    fn wheels_are_named_beyond_the_quantile(
        deviations in (0.005_f32..0.05, 0.005_f32..0.05),
        apart in prop::option::of(0.1_f32..1.0),
        errors in (-0.1_f32..0.1, -0.1_f32..0.1, -0.02_f32..0.02),
    ) {
        let (scale_right, scale_left) = deviations;
        let scale_difference = apart.map(|part| part * scale_right);
        let prior = CalibrationPrior { scale_right, scale_left, scale_difference, ..prior() };
        let (scale_right, scale_left, width) = errors;
        let state = StateEstimate {
            scale_right,
            scale_left,
            track_width_error: Metres(width),
            ..StateEstimate::default()
        };
        let distance = distance(&state, &prior);
        prop_assume!((distance / f64::from(MOST_OF_THREE) - 1.0).abs() > 1e-3);
        let expected = (distance > f64::from(MOST_OF_THREE)).then_some(Mismatch::WheelsOutsidePrior);
        prop_assert_eq!(Mismatch::of(&Health::default(), 1.0, &state, &prior), expected);
    }
}

/// A robot whose wheels are exact has no error of them, and a calibration is not judged while the pose may be wrong.
#[test]
fn only_what_is_estimated_at_a_right_pose_is_judged() {
    let far = StateEstimate { scale_right: 0.2, scale_left: 0.2, ..StateEstimate::default() };
    let exact = CalibrationPrior {
        scale_right: 0.0,
        scale_left: 0.0,
        scale_difference: None,
        track_width: Metres(0.0),
        ..prior()
    };
    assert_eq!(Mismatch::of(&Health::default(), 1.0, &StateEstimate::default(), &exact), None);
    for (verdict, of_wheels, of_mount) in [
        (Verdict::Tracking, Some(Mismatch::WheelsOutsidePrior), Some(Mismatch::MountSuspect)),
        (Verdict::Degraded, None, None),
        (Verdict::Lost, None, None),
    ] {
        let health = Health { verdict, ..Health::default() };
        assert_eq!(Mismatch::of(&health, 1.0, &far, &prior()), of_wheels);
        assert_eq!(Mismatch::of_mount(&health, 0.02 * 0.02, Metres(0.005)), of_mount);
    }
    let health = Health::default();
    assert_eq!(Mismatch::of_mount(&health, 0.015 * 0.015, Metres(0.005)), None);
    assert_eq!(Mismatch::of_mount(&health, 0.02 * 0.02, Metres(0.0)), None);
}

/// Too small a noise comes before the calibration, which depends on it.
#[test]
fn noise_comes_first() {
    let far = StateEstimate { scale_right: 0.2, ..StateEstimate::default() };
    let named = |nis, noise_factor| {
        let health = Health { nis, ..Health::default() };
        Mismatch::of(&health, noise_factor, &far, &prior())
    };
    assert_eq!(named(DEGRADED_NIS, MOST_NOISE), Some(Mismatch::WheelsOutsidePrior));
    assert_eq!(named(2.001, 1.0), Some(Mismatch::NoiseTooSmall));
    assert_eq!(named(1.0, 2.001), Some(Mismatch::NoiseTooSmall));
}
