//! Eqs. (36) to (39) against eight states in `f64`, with derivatives by central differences.

use std::vec::Vec;

use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

use super::*;
use crate::filter::motion::Drive;
use crate::geometry::units::{Metres, PerRootMetre};
use crate::state::{StandardDeviations, StateEstimate};

type States = SVector<f64, 8>;
type Matrix = SMatrix<f64, 8, 8>;

const WIDTH: f64 = 0.35;
const LIMITS: SlipLimits = SlipLimits { deviations: 5.0, angle: 0.005 };

/// x, y, ψ, `S_R`, `S_L`, δD, κ and the bias.
#[derive(Debug, Clone)]
struct Oracle {
    x: States,
    p: Matrix,
    wheel: f64,
    scale_walk: f64,
    width_walk: f64,
}

/// A step: travels, the gyro's turn less that of the wheels, and the variance of its noise.
#[derive(Debug, Clone, Copy)]
struct Step {
    travel: [f32; 2],
    off: f64,
    noise: f32,
    has_gyro: bool,
}

prop_compose! {
    fn step()(
        travel in [-0.2_f32..0.2, -0.2_f32..0.2], is_slip in any::<bool>(), off in -1.0_f64..1.0, noise in 1e-7_f32..1e-4,
        has_gyro in prop::bool::weighted(0.8),
    ) -> Step {
        Step { travel, off: if is_slip { 0.4 * off } else { 0.01 * off }, noise, has_gyro }
    }
}

/// Advance and turn by the wheels, with noise of their travels.
fn by_wheels(x: &States, travel: [f64; 2], noise: [f64; 2]) -> (f64, f64) {
    let right = (travel[0] + noise[0]) * (1.0 + x[3]);
    let left = (travel[1] + noise[1]) * (1.0 + x[4]);
    (f64::midpoint(right, left), (right - left) / (WIDTH + x[5]))
}

fn gradient<const N: usize>(f: impl Fn(&SVector<f64, N>) -> f64) -> SVector<f64, N> {
    SVector::from_fn(|i, _| {
        let mut by = SVector::<f64, N>::zeros();
        by[i] = 1e-6;
        (f(&by) - f(&-by)) / 2e-6
    })
}

impl Oracle {
    /// Takes a step; returns by how much the turns differ, and whether it is a slip. `None` at a limit.
    fn step(&mut self, step: &Step, seconds: f64) -> Option<(f64, bool)> {
        let x = self.x;
        let travel = step.travel.map(f64::from);
        let (_, turn) = by_wheels(&x, travel, [0.0; 2]);
        let wheels = travel.map(|travel| self.wheel * travel.abs());
        let by_noise = gradient::<2>(|by| by_wheels(&x, travel, [by[0], by[1]]).1);
        let q = by_noise[0].powi(2) * wheels[0] + by_noise[1].powi(2) * wheels[1];
        let r = f64::from(step.noise);
        let h = gradient::<8>(|by| by_wheels(&(x + by), travel, [0.0; 2]).1 + seconds * by[7]);
        let limit = 5.0 * (q + r + h.dot(&(self.p * h))).sqrt();
        let differs = step.off;
        let is_near = |value: f64, limit: f64| (value.abs() / limit - 1.0).abs() < 1e-2;
        if step.has_gyro && (is_near(differs, limit) || is_near(differs, 0.005)) {
            return None;
        }
        let is_slip = step.has_gyro && differs.abs() > limit && differs.abs() > 0.005;
        let share = match (step.has_gyro, is_slip) {
            (false, _) => 0.0,
            (true, true) => 1.0,
            (true, false) => q / (q + r),
        };
        let slipped = if is_slip { 0.5 * differs * (WIDTH + x[5]) } else { 0.0 };
        // The states, the noise of both wheels, of the gyro and of a slip.
        let moved = |by: &SVector<f64, 12>| {
            let errors = by.fixed_rows::<8>(0).clone_owned();
            let (along, turned) = by_wheels(&(x + errors), travel, [by[8], by[9]]);
            let gyro = turn + differs - seconds * errors[7] + by[10];
            let turned = (1.0 - share) * turned + share * gyro;
            let (along, middle) = (along + by[11], x[2] + errors[2] + 0.5 * turned);
            [
                x[0] + errors[0] + along * middle.cos(),
                x[1] + errors[1] + along * middle.sin(),
                x[2] + errors[2] + turned,
            ]
        };
        let mut joint = SMatrix::<f64, 12, 12>::zeros();
        joint.fixed_view_mut::<8, 8>(0, 0).copy_from(&self.p);
        joint[(8, 8)] = wheels[0];
        joint[(9, 9)] = wheels[1];
        joint[(10, 10)] = r;
        joint[(11, 11)] = slipped * slipped;
        let mut f = SMatrix::<f64, 8, 12>::zeros();
        f.fixed_view_mut::<8, 8>(0, 0).fill_with_identity();
        for row in 0..3 {
            f.set_row(row, &gradient::<12>(|by| moved(by)[row]).transpose());
        }
        let pose = moved(&SVector::zeros());
        for (row, value) in pose.into_iter().enumerate() {
            self.x[row] = value;
        }
        self.p = f * joint * f.transpose();
        let distance = 0.5 * (travel[0].abs() + travel[1].abs());
        for (state, walk) in [(3, self.scale_walk), (4, self.scale_walk), (5, self.width_walk)] {
            self.p[(state, state)] += walk * walk * distance;
        }
        Some((differs, is_slip))
    }

    /// Whether filter and bias are the same.
    fn check(&self, ekf: &Ekf, bias: &GyroBias) -> Result<(), TestCaseError> {
        let state = ekf.state().to_array().map(f64::from);
        for (i, value) in state.into_iter().enumerate() {
            let off = value - self.x[i];
            let off = if i == 2 { libm::remainder(off, std::f64::consts::TAU) } else { off };
            prop_assert!(off.abs() < 2e-5, "{i}: {value} {}", self.x[i]);
        }
        let p = ekf.covariance().map(f64::from);
        for (i, j) in (0..7).flat_map(|i| (0..7).map(move |j| (i, j))) {
            let size = (self.p[(i, i)] * self.p[(j, j)]).sqrt();
            let (is, expected) = (p[(i, j)], self.p[(i, j)]);
            prop_assert!(
                (is - expected).abs() <= 2e-3 * size,
                "{i} {j}: {is} {expected} of {size}"
            );
        }
        prop_assert!((f64::from(bias.variance()) - self.p[(7, 7)]).abs() <= 2e-3 * self.p[(7, 7)]);
        prop_assert!((f64::from(bias.rate) - self.x[7]).abs() < 1e-5);
        Ok(())
    }
}

fn drive(scale_walk: f32, width_walk: f32) -> Drive {
    Drive {
        track_width: Metres(0.35),
        wheel_noise: PerRootMetre(Metres(0.002)),
        scale_walk: PerRootMetre(scale_walk),
        track_width_walk: PerRootMetre(Metres(width_walk)),
    }
}

/// A filter with a bias, and the oracle of both.
fn filter(state: [f32; 4], deviation: [f32; 4], rate: f32) -> (Ekf, GyroBias, Oracle) {
    let [heading, right, left, width] = state;
    let [pose, scale, track, of_bias] = deviation;
    let state = [0.3, -0.2, heading, right, left, width, 0.01];
    let deviation = [pose, pose, pose, scale, scale, track, 0.01];
    let drive = drive(1e-4, 1e-4);
    let ekf = Ekf::new(
        drive,
        StateEstimate::from_array(state),
        StandardDeviations {
            x: Metres(pose),
            y: Metres(pose),
            heading: Radians(pose),
            scale_right: scale,
            scale_left: scale,
            track_width_error: Metres(track),
            range_scale: 0.01,
        },
    );
    let mut bias = GyroBias::unknown(of_bias);
    bias.rate = rate;
    let mut oracle = Oracle {
        x: States::zeros(),
        p: Matrix::zeros(),
        wheel: f64::from(drive.wheel_noise.0.0).powi(2),
        scale_walk: 1e-4,
        width_walk: 1e-4,
    };
    for (i, (value, sigma)) in
        state.into_iter().chain([rate]).zip(deviation.into_iter().chain([of_bias])).enumerate()
    {
        oracle.x[i] = value.into();
        oracle.p[(i, i)] = f64::from(sigma).powi(2);
    }
    (ekf.unwrap(), bias, oracle)
}

/// The turn that the gyro measures in a step.
fn measured(oracle: &Oracle, step: &Step, seconds: f32) -> GyroTurn {
    let (_, turn) = by_wheels(&oracle.x, step.travel.map(f64::from), [0.0; 2]);
    let angle = turn + step.off + oracle.x[7] * f64::from(seconds);
    #[expect(clippy::cast_possible_truncation, reason = "an angle of a step")]
    GyroTurn { angle: angle as f32, seconds, noise: step.noise }
}

proptest! {
    #![proptest_config(ProptestConfig { max_global_rejects: 50_000, ..ProptestConfig::default() })]

    /// With a gyro, without one, and with slips, one after the other.
    #[test]
    fn steps_are_those_of_the_joint_space(
        steps in prop::collection::vec(step(), 1..12), seconds in 0.05_f32..0.5, rate in -0.1_f32..0.1,
        state in [-3.1_f32..3.1, -0.05_f32..0.05, -0.05_f32..0.05, -0.02_f32..0.02],
        deviation in [0.01_f32..0.1, 0.002_f32..0.02, 0.001_f32..0.01, 0.002_f32..0.05],
    ) {
        let (mut ekf, mut bias, mut oracle) = filter(state, deviation, rate);
        for step in steps {
            let travel = WheelTravel::new(step.travel[0], step.travel[1]);
            let before = oracle.clone();
            let turn = measured(&oracle, &step, seconds);
            let expected = oracle.step(&step, seconds.into());
            prop_assume!(expected.is_some());
            let (differs, is_slip) = expected.unwrap();
            if !step.has_gyro {
                ekf.predict_with_bias(travel, &mut bias).unwrap();
                oracle.check(&ekf, &bias)?;
                continue;
            }
            match ekf.predict_with_turn(travel, &turn, LIMITS, &mut bias).unwrap() {
                TurnAgreement::Differ(by) => {
                    prop_assert!(is_slip, "{step:?}");
                    prop_assert!((f64::from(by) - differs).abs() < 1e-5);
                }
                TurnAgreement::Agree(difference) => {
                    prop_assert!(!is_slip, "{step:?}");
                    // Linear in the errors: what they explain at the estimate, and what is left.
                    let travel = step.travel.map(f64::from);
                    let by = gradient::<8>(|by| by_wheels(&(before.x + by), travel, [0.0; 2]).1);
                    let explained = by[3] * before.x[3] + by[4] * before.x[4] + by[5] * before.x[5]
                        + f64::from(seconds) * before.x[7];
                    prop_assert!((f64::from(difference.value) - differs - explained).abs() < 1e-5);
                    for (is, expected) in [
                        (difference.by_c, by[3] + by[4]), (difference.by_d, 0.5 * (by[3] - by[4])),
                        (difference.by_w, by[5]), (difference.by_b, seconds.into()),
                    ] {
                        prop_assert!((f64::from(is) - expected).abs() < 1e-5, "{is} {expected}");
                    }
                    let noise = gradient::<2>(|by| by_wheels(&before.x, travel, [by[0], by[1]]).1);
                    let noise = before.wheel * (noise[0].powi(2) * travel[0].abs() + noise[1].powi(2) * travel[1].abs())
                        + f64::from(step.noise);
                    prop_assert!((f64::from(difference.noise) - noise).abs() < 1e-4 * noise);
                }
            }
            oracle.check(&ekf, &bias)?;
        }
    }

    /// Within so many standard deviations; otherwise nothing changes.
    #[test]
    fn differences_of_turns_are_gated(
        steps in prop::collection::vec(step(), 1..5), state in [-3.1_f32..3.1, -0.05_f32..0.05, -0.05_f32..0.05, -0.02_f32..0.02],
        deviation in [0.01_f32..0.1, 0.002_f32..0.02, 0.001_f32..0.01, 0.002_f32..0.05], rate in -0.1_f32..0.1,
        by in [-0.5_f32..0.5, -0.5_f32..0.5, -0.5_f32..0.5, 0.1_f32..1.0], noise in 1e-6_f32..1e-4, off in -8.0_f64..8.0,
        gate in 2.0_f32..6.0,
    ) {
        let (mut ekf, mut bias, mut oracle) = filter(state, deviation, rate);
        for step in steps {
            let turn = measured(&oracle, &step, 0.1);
            let travel = WheelTravel::new(step.travel[0], step.travel[1]);
            prop_assume!(oracle.step(&Step { has_gyro: true, ..step }, 0.1).is_some());
            ekf.predict_with_turn(travel, &turn, LIMITS, &mut bias).unwrap();
        }
        let [by_c, by_d, by_w, by_b] = by;
        // c is the mean of the scales, d their difference.
        let wide = f64::from;
        let h = States::from([
            0.0, 0.0, 0.0, 0.5 * wide(by_c) + wide(by_d), 0.5 * wide(by_c) - wide(by_d), wide(by_w), 0.0, wide(by_b),
        ]);
        let m = oracle.p * h;
        let s = h.dot(&m) + wide(noise);
        prop_assume!((off.abs() / wide(gate) - 1.0).abs() > 1e-2);
        let innovation = off * s.sqrt();
        #[expect(clippy::cast_possible_truncation, reason = "an angle")]
        let value = (h.dot(&oracle.x) + innovation) as f32;
        let difference = TurnDifference { value, by_c, by_d, by_w, by_b, noise };
        let agrees = off.abs() < wide(gate);
        let (before, column) = (ekf, bias);
        prop_assert_eq!(ekf.correct_by_turns(&difference, gate, &mut bias), agrees);
        if agrees {
            oracle.p -= m * m.transpose() / s;
            oracle.x += m * (innovation / s);
            for i in 0..7 {
                let is = wide(ekf.standard_deviations().to_array()[i]);
                let size = wide(before.standard_deviations().to_array()[i]);
                prop_assert!((is - oracle.p[(i, i)].sqrt()).abs() < 1e-2 * size, "{i}: {is}");
                let off = wide(ekf.state().to_array()[i]) - oracle.x[i];
                let off = if i == 2 { libm::remainder(off, std::f64::consts::TAU) } else { off };
                prop_assert!(off.abs() < 1e-2 * size + 1e-5, "{i}: {off}");
            }
            prop_assert!((wide(bias.rate) - oracle.x[7]).abs() < 1e-2 * wide(column.variance().sqrt()));
        } else {
            prop_assert_eq!((ekf, bias), (before, column));
        }
    }

    /// The calibration walks by the distance of both wheels, also where it was known.
    #[test]
    fn the_calibration_walks_with_the_distance(
        travels in prop::collection::vec((-0.2_f32..0.2, -0.2_f32..0.2), 1..10), heading in 0.0_f32..1.0,
    ) {
        let known = StandardDeviations {
            x: Metres(0.01), y: Metres(0.01), heading: Radians(0.01), scale_right: 0.0, scale_left: 0.0,
            track_width_error: Metres(0.0), range_scale: 0.0,
        };
        let mut ekf = Ekf::new(drive(1e-3, 2e-3), StateEstimate::default(), known).unwrap();
        let mut bias = GyroBias::unknown(0.01);
        let mut distance = 0.0;
        for (right, left) in travels {
            let travel = WheelTravel::new(right, left);
            let turn = GyroTurn { angle: (right - left) / 0.35, seconds: 0.1, noise: 1e-4 };
            ekf.predict_with_turn(travel, &turn, LIMITS, &mut bias).unwrap();
            distance += 0.5 * (right.abs() + left.abs());
        }
        let is_walked = |ekf: &Ekf| {
            let is = ekf.standard_deviations();
            let near = |is: f32, walk: f32| (is * is - walk * walk * distance).abs() < 1e-3 * walk * walk * distance;
            near(is.scale_right, 1e-3) && near(is.scale_left, 1e-3) && near(is.track_width_error.0, 2e-3)
        };
        prop_assert!(is_walked(&ekf), "{:?}", ekf.standard_deviations());
        // A difference of little weight.
        let difference = TurnDifference { by_c: 0.1, by_b: 0.1, noise: 1e6, ..TurnDifference::default() };
        prop_assert!(ekf.correct_by_turns(&difference, 5.0, &mut bias));
        prop_assert!(is_walked(&ekf), "{:?}", ekf.standard_deviations());
        let before = ekf.standard_deviations();
        ekf.inflate_heading(Radians(heading));
        let after = ekf.standard_deviations();
        prop_assert!((after.heading.0 - before.heading.0.hypot(heading)).abs() < 1e-5);
        prop_assert_eq!((after.x, after.y), (before.x, before.y));
    }
}

/// A turn of more than 64 rad is refused, and nothing changes.
#[test]
fn an_endless_turn_is_refused() {
    let (ekf, bias, _) = filter([0.0; 4], [0.01; 4], 0.01);
    let travel = WheelTravel::new(0.01, 0.01);
    let taken: Vec<bool> = [63.9, -63.9, 64.1, -64.1, f32::NAN]
        .into_iter()
        .map(|angle| {
            let (mut after, mut column) = (ekf, bias);
            let turn = GyroTurn { angle, seconds: 0.1, noise: 1e-6 };
            let result = after.predict_with_turn(travel, &turn, LIMITS, &mut column);
            assert!(result.is_ok() || (after, column) == (ekf, bias), "{angle}");
            result.is_ok()
        })
        .collect();
    assert_eq!(taken, [true, true, false, false, false]);
}
