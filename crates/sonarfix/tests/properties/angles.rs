//! Sine, cosine, and headings.

use core::f32::consts::{PI, TAU};

use proptest::prelude::*;
use sonarfix::filter::ekf::{Ekf, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Heading, Point};
use sonarfix::geometry::trig::{RANGE, sin_cos};
use sonarfix::geometry::units::{Metres, Radians, SquareMetres};
use sonarfix::map::Wall;
use sonarfix::sensor::range::ExpectedRange;

use crate::oracle::turn_between;
use crate::strategies::any_drive;

/// The larger error of sine and cosine, and how far sin² + cos² is from 1.
fn errors(angle: f32) -> (f64, f64) {
    let (sin, cos) = sin_cos(Radians(angle));
    let (sin, cos) = (f64::from(sin), f64::from(cos));
    let (true_sin, true_cos) = f64::from(angle).sin_cos();
    let error = (sin - true_sin).abs().max((cos - true_cos).abs());
    (error, (sin * sin + cos * cos - 1.0).abs())
}

fn worst(angles: impl Iterator<Item = f32>) -> (f64, f64) {
    angles.map(errors).fold((0.0, 0.0), |(a, b), (c, d)| (a.max(c), b.max(d)))
}

/// Every `step`-th float from one positive number to another, with both signs.
fn floats(from: f32, to: f32, step: usize) -> impl Iterator<Item = f32> {
    (from.to_bits()..to.to_bits())
        .step_by(step)
        .flat_map(|b| [f32::from_bits(b), -f32::from_bits(b)])
}

/// The documented bound, over all magnitudes that an angle of the filter has.
#[test]
fn sine_and_cosine_are_within_their_bound() {
    let headings = worst(floats(1e-4, 8.0, 97));
    let range = worst(floats(8.0, RANGE.0, 97));
    let tiny = worst(floats(0.0, 1e-4, 9_973));
    // The reduction cancels most at the floats next to the multiples of π/2.
    let crossings = worst((1_u16..=63).flat_map(|quadrant| {
        let near = f32::from(quadrant) * core::f32::consts::FRAC_PI_2;
        (0..200).map(move |n| f32::from_bits(near.to_bits() + n - 100))
    }));
    println!(
        "worst: {headings:?} up to 8, {range:?} up to 100, {tiny:?} tiny, {crossings:?} at quadrants"
    );
    for (error, off_circle) in [headings, range, tiny, crossings] {
        assert!(error < 8e-8 && off_circle < 2e-7, "{error:e}, {off_circle:e}");
    }
}

/// Every float up to 2π, a heading plus a bearing, with both signs, on all cores: about 2·10⁹
/// values. `cargo test --release --package sonarfix --test properties -- --ignored every_float`
#[test]
#[ignore = "takes minutes; run it in release"]
fn sine_and_cosine_of_every_float_are_within_their_bound() {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let (error, off_circle) = std::thread::scope(|scope| {
        let parts: Vec<_> = (0..cores)
            .map(|part| {
                let angles = (0..=TAU.to_bits())
                    .skip(part)
                    .step_by(cores)
                    .map(f32::from_bits)
                    .flat_map(|angle| [angle, -angle]);
                scope.spawn(move || worst(angles))
            })
            .collect();
        let worst_of = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.max(b.1));
        parts.into_iter().map(|part| part.join().unwrap()).fold((0.0, 0.0), worst_of)
    });
    println!("worst of every float up to 2π: {error:e}, off the circle {off_circle:e}");
    assert!(error < 8e-8 && off_circle < 2e-7, "{error:e}, {off_circle:e}");
}

#[test]
fn sine_and_cosine_of_a_non_finite_angle_are_nan() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let (sin, cos) = sin_cos(Radians(bad));
        assert!(sin.is_nan() && cos.is_nan());
    }
}

proptest! {
    /// Beyond the range the result is a unit vector, in the direction of the angle to within the
    /// spacing of floats of its size.
    #[test]
    fn sine_and_cosine_of_a_huge_angle_are_a_direction(
        bits in RANGE.0.to_bits()..f32::INFINITY.to_bits(), negative in any::<bool>(), large in 100.0_f32..1e6,
    ) {
        let huge = f32::from_bits(bits);
        for angle in [huge, large].map(|angle| if negative { -angle } else { angle }) {
            let (error, off_circle) = errors(angle);
            prop_assert!(off_circle < 2e-7, "{angle} is off the circle by {off_circle}");
            let spacing = angle.abs().next_up() - angle.abs();
            prop_assert!(error < f64::from(spacing) + 1e-7, "{angle}: {error}");
        }
    }

    /// Any finite angle is wrapped into (−π, π], to the same direction, in constant time (repeated
    /// subtraction would not terminate for 1e30).
    #[test]
    fn headings_are_wrapped(bits in any::<u32>(), few in -1000.0_f32..1000.0, turns in -20_i8..20) {
        let edge = f32::from(turns) * PI;
        for angle in [f32::from_bits(bits), few, edge, edge.next_up(), edge.next_down()] {
            let wrapped = Heading::new(Radians(angle)).radians().0;
            if !angle.is_finite() {
                prop_assert!(wrapped.is_nan());
                continue;
            }
            prop_assert!(wrapped > -PI && wrapped <= PI, "{angle} gives {wrapped}");
            if angle.abs() < 1000.0 {
                // 2π as `f32` is 1.7e-7 too long, 160 times in a thousand radians.
                let off = turn_between(angle.into(), wrapped.into()).abs();
                prop_assert!(off < 1e-6 + 160.0 * 1.8e-7, "{angle} gives {wrapped}");
            }
            if angle > -PI && angle <= PI {
                prop_assert_eq!(wrapped.to_bits(), angle.to_bits());
            }
        }
        let huge = Heading::new(Radians(1e30)).radians().0;
        prop_assert!(huge > -PI && huge <= PI);
    }

    /// The same for headings after a turn, and turns between headings.
    #[test]
    fn a_turn_and_its_inverse_cancel(from in -PI..PI, by in -PI..PI) {
        let start = Heading::new(Radians(from));
        let end = start.turned(Radians(by));
        let turn = end.from(start).0;
        prop_assert!(turn > -PI && turn <= PI);
        prop_assert!(turn_between(turn.into(), by.into()).abs() < 1e-6, "{turn} instead of {by}");
    }

    /// The heading of the filter over any sequence of turns on the spot, full turns included; the
    /// same direction as in `f64` as long as turns are small.
    #[test]
    fn the_filters_heading_stays_wrapped(
        drive in any_drive(), start in -10.0_f32..10.0,
        turns in proptest::collection::vec(prop_oneof![-1.0_f32..1.0, -4.0_f32..4.0, -60.0_f32..60.0], 1..100),
    ) {
        let state = StateEstimate { heading: Radians(start), ..StateEstimate::default() };
        let mut ekf = Ekf::new(drive, state, StandardDeviations { heading: Radians(0.01), ..StandardDeviations::default() }).unwrap();
        let mut direction = f64::from(start);
        let mut loss = 1e-6;
        for turn in turns {
            let distance = 0.5 * turn * drive.track_width.0;
            ekf.predict(WheelTravel::new(distance, -distance)).unwrap();
            let heading = ekf.state().heading.0;
            prop_assert!(heading > -PI && heading <= PI);
            direction += 2.0 * f64::from(distance) / f64::from(drive.track_width.0);
            // The turn is rounded three times, the sum once; each 2π is 1.7e-7 too long.
            loss += f64::from(turn.abs()) * (3e-7 + 1.8e-7 / f64::from(TAU)) + 5e-7;
            prop_assert!(turn_between(heading.into(), direction).abs() < loss);
        }
    }

    /// A correction may also turn the heading over ±π: here by the innovation of a sonar far ahead
    /// of the axle, whose range depends on little else.
    #[test]
    fn a_correction_wraps_the_heading(drive in any_drive(), past in 0.01_f32..0.2, left in any::<bool>()) {
        let side = if left { 1.0 } else { -1.0 };
        let heading = side * (PI - 0.005);
        let state = StateEstimate { heading: Radians(heading), ..StateEstimate::default() };
        let mut ekf = Ekf::new(drive, state, StandardDeviations { heading: Radians(0.5), ..StandardDeviations::default() }).unwrap();
        // The robot faces along −x, so the sonar 1 m ahead is at (−1, 0); the wall is y = −2.
        let wall = Wall::new(Point::new(-5.0, -2.0), Point::new(5.0, -2.0)).unwrap();
        let expected = ExpectedRange::new(&wall, Point::new(1.0, 0.0), &state);
        // A left turn moves it towards the wall: ∂h/∂ψ is −1.
        let range = Metres(expected.range.0 - side * past);
        ekf.update(range, &expected, SquareMetres(1e-6)).unwrap();
        let turned = ekf.state().heading.0;
        prop_assert!(turned > -PI && turned <= PI, "{turned}");
        prop_assert!((turned + side * (PI - past + 0.005)).abs() < 1e-3, "{turned}");
    }
}
