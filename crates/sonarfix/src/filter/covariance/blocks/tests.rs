//! Variances that are not valid.

use super::*;

/// P is valid and without a negative variance only if each of its variances is.
#[test]
fn each_variance_is_checked() {
    type Set = fn(&mut Covariance, f32);
    let each: [Set; 7] = [
        |p, to| p.pose.xx = to,
        |p, to| p.pose.yy = to,
        |p, to| p.pose.hh = to,
        |p, to| p.calibration.cc = to,
        |p, to| p.calibration.dd = to,
        |p, to| p.calibration.ww = to,
        |p, to| p.range_scale.kk = to,
    ];
    for set in each {
        for (variance, is_valid, is_negative) in [
            (0.0, true, false),
            (1e12, true, false),
            (2e12, false, false),
            (-1e-9, false, true),
            (f32::NAN, false, false),
        ] {
            let mut p = Covariance::independent(&StandardDeviations::from_array([1.0; 7]));
            set(&mut p, variance);
            assert_eq!(p.is_valid(), is_valid, "{variance}: {p:?}");
            assert_eq!(p.has_negative_variance(), is_negative, "{variance}: {p:?}");
        }
    }
}
