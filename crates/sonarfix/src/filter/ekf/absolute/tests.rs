//! Eqs. (40) to (44) against a joint update in `f64`, with motions since the measurement of a metre.

use nalgebra::{SMatrix, SVector, Vector3};
use proptest::prelude::*;

use super::*;
use crate::filter::motion::{Drive, WheelTravel};
use crate::geometry::units::{Duration, PerRootMetre};
use crate::state::{StandardDeviations, StateEstimate};

type Matrix = SMatrix<f64, 7, 7>;
type Vector = SVector<f64, 7>;

#[derive(Debug, Clone)]
struct Case {
    ekf: Ekf,
    back: Return,
    measured: Components,
    /// The measurement less what is expected.
    off: [f64; 3],
}

prop_compose! {
    fn case()(
        heading in -3.0_f32..3.0, deviations in [0.05_f32..0.5, 0.05_f32..0.5, 0.05_f32..0.2],
        travel in [-0.08_f32..0.08, -0.08_f32..0.08], moved in [-1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0],
        off in [-0.5_f64..0.5, -0.5_f64..0.5, -0.3_f64..0.3], sigmas in [0.05_f32..0.5, 0.05_f32..0.5, 0.05_f32..0.2],
        factors in [-0.6_f32..0.6, -0.6_f32..0.6, -0.6_f32..0.6],
        (has_position, has_heading) in prop_oneof![Just((true, true)), Just((true, false)), Just((false, true))],
    ) -> Case {
        let drive = Drive {
            track_width: Metres(0.3),
            wheel_noise: PerRootMetre(Metres(1e-3)),
            scale_walk: PerRootMetre(1e-6),
            track_width_walk: PerRootMetre(Metres(1e-6)),
        };
        let [x, y, h] = deviations;
        let deviation = StandardDeviations::from_array([x, y, h, 0.03, 0.02, 0.01, 0.01]);
        let state = StateEstimate { x: Metres(1.0), y: Metres(-2.0), heading: Radians(heading), ..StateEstimate::default() };
        let mut ekf = Ekf::new(drive, state, deviation).unwrap();
        for _ in 0..15 {
            ekf.predict(WheelTravel::new(travel[0], travel[1])).unwrap();
        }
        let back = Return { moved: PoseVector { x: moved[0], y: moved[1], h: moved[2] }, age: Duration::from_ticks(1) };
        let all = PoseMatrix::correlated(sigmas, factors);
        let one = PoseMatrix::IDENTITY;
        let noise = match (has_position, has_heading) {
            (true, true) => all,
            (true, false) => PoseMatrix { xx: all.xx, xy: all.xy, yy: all.yy, ..one },
            _ => PoseMatrix { hh: all.hh, ..one },
        };
        let measured = Components { value: PoseVector::default(), noise, has_position, has_heading };
        Case { ekf, back, measured, off }
    }
}

fn wrap(angle: f64) -> f64 {
    let turn = core::f64::consts::TAU;
    angle - turn * (angle / turn).round()
}

impl Case {
    fn state(&self) -> Vector {
        self.ekf.state_vector().map(f64::from)
    }

    /// The pose at the time of the measurement: the motion since then turns with an error of the heading.
    fn pose(&self, errors: &Vector) -> Vector3<f64> {
        let PoseVector { x, y, h } = self.back.moved;
        let [x, y, h] = [x, y, h].map(f64::from);
        let state = self.state() + errors;
        let (sin, cos) = errors[2].sin_cos();
        Vector3::new(state[0] - cos * x + sin * y, state[1] - sin * x - cos * y, state[2] - h)
    }

    fn is_measured(&self) -> [bool; 3] {
        let Components { has_position, has_heading, .. } = self.measured;
        [has_position, has_position, has_heading]
    }

    fn derivatives(&self) -> SMatrix<f64, 3, 7> {
        let mut h = SMatrix::<f64, 3, 7>::zeros();
        for column in 0..7 {
            let mut by = Vector::zeros();
            by[column] = 1e-6;
            h.set_column(column, &((self.pose(&by) - self.pose(&-by)) / 2e-6));
        }
        let is = self.is_measured();
        SMatrix::from_fn(|i, j| if is[i] { h[(i, j)] } else { 0.0 })
    }
}

proptest! {
    /// Innovation, S, state and P are those of one joint update.
    #[test]
    fn a_measurement_of_an_earlier_pose_is_a_joint_update(mut case in case(), share in 0.2_f32..1.0, is_certain in any::<bool>()) {
        let is = case.is_measured();
        let expected = case.pose(&Vector::zeros());
        let mut nu = Vector3::zeros();
        #[expect(clippy::cast_possible_truncation, reason = "metres and radians")]
        for (i, value) in [&mut case.measured.value.x, &mut case.measured.value.y, &mut case.measured.value.h].into_iter().enumerate() {
            if is[i] {
                *value = (expected[i] + case.off[i]) as f32;
                nu[i] = case.off[i];
            }
        }
        let (x, p, h) = (case.state(), case.ekf.covariance().map(f64::from), case.derivatives());
        let s = h * p * h.transpose() + case.measured.noise.dense();
        let prediction = case.ekf.predict_absolute(&case.measured, &case.back);
        let off = (prediction.s.dense() - s).abs().max();
        prop_assert!(off < 1e-5, "{} {s}", prediction.s.dense());
        let PoseVector { x: nx, y: ny, h: nh } = prediction.innovation;
        let innovation = Vector3::new(nx, ny, nh).map(f64::from);
        prop_assert!((innovation - nu).abs().max() < 1e-5, "{innovation} {nu}");
        let inverse = s.try_inverse().unwrap();
        let fit = prediction.fit().unwrap();
        let nis = nu.dot(&(inverse * nu));
        prop_assert!((f64::from(fit.nis) - nis).abs() < 1e-3 * (1.0 + nis));
        prop_assert!((f64::from(fit.determinant) / s.determinant() - 1.0).abs() < 1e-3);

        let share = if is_certain { 1.0 } else { share };
        case.ekf.update_absolute(&prediction, share, None).unwrap();
        let beta = f64::from(share);
        let gain = p * h.transpose() * inverse;
        let step = gain * nu;
        let certain = p - gain * s * gain.transpose();
        let mixed: Matrix = (1.0 - beta) * p + beta * certain + beta * (1.0 - beta) * step * step.transpose();
        let mut off = case.state() - x - beta * step;
        off[2] = wrap(off[2]);
        let is = case.ekf.covariance().map(f64::from);
        for i in 0..7 {
            let sigma = mixed[(i, i)].sqrt();
            prop_assert!(off[i].abs() < 1e-3 * sigma, "{i}: {} {sigma}", off[i]);
            for j in 0..7 {
                let size = sigma * mixed[(j, j)].sqrt();
                prop_assert!((is[(i, j)] - mixed[(i, j)]).abs() < 2e-3 * size, "{i} {j}: {} {}", is[(i, j)], mixed[(i, j)]);
            }
        }
    }
}
