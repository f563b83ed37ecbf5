//! Variances beyond their limits.

use super::*;

/// A negative variance becomes zero, and one that is too large or not finite the largest one; the others are unchanged.
#[test]
fn a_variance_is_limited_by_itself() {
    type Set = fn(&mut PoseBlock, f32);
    let each: [Set; 3] = [|p, to| p.xx = to, |p, to| p.yy = to, |p, to| p.hh = to];
    let valid = PoseBlock { xx: 1.0, yy: 2.0, hh: 3.0, xy: 0.5, xh: 0.25, ..PoseBlock::default() };
    for (variance, limited) in [
        (4.0, 4.0),
        (0.0, 0.0),
        (-1e-9, 0.0),
        (f32::NEG_INFINITY, 0.0),
        (1e12, 1e12),
        (2e12, 1e12),
        (f32::INFINITY, 1e12),
        (f32::NAN, 1e12),
    ] {
        for set in each {
            let (mut is, mut expected) = (valid, valid);
            set(&mut is, variance);
            set(&mut expected, limited);
            is.limit_variances();
            assert_eq!(is, expected, "{variance}");
        }
    }
}
