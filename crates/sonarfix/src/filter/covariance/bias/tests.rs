//! The column of the bias against dense 8×8 matrices in `f64`, in the order x, y, h, c, d, w, k, b.

use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

use super::super::dense::{self, is_near};
use super::*;
use crate::geometry::pose::Heading;
use crate::geometry::units::{Metres, Radians};
use crate::sensor::range::ExpectedRange;

type Matrix = SMatrix<f64, 8, 8>;
type Vector = SVector<f64, 8>;

const H: usize = 2;
const B: usize = 7;

/// A covariance with a bias: correlated, with deviations of the usual sizes.
fn covariance(numbers: &[f32]) -> (Covariance, GyroBias) {
    let p = dense::correlated([0.1, 0.1, 0.05, 0.01, 0.01, 0.005, 0.01, 0.02], numbers);
    #[expect(clippy::cast_possible_truncation, reason = "numbers of the filter")]
    let at = |i: usize, j: usize| p[(i, j)] as f32;
    let states = dense::column(|i| at(i, B));
    (dense::blocks(at), GyroBias { rate: 0.01, states, mount: (0.0, 0.0), bb: at(B, B) })
}

fn dense(p: &Covariance, b: &GyroBias) -> Matrix {
    dense::joint(p, [&b.states], [[b.bb]])
}

fn numbers() -> impl Strategy<Value = std::vec::Vec<f32>> {
    prop::collection::vec(-1.0_f32..1.0, 64)
}

prop_compose! {
    fn difference()(
        value in -0.05_f32..0.05, by in [-0.3_f32..0.3, -0.3_f32..0.3, -0.3_f32..0.3, 0.1_f32..1.0], noise in 1e-6_f32..1e-3,
    ) -> TurnDifference {
        let [by_c, by_d, by_w, by_b] = by;
        TurnDifference { value, by_c, by_d, by_w, by_b, noise }
    }
}

fn row(a: &TurnDifference) -> Vector {
    Vector::from([0.0, 0.0, 0.0, a.by_c, a.by_d, a.by_w, 0.0, a.by_b].map(f64::from))
}

proptest! {
    #[test]
    fn a_turn_by_the_bias_is_that_of_the_matrix(numbers in numbers(), factor in -1.0_f32..1.0) {
        let (mut p, mut bias) = covariance(&numbers);
        let mut f = Matrix::identity();
        f[(H, B)] = factor.into();
        let expected = f * dense(&p, &bias) * f.transpose();
        bias.turn(&mut p, factor);
        prop_assert!(is_near(&dense(&p, &bias), &expected, &expected));
        prop_assert_eq!(bias.rate.to_bits(), 0.01_f32.to_bits());
    }

    /// Half of the turn, the advance, half of the turn.
    #[test]
    fn the_column_moves_with_the_wheels(
        numbers in numbers(), middle in -3.1_f32..3.1, advance in -0.5_f32..0.5,
        by in [-1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0],
    ) {
        let (p, mut bias) = covariance(&numbers);
        let (sin, cos) = middle.sin_cos();
        let [turn_by_c, turn_by_d, turn_by_w, advance_by_c, advance_by_d] = by;
        let motion = LinearizedMotion {
            sin, cos, dx: advance * cos, dy: advance * sin, turn: 0.0, advance_by_c, advance_by_d,
            turn_by_c, turn_by_d, turn_by_w, factor_right: 1.0, factor_left: 1.0, per_width: 1.0,
        };
        let turn = Vector::from([0.0, 0.0, 0.0, turn_by_c, turn_by_d, turn_by_w, 0.0, 0.0].map(f64::from));
        let along = Vector::from([0.0, 0.0, 0.0, advance_by_c, advance_by_d, 0.0, 0.0, 0.0].map(f64::from));
        let mut heading = 0.5 * turn;
        heading[H] += 1.0;
        let (sin, cos, advance) = (f64::from(sin), f64::from(cos), f64::from(advance));
        let column = dense(&p, &bias).column(B).clone_owned();
        let mut expected = column;
        expected[0] += (along * cos - heading * advance * sin).dot(&column);
        expected[1] += (along * sin + heading * advance * cos).dot(&column);
        expected[H] += turn.dot(&column);
        bias.propagate(&motion);
        let is = dense(&p, &bias).column(B).clone_owned();
        prop_assert!((is - expected).norm() < 1e-5 * (1e-3 + expected.norm()), "{is} {expected}");
    }

    /// As a row of the joint correction, of which the gain is that of the other states.
    #[test]
    fn a_range_corrects_the_bias_by_its_covariances(
        numbers in numbers(), h in [-1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0, 0.1_f32..3.0], innovation in -0.1_f32..0.1,
        noise in 1e-4_f32..0.1, share in -1.0_f32..1.0,
    ) {
        let (p, bias) = covariance(&numbers);
        let [by_x, by_y, by_heading, by_range_scale] = h;
        let expected_range = ExpectedRange { range: Metres(1.0), by_x, by_y, by_heading, by_range_scale, direction: Heading::new(Radians(0.0)) };
        let prediction = p.project(&expected_range);
        let before = dense(&p, &bias);
        let h = Vector::from([by_x, by_y, by_heading, 0.0, 0.0, 0.0, by_range_scale, 0.0].map(f64::from));
        let m = before * h;
        let per_variance = 1.0 / (h.dot(&m) + f64::from(noise));
        let expected = before - m * m.transpose() * per_variance * f64::from(share);
        #[expect(clippy::cast_possible_truncation, reason = "numbers of the filter")]
        let gain = |i: usize| (m[i] * per_variance) as f32;
        #[expect(clippy::cast_possible_truncation, reason = "a number of the filter")]
        let gain = Gain {
            x: gain(0), y: gain(1), h: gain(2), c: gain(3), d: gain(4), w: gain(5), k: gain(6), per_variance: per_variance as f32,
        };
        let mut corrected = bias;
        corrected.correct(&prediction, (0.0, 0.0), &gain, innovation, share);
        let is = dense(&p, &corrected).column(B).clone_owned();
        for i in 0..8 {
            let size = (before[(i, i)] * before[(B, B)]).sqrt();
            prop_assert!((is[i] - expected[(i, B)]).abs() < 1e-4 * size, "{i}: {is} {expected}");
        }
        let rate = 0.01 + m[B] * per_variance * f64::from(innovation);
        prop_assert!((f64::from(corrected.rate) - rate).abs() < 1e-6);
    }

    /// Eq. (44): along a correction of all states, that of the bias among them.
    #[test]
    fn the_column_grows_along_a_correction(
        numbers in numbers(), along in [-0.1_f32..0.1, -0.1_f32..0.1, -0.1_f32..0.1, -0.1_f32..0.1],
        more in [-0.1_f32..0.1, -0.1_f32..0.1, -0.1_f32..0.1, -0.1_f32..0.1], amount in -0.5_f32..2.0,
    ) {
        let (p, before) = covariance(&numbers);
        let ([x, y, h, c], [d, w, k, by_bias]) = (along, more);
        let correction = Gain { x, y, h, c, d, w, k, per_variance: 1.0 };
        let mut after = GyroBias { rate: before.rate + by_bias, ..before };
        let expected = dense(&p, &before).column(B)
            + Vector::from([x, y, h, c, d, w, k, by_bias].map(f64::from)) * f64::from(amount) * f64::from(by_bias);
        after.add_along(&before, &correction, (0.0, 0.0), amount);
        let is = dense(&p, &after).column(B).clone_owned();
        prop_assert!((is - expected).norm() < 1e-6, "{is} {expected}");
    }

    #[test]
    fn a_difference_of_turns_corrects_all_states_at_once(
        numbers in numbers(), difference in difference(), innovation in -0.05_f32..0.05,
    ) {
        let (mut p, mut bias) = covariance(&numbers);
        let before = dense(&p, &bias);
        let h = row(&difference);
        let m = before * h;
        let variance = h.dot(&m);
        prop_assert!((f64::from(p.variance_of(&difference, &bias)) - variance).abs() < 1e-4 * variance);
        let s = variance + f64::from(difference.noise);
        let gain = p.correct_by_turns(&mut bias, &difference, (0.0, 0.0), innovation);
        let Gain { x, y, h, c, d, w, k, per_variance } = gain.unwrap();
        let expected = before - m * m.transpose() / s;
        prop_assert!(is_near(&dense(&p, &bias), &expected, &before));
        for (i, is) in [x, y, h, c, d, w, k].into_iter().enumerate() {
            let size = (before[(i, i)] / s).sqrt();
            prop_assert!((f64::from(is) - m[i] / s).abs() < 1e-4 * size);
        }
        prop_assert!((f64::from(per_variance) * s - 1.0).abs() < 1e-4);
        let rate = 0.01 + m[B] / s * f64::from(innovation);
        prop_assert!((f64::from(bias.rate) - rate).abs() < 1e-6);
    }

    #[test]
    fn differences_add_up(one in difference(), other in difference(), numbers in numbers()) {
        let sum = one.plus(&other);
        let wide = f64::from;
        prop_assert!((row(&sum) - row(&one) - row(&other)).norm() < 1e-6);
        prop_assert!((wide(sum.value) - wide(one.value) - wide(other.value)).abs() < 1e-7);
        prop_assert!((wide(sum.noise) - wide(one.noise) - wide(other.noise)).abs() < 1e-8);
        // What the errors explain of it.
        let (_, bias) = covariance(&numbers);
        let mut estimate = FilterEstimate::new(&crate::state::StateEstimate::from_array([0.0; 7]));
        estimate.scale_common = 0.02;
        estimate.scale_difference = -0.03;
        estimate.track_width_error = 0.004;
        let errors = Vector::from([0.0, 0.0, 0.0, 0.02, -0.03, 0.004, 0.0, 0.01]);
        prop_assert!((wide(one.expected(&estimate, &bias)) - row(&one).dot(&errors)).abs() < 1e-6);
    }

    #[test]
    fn what_is_forgotten_has_no_covariance(numbers in numbers(), deviation in 1e-3_f32..1.0) {
        let (_, bias) = covariance(&numbers);
        let unknown = GyroBias::unknown(deviation);
        let zero = GyroBias { rate: 0.0, states: StateColumn::NONE, mount: (0.0, 0.0), bb: deviation * deviation };
        prop_assert_eq!(unknown, zero);
        prop_assert_eq!(bias.forgotten(deviation), GyroBias { rate: bias.rate, ..zero });
        prop_assert_eq!(bias.independent(), GyroBias { rate: bias.rate, bb: bias.bb, ..zero });
        let mut without_pose = bias;
        without_pose.forget_pose();
        prop_assert_eq!(without_pose, GyroBias { states: StateColumn { x: 0.0, y: 0.0, h: 0.0, ..bias.states }, ..bias });
        prop_assert_eq!(GyroBias::unknown(0.0).variance().to_bits(), 1e-14_f32.to_bits());
    }

    /// Up to the prior; a larger variance stays.
    #[test]
    fn a_random_walk_ends_at_the_prior(start in 0.1_f32..2.0, steps in prop::collection::vec(0.0_f32..0.1, 1..40)) {
        let mut bias = GyroBias::unknown(start.sqrt());
        let mut expected = f64::from(bias.variance());
        for step in steps {
            bias.walk(step, 1.0);
            expected = if expected < 1.0 { (expected + f64::from(step)).min(1.0) } else { expected };
            prop_assert!((f64::from(bias.variance()) - expected).abs() < 1e-5);
        }
    }
}

/// What makes a variance invalid changes nothing.
#[test]
fn a_correction_to_an_invalid_covariance_is_none() {
    let (p, bias) = covariance(&[0.5; 64]);
    let difference =
        TurnDifference { by_c: 0.2, by_b: 1.0, noise: 1e-4, ..TurnDifference::default() };
    for (change, innovation) in [
        (TurnDifference { noise: f32::NAN, ..difference }, 0.0),
        (TurnDifference { noise: -1.0, ..difference }, 0.0),
        (TurnDifference { by_c: f32::INFINITY, ..difference }, 0.0),
        (difference, f32::INFINITY),
        (difference, f32::NAN),
    ] {
        let (mut after, mut column) = (p, bias);
        assert!(
            after.correct_by_turns(&mut column, &change, (0.0, 0.0), innovation).is_none(),
            "{change:?}"
        );
        assert_eq!((after, column), (p, bias));
    }
}
