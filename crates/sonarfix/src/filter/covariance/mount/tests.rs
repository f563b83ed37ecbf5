//! The columns of the mount against dense 10×10 matrices in `f64`, in the order x, y, h, c, d, w, k, ahead, left, bias of
//! a gyro.

use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

use super::super::dense::{self, is_near};
use super::*;
use crate::filter::covariance::{Correction, Covariance};
use crate::geometry::pose::Heading;
use crate::geometry::units::Radians;
use crate::sensor::range::ExpectedRange;

type Matrix = SMatrix<f64, 10, 10>;
type Vector = SVector<f64, 10>;

const H: usize = 2;
const AHEAD: usize = 7;
const LEFT: usize = 8;
const BIAS: usize = 9;

/// A covariance with a mount and a bias: correlated, with deviations of the usual sizes.
fn covariance(numbers: &[f32]) -> (Covariance, Mount, GyroBias) {
    let sigma = [0.1, 0.1, 0.05, 0.01, 0.01, 0.005, 0.01, 0.005, 0.005, 0.02];
    let p = dense::correlated(sigma, numbers);
    #[expect(clippy::cast_possible_truncation, reason = "numbers of the filter")]
    let at = |i: usize, j: usize| p[(i, j)] as f32;
    let column = |j: usize| dense::column(|i| at(i, j));
    let mount = Mount {
        place: Point::new(0.06, 0.0),
        ahead: column(AHEAD),
        left: column(LEFT),
        aa: at(AHEAD, AHEAD),
        al: at(AHEAD, LEFT),
        ll: at(LEFT, LEFT),
    };
    let bias = GyroBias {
        rate: 0.01,
        states: column(BIAS),
        mount: (at(AHEAD, BIAS), at(LEFT, BIAS)),
        bb: at(BIAS, BIAS),
    };
    (dense::blocks(at), mount, bias)
}

fn dense(p: &Covariance, m: &Mount, b: &GyroBias) -> Matrix {
    let (ba, bl) = b.mount;
    let own = [[m.aa, m.al, ba], [m.al, m.ll, bl], [ba, bl, b.bb]];
    dense::joint(p, [&m.ahead, &m.left, &b.states], own)
}

fn numbers() -> impl Strategy<Value = std::vec::Vec<f32>> {
    prop::collection::vec(-1.0_f32..1.0, 100)
}

/// A range with these derivatives, and its derivatives by the mount for this heading.
fn range(by: [f32; 4], heading: f32) -> (ExpectedRange, (f32, f32), Vector) {
    let [by_x, by_y, by_heading, by_range_scale] = by;
    let (sin, cos) = heading.sin_cos();
    let mount = (by_x * cos + by_y * sin, by_y * cos - by_x * sin);
    let direction = Heading::new(Radians(0.0));
    let expected =
        ExpectedRange { range: Metres(1.0), by_x, by_y, by_heading, by_range_scale, direction };
    let h = [by_x, by_y, by_heading, 0.0, 0.0, 0.0, by_range_scale, mount.0, mount.1, 0.0];
    (expected, mount, Vector::from(h.map(f64::from)))
}

prop_compose! {
    fn derivatives()(angle in -3.1_f32..3.1, by_heading in -0.2_f32..0.2, by_scale in 0.1_f32..3.0) -> [f32; 4] {
        let (sin, cos) = angle.sin_cos();
        [cos, sin, by_heading, by_scale]
    }
}

proptest! {
    /// P, columns, mount and bias as one covariance of ten states; from a noise of 0.3 mm on with the second pass.
    #[test]
    fn a_range_corrects_all_ten_states(
        numbers in numbers(), by in derivatives(), heading in -3.1_f32..3.1,
        deviation in 3e-4_f32..0.1, innovation in -0.1_f32..0.1,
    ) {
        let (mut p, mut mount, mut bias) = covariance(&numbers);
        let (expected, of_mount, h) = range(by, heading);
        let mut prediction = p.project(&expected);
        mount.add_to(&mut prediction, of_mount);
        let before = dense(&p, &mount, &bias);
        let m = before * h;
        let noise = deviation * deviation;
        let s = h.dot(&m) + f64::from(noise);
        prop_assert!((f64::from(prediction.variance + noise) / s - 1.0).abs() < 1e-4);
        let place = mount.place;
        let Correction::Applied(gain) = p.correct(&prediction, noise) else {
            return Err(TestCaseError::fail("not applied"));
        };
        let own = mount.covariance_with(&prediction);
        bias.correct(&prediction, own, &gain, innovation, 1.0);
        mount.correct(own, &gain, innovation, 1.0);
        let expected = before - m * m.transpose() / s;
        prop_assert!(is_near(&dense(&p, &mount, &bias), &expected, &before));
        for (is, was, index) in [(mount.place.x, place.x, AHEAD), (mount.place.y, place.y, LEFT)] {
            let moved = m[index] / s * f64::from(innovation);
            prop_assert!((f64::from((is - was).0) - moved).abs() < 1e-6);
        }
    }

    /// The gain of a range that does not change P.
    #[test]
    fn the_gain_contains_the_mount(numbers in numbers(), by in derivatives(), heading in -3.1_f32..3.1, s in 0.001_f32..1.0) {
        let (p, mount, bias) = covariance(&numbers);
        let (expected, of_mount, h) = range(by, heading);
        let mut prediction = p.project(&expected);
        mount.add_to(&mut prediction, of_mount);
        let before = dense(&p, &mount, &bias);
        let m = before * h;
        let gain = p.gain(&prediction, s);
        let is = [gain.x, gain.y, gain.h, gain.c, gain.d, gain.w, gain.k];
        for (i, is) in is.into_iter().enumerate() {
            let size = before[(i, i)].sqrt() * h.dot(&m).sqrt() / f64::from(s);
            prop_assert!((f64::from(is) - m[i] / f64::from(s)).abs() < 1e-4 * size, "{i}");
        }
    }

    #[test]
    fn a_difference_of_turns_corrects_all_ten_states(
        numbers in numbers(), by in [-0.3_f32..0.3, -0.3_f32..0.3, -0.3_f32..0.3, 0.1_f32..1.0], noise in 1e-6_f32..1e-3,
        innovation in -0.05_f32..0.05,
    ) {
        let (mut p, mut mount, mut bias) = covariance(&numbers);
        let [by_c, by_d, by_w, by_b] = by;
        let difference = TurnDifference { value: 0.0, by_c, by_d, by_w, by_b, noise };
        let a = Vector::from([0.0, 0.0, 0.0, by_c, by_d, by_w, 0.0, 0.0, 0.0, by_b].map(f64::from));
        let before = dense(&p, &mount, &bias);
        let m = before * a;
        let s = a.dot(&m) + f64::from(noise);
        let own = mount.covariance_with_turns(&difference, &bias);
        let gain = p.correct_by_turns(&mut bias, &difference, own, innovation).unwrap();
        mount.correct(own, &gain, innovation, 1.0);
        let expected = before - m * m.transpose() / s;
        prop_assert!(is_near(&dense(&p, &mount, &bias), &expected, &before));
    }

    #[test]
    fn a_turn_by_the_bias_is_that_of_the_matrix(numbers in numbers(), factor in -1.0_f32..1.0) {
        let (mut p, mut mount, mut bias) = covariance(&numbers);
        let mut f = Matrix::identity();
        f[(H, BIAS)] = factor.into();
        let expected = f * dense(&p, &mount, &bias) * f.transpose();
        mount.turn(&bias, factor);
        bias.turn(&mut p, factor);
        prop_assert!(is_near(&dense(&p, &mount, &bias), &expected, &expected));
    }

    /// Eq. (44): along a correction of all states, that of the mount among them.
    #[test]
    fn the_columns_grow_along_a_correction(
        numbers in numbers(), along in prop::collection::vec(-0.1_f32..0.1, 10), amount in 0.0_f32..2.0,
    ) {
        let (p, before, bias) = covariance(&numbers);
        let at = |i: usize| along[i];
        let correction = Gain {
            x: at(0), y: at(1), h: at(H), c: at(3), d: at(4), w: at(5), k: at(6), per_variance: 1.0,
        };
        let place = Point::new(before.place.x.0 + at(AHEAD), before.place.y.0 + at(LEFT));
        let mut after = Mount { place, ..before };
        let moved = after.moved_since(&before);
        after.add_along(&correction, moved, amount);
        let mut bias_after = GyroBias { rate: bias.rate + at(BIAS), ..bias };
        bias_after.add_along(&bias, &correction, moved, amount);
        let delta = Vector::from_iterator(along.iter().map(|number| f64::from(*number)));
        let expected = dense(&p, &before, &bias) + delta * delta.transpose() * f64::from(amount);
        let is = dense(&p, &after, &bias_after);
        for j in [AHEAD, LEFT, BIAS] {
            prop_assert!((is.column(j) - expected.column(j)).norm() < 1e-6, "{j}");
        }
    }
}
