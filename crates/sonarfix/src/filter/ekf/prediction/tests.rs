//! Limits of an interval (`docs/model.md`, "Covariance on demand").

use super::*;
use crate::filter::motion::Drive;
use crate::geometry::units::{Metres, PerRootMetre};
use crate::state::{StandardDeviations, StateEstimate};

fn drive(track_width: f32) -> Drive {
    Drive {
        track_width: Metres(track_width),
        wheel_noise: PerRootMetre(Metres(1e-3)),
        scale_walk: PerRootMetre(0.0),
        track_width_walk: PerRootMetre(Metres(0.0)),
    }
}

/// A filter at the start of an interval.
fn begun(drive: Drive, state: [f32; 7], deviation: [f32; 7]) -> Ekf {
    let state = StateEstimate::from_array(state);
    let mut ekf = Ekf::new(drive, state, StandardDeviations::from_array(deviation)).unwrap();
    ekf.begin_interval();
    ekf
}

/// Motion is accumulated over eight widths, and not at all beyond the limits of width, scale errors and P.
#[test]
fn an_interval_has_limits() {
    let longest = |width, state, deviation| begun(drive(width), state, deviation).longest;
    let zero = [0.0; 7];
    let of_right = |scale| [0.0, 0.0, 0.0, scale, 0.0, 0.0, 0.0];
    let of_left = |scale| [0.0, 0.0, 0.0, 0.0, scale, 0.0, 0.0];
    let of_width = |error| [0.0, 0.0, 0.0, 0.0, 0.0, error, 0.0];
    let of_x = |sigma| [sigma, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for (width, state, deviation, expected) in [
        (0.125, zero, zero, 1.0),
        (0.125, of_width(0.0625), zero, 1.5),
        (0.5, zero, zero, 2.0),
        (0.01, zero, zero, 0.08),
        (0.009_9, zero, zero, 0.0),
        (-0.125, zero, zero, 0.0),
        (0.125, of_right(1.0), zero, 1.0),
        (0.125, of_right(1.01), zero, 0.0),
        (0.125, of_left(1.01), zero, 0.0),
        // Exactly 4e6 m².
        (0.125, zero, of_x(2_000.0), 1.0),
        (0.125, zero, of_x(2_001.0), 0.0),
        (0.125, zero, [0.0, 2_001.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.0),
        (0.125, zero, [0.0, 0.0, 2_001.0, 0.0, 0.0, 0.0, 0.0], 0.0),
        // Mean and difference together 1,000 at 20.
        (0.125, zero, [0.0, 0.0, 0.0, 19.9, 19.9, 0.0, 0.0], 1.0),
        (0.125, zero, [0.0, 0.0, 0.0, 20.1, 20.1, 0.0, 0.0], 0.0),
        (0.125, zero, of_width(31.6), 1.0),
        (0.125, zero, of_width(31.7), 0.0),
    ] {
        let is = longest(width, state, deviation);
        assert!((is - expected).abs() <= 1e-7, "{width} {state:?} {deviation:?}: {is}");
    }
}

/// The random walk counts from the last update, with that of the longest interval.
#[test]
fn the_random_walk_has_its_part_in_the_limit() {
    // 50 m² per metre.
    let walk = PerRootMetre(Metres(10.0));
    let drive = Drive { wheel_noise: walk, track_width_walk: walk, ..drive(0.25) };
    for (variance, is_usual) in [(399.0_f32, true), (401.0, false)] {
        let deviation = [0.0, 0.0, 0.0, 0.0, 0.0, variance.sqrt(), 0.0];
        let mut ekf = begun(drive, [0.0; 7], deviation);
        ekf.distance_since_update = 10.0;
        ekf.begin_interval();
        assert_eq!(ekf.longest > 0.0, is_usual, "{variance}");
    }
    let mut ekf = begun(drive, [0.0; 7], [0.0; 7]);
    ekf.distance_since_update = 10.0;
    ekf.distance = 2.0;
    // In the mean, that in the middle of the interval.
    assert_eq!(ekf.walk_of_interval().track_width_error.to_bits(), 550.0_f32.to_bits());
}

/// An interval lasts up to its limit, then the next one begins; a longer increment is applied at once.
#[test]
fn an_interval_lasts_up_to_its_limit() {
    let exactly = |is: f32, expected: f32| assert_eq!(is.to_bits(), expected.to_bits());
    // At most 1 m.
    let mut ekf = begun(drive(0.125), [0.0; 7], [0.01; 7]);
    for step in [0.25, 0.5, 0.75, 1.0, 0.25] {
        ekf.predict(WheelTravel::new(0.125, -0.125)).unwrap();
        exactly(ekf.distance, step);
    }
    exactly(ekf.distance_since_update, 1.0);
    ekf.predict(WheelTravel::new(0.5, 0.5)).unwrap();
    exactly(ekf.distance, 1.0);
    exactly(ekf.distance_since_update, 1.25);
    ekf.predict(WheelTravel::new(0.5, 0.625)).unwrap();
    exactly(ekf.distance, 0.0);
    exactly(ekf.distance_since_update, 3.375);
    ekf.predict(WheelTravel::new(0.25, 0.0)).unwrap();
    exactly(ekf.distance, 0.25);
    ekf.end_interval();
    exactly(ekf.longest, 0.0);
    exactly(ekf.distance_since_update, 3.625);
}

/// Filters differ by their motion, by the distance since the last update, and by their drive.
#[test]
fn filters_are_equal_by_what_they_will_do() {
    let one = begun(drive(0.25), [0.0; 7], [0.01; 7]);
    let mut other = one;
    assert_eq!(one, other);
    other.predict(WheelTravel::new(0.01, 0.01)).unwrap();
    assert_ne!(one, other);
    let mut other = one;
    other.distance_since_update = 1.0;
    assert_ne!(one, other);
    assert_ne!(one, begun(drive(0.26), [0.0; 7], [0.01; 7]));
}
