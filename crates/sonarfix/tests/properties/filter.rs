//! Prediction and correction against dense `f64`.

use nalgebra::SVector;
use proptest::prelude::*;
use sonarfix::filter::ekf::{Ekf, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::units::{Metres, PerRootMetre, Radians, SquareMetres};
use sonarfix::sensor::range::ExpectedRange;

use crate::oracle::{
    HEADING, Matrix, ROUNDING, Robot, SCALE_LEFT, SCALE_RIGHT, TRACK_WIDTH, Vector, corrected,
    covariance_of, jacobian_of, limited_noise, size_by_both_wheels, state_of, travel_of,
    turn_between, variance_along,
};
use crate::strategies::{any_ekf, any_filter, any_mount, any_sight, any_travel, bits};

/// The largest of |a − b| / size over all entries, in roundings of `f32`.
fn roundings(a: &Matrix, b: &Matrix, size: &Matrix) -> f64 {
    let size = size_by_both_wheels(size);
    (a - b).abs().component_div(&size.add_scalar(1e-30)).max() / ROUNDING
}

fn distance(a: &Vector, b: &Vector) -> Vector {
    let mut d = a - b;
    d[HEADING] = turn_between(a[HEADING], b[HEADING]);
    d.abs()
}

proptest! {
    /// One prediction from any estimate equals eqs. (4) to (10) in dense `f64`. Each entry is a sum
    /// of some forty products of rounded factors.
    #[test]
    fn prediction_equals_the_dense_one((drive, mut ekf) in any_filter(), travel in any_travel()) {
        let (state, p) = (state_of(&ekf), covariance_of(&ekf));
        let robot = Robot::from(&drive);
        ekf.predict(travel).unwrap();
        let travel = travel_of(travel);

        let off = distance(&state_of(&ekf), &(state + robot.step(&state, &travel)));
        // The position is rounded at its magnitude; the displacement is some 0.1 m, an angle at
        // most 2π.
        for (i, size) in [state[0].abs() + 0.2, state[1].abs() + 0.2, 6.3].into_iter().enumerate() {
            prop_assert!(off[i] <= 3.0 * ROUNDING * size, "state {i} is off by {}", off[i]);
        }
        let calibration = |state: &Vector| state.fixed_rows::<4>(3).into_owned();
        prop_assert_eq!(calibration(&state_of(&ekf)), calibration(&state));

        let exact = robot.predicted(&p, &state, &travel) + robot.rounding_noise(&p, &state, &travel);
        let mut size = robot.size_of_terms(&p, &state, &travel);
        // Rounding errors of earlier additions to these sums, when they may have been as large as
        // any prior, are added with this one.
        for i in [SCALE_RIGHT, SCALE_LEFT, TRACK_WIDTH] {
            size[(i, i)] += 0.03 * 0.03;
        }
        let off = roundings(&covariance_of(&ekf), &exact, &size);
        prop_assert!(off <= 48.0, "off by {off} roundings");
    }

    /// Any sequence of steps equals the same steps in dense `f64`, eqs. (4) to (9) one after the other: the
    /// state within 0.005 σ, deviations within 0.2 %, and the other entries within 0.4 % of the product
    /// of two deviations.
    #[test]
    fn many_predictions_equal_dense_ones(
        (drive, mut ekf) in any_filter(),
        legs in proptest::collection::vec((any_travel(), 1_u8..30), 1..8),
    ) {
        let (mut state, mut p) = (state_of(&ekf), covariance_of(&ekf));
        let robot = Robot::from(&drive);
        for (travel, times) in legs {
            for _ in 0..times {
                ekf.predict(travel).unwrap();
                let travel = travel_of(travel);
                p = robot.predicted(&p, &state, &travel);
                state += robot.step(&state, &travel);
            }
            let off = distance(&state_of(&ekf), &state);
            let is = covariance_of(&ekf);
            for i in 0..7 {
                let deviation = p[(i, i)].sqrt();
                prop_assert!(off[i] <= 0.005 * deviation, "state {i} is off by {} of {deviation}", off[i]);
                prop_assert!((is[(i, i)].sqrt() / deviation - 1.0).abs() <= 0.002, "deviation {i}");
                for j in 0..7 {
                    let size = deviation * p[(j, j)].sqrt();
                    prop_assert!((is[(i, j)] - p[(i, j)]).abs() <= 0.004 * size, "entry {i} {j}");
                }
            }
        }
    }

    /// One correction of any estimate equals Joseph's form, eq. (19), in dense `f64`, and the state
    /// changes by the gain of eq. (18) times the innovation. The terms of an entry are at most |I −
    /// K H| |P| |I − K H|ᵀ, and those that the first pass subtracts.
    #[test]
    fn correction_equals_the_dense_joseph_form(
        mut ekf in any_ekf(), sight in any_sight(), mount in any_mount(),
        surprise in -0.2_f32..0.2, exponent in -4.0_f32..-2.0,
    ) {
        let (state, p) = (state_of(&ekf), covariance_of(&ekf));
        let wall = sight.wall(ekf.state().pose().position());
        let expected = ExpectedRange::new(&wall, mount, &ekf.state());
        let noise = SquareMetres(10.0_f32.powf(exponent));
        let range = Metres(expected.range.0 + surprise);
        let innovation = ekf.innovation(range, &expected, noise);
        ekf.update(range, &expected, noise).unwrap();

        let h = jacobian_of(&expected);
        // Eq. (20) acts in one of some thousand cases; tests/properties/covariance.rs covers it.
        let r = f64::from(noise.0);
        prop_assume!(limited_noise(&p, &h, r) == Some(r));
        let (gain, exact) = corrected(&p, &h, r);
        let kept = Matrix::identity() + gain.abs() * h.abs();
        let taken = gain.abs() * (p.abs() * h.abs().transpose()).transpose();
        let size = kept * p.abs() * kept.transpose() + taken + taken.transpose();
        let off = roundings(&covariance_of(&ekf), &exact, &size);
        prop_assert!(off <= 4.0, "off by {off} roundings");

        // S is a sum of 16 terms; S and K lose the digits that cancel in it.
        let s = variance_along(&p, &h) + r;
        let terms = variance_along(&p.abs(), &h.abs()) + r;
        let lost = 8.0 * ROUNDING * terms / s;
        prop_assert!((f64::from(innovation.variance.0) / s - 1.0).abs() <= lost);
        let nu = f64::from(range.0) - f64::from(expected.range.0);
        prop_assert_eq!(innovation.value, range - expected.range);

        let off = distance(&state_of(&ekf), &(state + gain * nu));
        let column = p.abs() * h.abs().transpose();
        for i in 0..7 {
            // m = P Hᵀ is exact to the size of its terms.
            let of_gain = of_both(i, &column) / s * 8.0 * ROUNDING + of_both(i, &gain) * lost;
            let allowed = nu.abs() * (of_gain + of_both(i, &gain) * 4.0 * ROUNDING)
                + range_of(i, &state) * 4.0 * ROUNDING
                + of_both(i, &gain) * f64::from(range.0) * ROUNDING;
            prop_assert!(off[i] <= allowed, "state {i} is off by {} > {allowed}", off[i]);
        }
    }

    /// A step without travel changes no bit, whatever the sign of its zeros; any other step does.
    #[test]
    fn zero_travel_changes_no_bit(mut ekf in any_ekf(), times in 1_usize..50) {
        let before = bits(&ekf);
        for _ in 0..times {
            for travel in [(0.0, 0.0), (-0.0, 0.0), (0.0, -0.0), (-0.0, -0.0)] {
                ekf.predict(WheelTravel::new(travel.0, travel.1)).unwrap();
            }
        }
        prop_assert_eq!(&bits(&ekf), &before);
        ekf.predict(WheelTravel::new(0.01, 0.01)).unwrap();
        prop_assert_ne!(bits(&ekf), before);
    }

    /// Process noise depends on the distance, not on the number of steps (so not on time): a
    /// distance divided into a hundred steps adds what it adds in one, except for the rounding of a
    /// hundred sums.
    #[test]
    fn noise_grows_with_distance_not_with_steps((drive, ekf) in any_filter(), s in 0.1_f32..1.0, back in any::<bool>()) {
        let s = if back { -s } else { s };
        let (mut once, mut often) = (ekf, ekf);
        once.predict(WheelTravel::new(s, s)).unwrap();
        for _ in 0..100 {
            often.predict(WheelTravel::new(s / 100.0, s / 100.0)).unwrap();
        }
        // Because the noise also turns the displacement, 1 cm and 1 m differ in x and y to second
        // order; in heading and calibration they do not.
        let travel = SVector::<f64, 2>::new(s.into(), s.into());
        let size = Robot::from(&drive).size_of_terms(&covariance_of(&ekf), &state_of(&ekf), &travel);
        let size = size_by_both_wheels(&size);
        for i in [HEADING, SCALE_RIGHT, SCALE_LEFT, TRACK_WIDTH] {
            let (one, many) = (covariance_of(&once)[(i, i)], covariance_of(&often)[(i, i)]);
            let allowed = 2e-3 * one + 200.0 * ROUNDING * size[(i, i)];
            prop_assert!((many - one).abs() < allowed, "state {i}: {many} in steps, {one} at once");
        }
    }
}

/// The magnitude of an entry of the state; for the scale error of either wheel, that of both.
fn of_both(i: usize, v: &Vector) -> f64 {
    if [SCALE_RIGHT, SCALE_LEFT].contains(&i) {
        v[SCALE_RIGHT].abs() + v[SCALE_LEFT].abs()
    } else {
        v[i].abs()
    }
}

/// The magnitude of the numbers of which a state is the sum.
fn range_of(i: usize, state: &Vector) -> f64 {
    if i == HEADING { 6.3 } else { of_both(i, state) }
}

/// Where the wheel noise is less than a rounding of the variance, a rounding is added instead (eq.
/// 10): otherwise many small steps could reduce the variance.
#[test]
fn rounding_noise_replaces_smaller_wheel_noise() {
    let drive = Drive {
        track_width: Metres(0.2),
        wheel_noise: PerRootMetre(Metres(1e-9)),
        scale_walk: PerRootMetre(0.0),
        track_width_walk: PerRootMetre(Metres(0.0)),
    };
    let deviation = StandardDeviations {
        x: Metres(1.0),
        y: Metres(1.0),
        heading: Radians(1.0),
        ..StandardDeviations::default()
    };
    for (heading, across) in [(0.0, 0), (core::f32::consts::FRAC_PI_2, 1)] {
        let state = StateEstimate { heading: Radians(heading), ..StateEstimate::default() };
        let mut ekf = Ekf::new(drive, state, deviation).unwrap();
        ekf.predict(WheelTravel::new(1e-5, 1e-5)).unwrap();
        let p = ekf.covariance();
        assert!(p[(across, across)] > 1.0, "along a heading of {heading}: {p}");
        assert!(p[(2, 2)] > 1.0, "{p}");
    }
}
