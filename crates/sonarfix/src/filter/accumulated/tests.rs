//! Eqs. (27) to (29) against increments in `f64`, with derivatives by central differences.

use std::vec::Vec;

use nalgebra::{Matrix3, SVector, Vector3};
use proptest::prelude::*;

use super::*;
use crate::geometry::trig::sin_cos_within;
use crate::geometry::units::{Metres, PerRootMetre, Radians};
use crate::state::StateEstimate;

/// Errors of heading, mean and difference of the scale errors, and track width.
type Errors = SVector<f64, 4>;

#[derive(Debug, Clone)]
struct Robot {
    drive: Drive,
    state: StateEstimate,
    travels: Vec<[f32; 2]>,
}

prop_compose! {
    fn robot()(
        track_width in 0.1_f32..0.6, wheel in 1e-4_f32..5e-3, heading in -3.0_f32..3.0, scales in [-0.3_f32..0.3, -0.3_f32..0.3],
        width in -0.03_f32..0.03, travels in proptest::collection::vec([-0.08_f32..0.08, -0.08_f32..0.08], 1..20),
    ) -> Robot {
        let drive = Drive {
            track_width: Metres(track_width),
            wheel_noise: PerRootMetre(Metres(wheel)),
            scale_walk: PerRootMetre(0.0),
            track_width_walk: PerRootMetre(Metres(0.0)),
        };
        let [scale_right, scale_left] = scales;
        let (heading, track_width_error) = (Radians(heading), Metres(width));
        let state = StateEstimate { heading, scale_right, scale_left, track_width_error, ..StateEstimate::default() };
        Robot { drive, state, travels }
    }
}

impl Robot {
    fn scales(&self) -> [f64; 2] {
        [self.state.scale_right, self.state.scale_left].map(f64::from)
    }

    /// Displacement and turn with these errors, and with an error of the travel of a wheel in one increment.
    fn moved(&self, errors: &Errors, noise: (usize, [f64; 2])) -> Vector3<f64> {
        let [right, left] = self.scales();
        let scales = [right + errors[1] + 0.5 * errors[2], left + errors[1] - 0.5 * errors[2]];
        let width = f64::from(self.drive.track_width.0)
            + f64::from(self.state.track_width_error.0)
            + errors[3];
        let start = f64::from(self.state.heading.0) + errors[0];
        let (mut pose, mut heading) = (Vector3::zeros(), start);
        for (step, travel) in self.travels.iter().enumerate() {
            let noise = if step == noise.0 { noise.1 } else { [0.0; 2] };
            let of =
                |wheel: usize| (f64::from(travel[wheel]) + noise[wheel]) * (1.0 + scales[wheel]);
            let (along, turn) = (f64::midpoint(of(0), of(1)), (of(0) - of(1)) / width);
            let middle = heading + 0.5 * turn;
            pose += Vector3::new(along * middle.cos(), along * middle.sin(), turn);
            heading += turn;
        }
        pose
    }

    /// Column of the derivatives by an error.
    fn by(&self, error: usize) -> Vector3<f64> {
        let mut by = Errors::zeros();
        by[error] = 1e-6;
        (self.moved(&by, (0, [0.0; 2])) - self.moved(&-by, (0, [0.0; 2]))) / 2e-6
    }

    /// Covariance of the pose by the noise of the wheels, and the variance of the advance.
    fn noise(&self) -> (Matrix3<f64>, f64) {
        let density = f64::from(self.drive.wheel_noise.0.0).powi(2);
        let (mut q, mut advance) = (Matrix3::zeros(), 0.0);
        for (step, travel) in self.travels.iter().enumerate() {
            for wheel in 0..2 {
                let mut by = [0.0; 2];
                by[wheel] = 1e-6;
                let zero = Errors::zeros();
                let derivative = (self.moved(&zero, (step, by))
                    - self.moved(&zero, (step, by.map(|by| -by))))
                    / 2e-6;
                let variance = density * f64::from(travel[wheel]).abs();
                q += variance * derivative * derivative.transpose();
                advance += 0.25 * variance * (1.0 + self.scales()[wheel]).powi(2);
            }
        }
        (q, advance)
    }
}

proptest! {
    /// Displacement, Jacobian and noise of an interval are those of its increments, to some ten roundings of the largest terms.
    #[test]
    fn an_interval_has_the_jacobian_and_the_noise_of_its_increments(robot in robot()) {
        let start = FilterEstimate::new(&robot.state);
        let drive = CalibratedDrive::new(robot.drive.track_width.0, &NoiseDensities::new(&robot.drive), &start);
        let mut motion = AccumulatedMotion::default();
        let mut turned = 0.0;
        for [right, left] in &robot.travels {
            let travel = WheelTravel::new(*right, *left);
            turned += drive.turn(travel);
            motion.add(&drive, start.heading, travel, drive.noise(travel), sin_cos_within);
        }
        let f = motion.transition(&drive, &start);
        let moved = robot.moved(&Errors::zeros(), (0, [0.0; 2]));
        let mut end = start;
        motion.advance(&mut end);
        let (x, y, turn) = end.pose_since(&start);
        let width = robot.drive.track_width.0 + robot.state.track_width_error.0;
        let rolled: f64 = robot.travels.iter().flatten().map(|v| f64::from(v.abs())).sum();
        // Every position is less than this from the start, and every turn less than this many radians.
        let (size, turns) = (rolled + f64::from(width), 2.0 * rolled / f64::from(width));
        let near = |is: f32, expected: f64, size: f64| (f64::from(is) - expected).abs() <= 3e-6 * size;
        prop_assert!(near(drive.width(), f64::from(width), 1.0));
        prop_assert!(near(turned, moved.z, 1.0 + turns));
        let wrapped = (f64::from(turn) - moved.z) / core::f64::consts::TAU;
        prop_assert!((wrapped - wrapped.round()).abs() < 3e-6 * (1.0 + turns));
        prop_assert!(near(x, moved.x, size) && near(y, moved.y, size), "{x} {y} {moved}");

        let [by_heading, by_c, by_d, by_w] = [0, 1, 2, 3].map(|error| robot.by(error));
        // The position error of a travel is this many times the travel.
        let lever = size / f64::from(width);
        let found = [
            ([-f.dy, f.dx, 0.0], by_heading, 1.0),
            ([f.x_by_c, f.y_by_c, f.turn_by_c], by_c, lever),
            ([f.x_by_d, f.y_by_d, f.turn_by_d], by_d, lever),
            ([f.x_by_w, f.y_by_w, f.turn_by_w], by_w, lever / f64::from(width)),
        ];
        for (error, (is, expected, factor)) in found.into_iter().enumerate() {
            for (row, is) in is.into_iter().enumerate() {
                let allowed = factor * (size + turns);
                prop_assert!(near(is, expected[row], allowed), "{error} {row}: {is} {expected}");
            }
        }

        let (q, advance) = robot.noise();
        let found = [
            (f.xx, q[(0, 0)], size * size), (f.xy, q[(0, 1)], size * size), (f.yy, q[(1, 1)], size * size),
            (f.xh, q[(0, 2)], size), (f.yh, q[(1, 2)], size), (f.hh, q[(2, 2)], 1.0),
        ];
        for (entry, (is, expected, factor)) in found.into_iter().enumerate() {
            prop_assert!(near(is, expected, factor * q[(2, 2)]), "{entry}: {is} {expected}");
        }
        prop_assert!(near(f.advance, advance, advance));
    }

    /// The longest interval is the shortest of its limits.
    #[test]
    fn an_interval_is_limited_by_the_noise(
        track_width in 0.05_f32..0.6, wheel in 1e-4_f32..5e-3, walks in [0.0_f32..3e-3, 0.0_f32..3e-3],
        exist in any::<[bool; 2]>(), is_negative in any::<bool>(),
    ) {
        let walk = |number: usize| if exist[number] { walks[number] } else { 0.0 };
        let sign = if is_negative { -1.0 } else { 1.0 };
        let drive = Drive {
            track_width: Metres(track_width),
            wheel_noise: PerRootMetre(Metres(wheel)),
            scale_walk: PerRootMetre(sign * walk(0)),
            track_width_walk: PerRootMetre(Metres(walk(1) * track_width)),
        };
        // Without a random walk the quotient is infinite.
        let by = |walk: f32| 0.15 * f64::from(wheel) / f64::from(walk);
        let expected = by(walk(0)).min(by(walk(1))).min(2.0);
        let is = f64::from(longest_interval(&drive));
        prop_assert!((is / expected - 1.0).abs() < 1e-6, "{is} {expected}");
    }
}

/// A wheel is usual up to twice the measured travel, forwards and backwards.
#[test]
fn a_wheel_is_usual_up_to_twice_its_travel() {
    for (scale, is_usual) in
        [(0.0, true), (1.0, true), (1.001, false), (-3.0, true), (-3.001, false), (f32::NAN, false)]
    {
        for (scale_right, scale_left) in [(scale, 0.0), (0.0, scale)] {
            let drive = CalibratedDrive {
                quarter_right: 0.25 * (1.0 + scale_right),
                quarter_left: 0.25 * (1.0 + scale_left),
                ..CalibratedDrive::default()
            };
            assert_eq!(drive.is_usual(), is_usual, "{scale_right} {scale_left}");
        }
    }
}
