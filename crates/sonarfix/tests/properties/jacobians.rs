//! The analytic derivatives, against central differences of the model in `f64`.

use proptest::prelude::*;
use sonarfix::filter::ekf::{Ekf, StandardDeviations};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::units::{Metres, PerRootMetre};
use sonarfix::sensor::range::ExpectedRange;

use crate::oracle::{
    HEADING, Matrix, RANGE_SCALE, ROUNDING, Robot, View, covariance_of, jacobian_of, state_of,
    travel_of,
};
use crate::strategies::{any_drive, any_mount, any_sight, any_state, silent};

/// A deviation in one state only.
fn only(state: usize, deviation: f32) -> StandardDeviations {
    let mut all = [0.0; 7];
    all[state] = deviation;
    StandardDeviations::from_array(all)
}

/// Any step, up to a metre of each wheel, turns of many radians included.
fn any_step() -> impl Strategy<Value = WheelTravel> {
    prop_oneof![
        (-0.1_f32..0.1, -0.1_f32..0.1),
        (-1.0_f32..1.0, -1.0_f32..1.0),
        (-1.0_f32..1.0).prop_map(|s| (s, s)),
        (-1.0_f32..1.0).prop_map(|s| (s, -s)),
    ]
    .prop_filter("rolls", |(r, l)| r.abs() + l.abs() > 1e-3)
    .prop_map(|(r, l)| WheelTravel::new(r, l))
}

/// Tolerance of an entry of F or G: the rounding of the angle of sine and cosine (an angle a is
/// rounded to a ε, after sums of numbers of its magnitude), times the displacement, times the
/// derivative of the angle.
fn tolerance(angle: f64, value: f64, size: f64) -> f64 {
    8.0 * ROUNDING * (value.abs() + size * (1.0 + angle))
}

proptest! {
    /// F of eq. (8). With a prior in state j alone and no noise, P⁻ = σ² Fⱼ Fⱼᵀ, and Fⱼⱼ = 1; so
    /// row j of P⁻ is column j of F.
    #[test]
    fn motion_jacobian_equals_differences(
        drive in any_drive(), state in any_state(), travel in any_step(), j in 0_usize..7,
    ) {
        let mut ekf = Ekf::new(silent(drive), state, only(j, 0.5)).unwrap();
        let from = state_of(&ekf);
        ekf.predict(travel).unwrap();
        let column = covariance_of(&ekf).row(j).transpose() * 4.0;

        let robot = Robot::from(&drive);
        let travel = travel_of(travel);
        let exact = robot.by_state(&from, &travel).column(j).into_owned();
        let width = robot.track_width - 0.01;
        let angle = travel.abs().sum() / width;
        let roll = travel.abs().sum();
        let by_width = 1.0 + 1.0 / width + 1.0 / (width * width);
        for i in 0..7 {
            let size = if i == j { 0.1 } else { roll * by_width };
            let allowed = tolerance(angle, exact[i], size) + 1e-8;
            prop_assert!(
                (column[i] - exact[i]).abs() <= allowed,
                "d{i}/d{j}: {} instead of {}, allowed {allowed:e}", column[i], exact[i]
            );
        }
    }

    /// G of eq. (9): with a prior of zero and the noise of one wheel at a time (the other is at
    /// rest), P⁻ = σ² |Δ| Gⱼ Gⱼᵀ. Random walks grow with the mean of both distances.
    #[test]
    fn noise_jacobian_equals_differences(
        drive in any_drive(), state in any_state(), roll in 0.01_f32..0.5, back in any::<bool>(), right in any::<bool>(),
    ) {
        let drive = Drive { wheel_noise: PerRootMetre(Metres(0.05)), ..drive };
        let roll = if back { -roll } else { roll };
        let travel = if right { WheelTravel::new(roll, 0.0) } else { WheelTravel::new(0.0, roll) };
        let mut ekf = Ekf::new(drive, state, StandardDeviations::default()).unwrap();
        let from = state_of(&ekf);
        ekf.predict(travel).unwrap();
        let p = covariance_of(&ekf);

        let robot = Robot::from(&drive);
        let travel = travel_of(travel);
        let g = robot.by_travel(&from, &travel).column(usize::from(!right)).into_owned();
        let rolled = travel.abs().sum();
        let exact: Matrix =
            g * g.transpose() * robot.wheel_noise.powi(2) * rolled + robot.walk(&travel);
        let width = robot.track_width - 0.01;
        let angle = 2.0 + rolled / width;
        for i in 0..7 {
            for j in 0..7 {
                let size = |i: usize| if i == HEADING { 1.1 / width } else { 0.55 + rolled / width };
                let allowed = if i <= HEADING && j <= HEADING {
                    8.0 * ROUNDING * angle * size(i) * size(j) * robot.wheel_noise.powi(2) * rolled
                } else {
                    exact[(i, j)] * 4.0 * ROUNDING
                };
                prop_assert!(
                    (p[(i, j)] - exact[(i, j)]).abs() <= allowed,
                    "({i}, {j}): {} instead of {}, allowed {allowed:e}", p[(i, j)], exact[(i, j)]
                );
            }
        }
    }

    /// H of eq. (12), and eq. (11) itself: from either side of a wall with either order of its
    /// ends, with any lever arm, heading and range scale.
    #[test]
    fn range_jacobian_equals_differences(
        sight in any_sight(), mount in any_mount(), state in any_state(),
    ) {
        let at = state.pose().position();
        let (from, to) = sight.ends(at);
        let expected = ExpectedRange::new(&sight.wall(at), mount, &state);
        let ekf = Ekf::new(any_robot(), state, StandardDeviations::default()).unwrap();
        let (view, state) = (View::new(from, to, mount), state_of(&ekf));

        // Coordinates of up to 30 m are rounded a few times.
        let of_lengths = 4.0 * ROUNDING * 40.0;
        let off = (f64::from(expected.range.0) - view.expected_range(&state)).abs();
        prop_assert!(off <= of_lengths, "range off by {off}");
        let (h, exact) = (jacobian_of(&expected), view.by_state(&state));
        for i in 0..7 {
            // The derivative by κ is a length, the others a unit vector, times a lever arm. 1e-8:
            // of the differences.
            let allowed = if i == RANGE_SCALE { of_lengths } else { 8.0 * ROUNDING } + 1e-8;
            prop_assert!((h[i] - exact[i]).abs() <= allowed, "d/d{i}: {} instead of {}", h[i], exact[i]);
        }
        // From the sonar, the foot is in this direction.
        let direction = f64::from(expected.direction.radians().0);
        let sonar = view.sonar(&state);
        let distance = view.distance(sonar).abs();
        let foot = (sonar.0 + distance * direction.cos(), sonar.1 + distance * direction.sin());
        prop_assert!(view.distance(foot).abs() <= 1e-5 * distance.max(1.0), "{} from the wall", view.distance(foot));
    }
}

fn any_robot() -> Drive {
    Drive {
        track_width: Metres(0.3),
        wheel_noise: PerRootMetre(Metres(0.0)),
        scale_walk: PerRootMetre(0.0),
        track_width_walk: PerRootMetre(Metres(0.0)),
    }
}
