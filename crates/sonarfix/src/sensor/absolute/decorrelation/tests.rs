//! Eq. (43) against a dense inverse in `f64`.

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

use super::*;

impl PoseMatrix {
    /// A matrix with these deviations; the factors of the correlations make it positive definite.
    pub(crate) fn correlated([x, y, h]: [f32; 3], [a, b, c]: [f32; 3]) -> Self {
        Self {
            xx: x * x,
            xy: a * x * y,
            yy: (1.0 + a * a) * y * y,
            xh: b * x * h,
            yh: (a * b + c) * y * h,
            hh: (1.0 + b * b + c * c) * h * h,
        }
    }

    /// All its elements.
    pub(crate) fn dense(&self) -> Matrix3<f64> {
        let Self { xx, xy, yy, xh, yh, hh } = *self;
        Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh).map(f64::from)
    }
}

fn vector(v: &PoseVector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.h).map(f64::from)
}

proptest! {
    /// The rows decorrelate the matrix; its inverse and its determinant follow from them.
    #[test]
    fn the_factors_are_those_of_the_matrix(
        sigmas in [0.01_f32..3.0, 0.01_f32..3.0, 0.01_f32..3.0], factors in [-0.9_f32..0.9, -0.9_f32..0.9, -0.9_f32..0.9],
        v in [-3.0_f32..3.0, -3.0_f32..3.0, -3.0_f32..3.0],
    ) {
        let a = PoseMatrix::correlated(sigmas, factors);
        let factors = a.decorrelated().unwrap();
        let [x, y, h] = factors.rows.map(|row| vector(&row));
        let rows = Matrix3::from_rows(&[x.transpose(), y.transpose(), h.transpose()]);
        let is = rows * a.dense() * rows.transpose();
        let variances = Vector3::from(factors.variances).map(f64::from);
        for i in 0..3 {
            for j in 0..3 {
                let expected = if i == j { variances[i] } else { 0.0 };
                let size = f64::from(sigmas[i] * sigmas[j]);
                prop_assert!((is[(i, j)] - expected).abs() < 1e-5 * size, "{i} {j}: {is}");
            }
        }
        let v = PoseVector { x: v[0], y: v[1], h: v[2] };
        let expected = vector(&v).dot(&(a.dense().try_inverse().unwrap() * vector(&v)));
        let squared = f64::from(factors.squared(&v));
        prop_assert!((squared / expected - 1.0).abs() < 1e-3, "{squared} {expected}");
        let ratio = f64::from(factors.determinant()) / a.dense().determinant();
        prop_assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    }

    /// A variance of which less than 1e-6 is independent of the others is refused; more is accepted.
    #[test]
    fn a_matrix_has_to_be_definite_by_more_than_its_rounding(
        sigma in 0.1_f32..10.0, other in 0.1_f32..10.0, which in 0..3_usize, is_definite in any::<bool>(),
    ) {
        let share = if is_definite { 3e-6_f32 } else { 3e-7 };
        let (one, two) = (sigma * sigma, other * other);
        // Of two states with this correlation, the second one keeps this share of its variance.
        let covariance = sigma * other * (1.0 - share).sqrt();
        let a = match which {
            0 => PoseMatrix { xx: one, xy: covariance, yy: two, ..PoseMatrix::IDENTITY },
            1 => PoseMatrix { xx: one, xh: covariance, hh: two, ..PoseMatrix::IDENTITY },
            _ => PoseMatrix { yy: one, yh: covariance, hh: two, ..PoseMatrix::IDENTITY },
        };
        prop_assert_eq!(a.decorrelated().is_some(), is_definite, "{:?}", a);
    }
}

/// Each variance has to be a normal number.
#[test]
fn a_variance_has_to_be_normal() {
    for (variance, is_permitted) in [
        (f32::MIN_POSITIVE, true),
        (0.5 * f32::MIN_POSITIVE, false),
        (0.0, false),
        (-1.0, false),
        (f32::NAN, false),
    ] {
        for a in [
            PoseMatrix { xx: variance, ..PoseMatrix::IDENTITY },
            PoseMatrix { yy: variance, ..PoseMatrix::IDENTITY },
            PoseMatrix { hh: variance, ..PoseMatrix::IDENTITY },
        ] {
            assert_eq!(a.decorrelated().is_some(), is_permitted, "{a:?}");
        }
    }
}

#[test]
fn each_number_has_to_be_finite() {
    let nan = f32::NAN;
    let one = PoseMatrix::IDENTITY;
    assert!(one.is_finite() && PoseVector::default().is_finite());
    let others = [
        PoseMatrix { xx: nan, ..one },
        PoseMatrix { xy: nan, ..one },
        PoseMatrix { yy: nan, ..one },
        PoseMatrix { xh: nan, ..one },
        PoseMatrix { yh: nan, ..one },
        PoseMatrix { hh: nan, ..one },
    ];
    assert!(others.iter().all(|it| !it.is_finite()));
    let zero = PoseVector::default();
    let others = [
        PoseVector { x: nan, ..zero },
        PoseVector { y: nan, ..zero },
        PoseVector { h: nan, ..zero },
    ];
    assert!(others.iter().all(|it| !it.is_finite()));
    let sum = PoseMatrix { xx: 1.0, xy: 2.0, yy: 3.0, xh: 4.0, yh: 5.0, hh: 6.0 }.plus(3.0, &one);
    assert_eq!(sum, PoseMatrix { xx: 4.0, xy: 2.0, yy: 6.0, xh: 4.0, yh: 5.0, hh: 9.0 });
}
