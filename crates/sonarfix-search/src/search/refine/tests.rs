//! Eq. (34) against dense `f64`.

use std::vec::Vec;

use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

use super::super::window::Window;
use super::*;
use sonarfix::geometry::units::Radians;

type Row = SVector<f64, PARAMETERS>;
type Information = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// A ping with what it is compared with.
type Explained = (Placed, Target, Tolerance);

prop_compose! {
    fn vector(size: f32)(x in -size..size, y in -size..size) -> Vector {
        Vector::new(x, y)
    }
}

prop_compose! {
    fn explained()(
        arm in vector(3.0), by_drift in vector(2.0), by_turn_scale in vector(2.0),
        (travelled, turned) in (-4.0_f32..0.0, -3.0_f32..3.0), angle in -3.1_f32..3.1, residual in -0.3_f32..0.3,
        off_axis in -0.4_f32..0.4, deviation in 0.02_f32..0.8, by_beam in 3.0_f32..20.0,
    ) -> Explained {
        let beam = Beam { from: arm, axis: Vector::of_angle(angle), range: Some(1.0) };
        (
            Placed { beam, arm, by_drift, by_turn_scale, travelled, turned },
            Target { residual, toward: Vector::of_angle(angle), off_axis },
            Tolerance { deviation, by_beam },
        )
    }
}

/// Hᵀ W H and Hᵀ W r.
fn normal_equations(pings: &[Explained]) -> (Information, Row) {
    let (mut information, mut right) = (Information::zeros(), Row::zeros());
    for (placed, target, by) in pings {
        let dot = |one: Vector, other: Vector| {
            f64::from(one.x) * f64::from(other.x) + f64::from(one.y) * f64::from(other.y)
        };
        let toward = target.toward;
        let range = -Row::from([
            toward.x.into(),
            toward.y.into(),
            dot(toward, Vector::new(-placed.arm.y, placed.arm.x)),
            dot(toward, placed.by_drift),
            dot(toward, placed.by_turn_scale),
        ]);
        let beam = Row::from([0.0, 0.0, 1.0, placed.travelled.into(), placed.turned.into()]);
        let (residual, deviation) = (f64::from(target.residual), f64::from(by.deviation));
        let (off_axis, beam_deviation) = (f64::from(target.off_axis), 1.0 / f64::from(by.by_beam));
        for (h, value, deviation, robustness) in
            [(range, residual, deviation, 0.5), (beam, off_axis, beam_deviation, 0.3)]
        {
            let weight =
                1.0 / (deviation * deviation * (1.0 + robustness * (value / deviation).powi(2)));
            information += weight * h * h.transpose();
            right += weight * value * h;
        }
    }
    (information, right)
}

fn equations(pings: &[Explained]) -> Equations {
    let mut equations = Equations::default();
    for (placed, target, by) in pings {
        equations.add(placed, target, *by);
    }
    equations
}

fn diagonal(deviations: [f64; PARAMETERS]) -> Information {
    Information::from_diagonal(&Row::from(deviations.map(|deviation| deviation.powi(-2))))
}

fn is_near(is: f32, expected: f64, tolerance: f64) -> bool {
    (f64::from(is) - expected).abs() < tolerance
}

prop_compose! {
    fn prior()(drift in 0.01_f32..0.2, turn_scale in 0.01_f32..0.2) -> Prior {
        Prior { drift, turn_scale }
    }
}

prop_compose! {
    fn placement()(at in vector(5.0), angle in -3.1_f32..3.1, drift in -0.1_f32..0.1, turn_scale in -0.1_f32..0.1) -> Placement {
        Placement { at, rotation: Vector::of_angle(angle), bend: Bend { drift, turn_scale } }
    }
}

proptest! {
    /// Where all pings ask for a long step, it is shortened.
    #[test]
    fn a_step_solves_the_normal_equations(
        pings in prop::collection::vec(explained(), 0..12), placement in placement(), prior in prior(),
        (common, turn) in prop_oneof![Just((Vector::default(), 0.0)), (vector(2.0), -1.5_f32..1.5)],
    ) {
        let pings: Vec<Explained> = pings.into_iter().map(|(placed, target, by)| {
            let residual = target.residual - target.toward.dot(common);
            (placed, Target { residual, off_axis: target.off_axis + turn, ..target }, by)
        }).collect();
        let (information, mut right) = normal_equations(&pings);
        let (drift, turn_scale) = (f64::from(placement.bend.drift), f64::from(placement.bend.turn_scale));
        let expected = |prior: f32, of: f64| f64::from(prior).hypot(2.0_f64.sqrt() * of);
        let (by_drift, by_turn_scale) = (expected(prior.drift, drift), expected(prior.turn_scale, turn_scale));
        let damping = diagonal([0.5, 0.5, 0.3, by_drift, by_turn_scale]);
        right -= damping * Row::from([0.0, 0.0, 0.0, drift, turn_scale]);
        let step = (information + damping).cholesky().unwrap().solve(&right);
        let moved = step[0].hypot(step[1]);
        let share = (0.6 / moved).min(0.35 / step[2].abs()).min(1.0);

        let equations = equations(&pings);
        prop_assert_eq!(usize::from(equations.count), pings.len());
        let next = equations.step(&placement, prior).unwrap();
        let expected = step * share;
        let tolerance = 2e-3;
        prop_assert!(is_near(next.at.x - placement.at.x, expected[0], tolerance), "{next:?} {expected}");
        prop_assert!(is_near(next.at.y - placement.at.y, expected[1], tolerance), "{next:?} {expected}");
        let angle = f64::from(placement.rotation.y).atan2(placement.rotation.x.into()) + expected[2];
        prop_assert!(is_near(next.rotation.x, angle.cos(), tolerance), "{next:?} {expected}");
        prop_assert!(is_near(next.rotation.y, angle.sin(), tolerance), "{next:?} {expected}");
        prop_assert!(is_near(next.rotation.length_squared(), 1.0, 1e-6));
        prop_assert!(is_near(next.bend.drift, drift + expected[3], tolerance), "{next:?} {expected}");
        prop_assert!(is_near(next.bend.turn_scale, turn_scale + expected[4], tolerance), "{next:?} {expected}");
    }

    #[test]
    fn the_spread_is_the_inverse_of_the_information(
        pings in prop::collection::vec(explained(), 0..12), prior in prior(),
    ) {
        let (information, _) = normal_equations(&pings);
        let mut priors = diagonal([10.0, 10.0, 1.0, prior.drift.into(), prior.turn_scale.into()]);
        priors[(2, 2)] = 0.1;
        let inverse = (information + priors).cholesky().unwrap().inverse();
        let Spread { xx, xy, yy, rotation } = equations(&pings).spread(prior);
        let size = inverse[(0, 0)] + inverse[(1, 1)];
        for (is, expected, size) in [
            (xx, inverse[(0, 0)], size),
            (xy, inverse[(0, 1)], size),
            (yy, inverse[(1, 1)], size),
            (rotation, inverse[(2, 2)], inverse[(2, 2)]),
        ] {
            prop_assert!(is_near(is, expected, 1e-2 * size), "{is} {expected} {inverse}");
        }
    }

    /// A placed ping is the place of the chain, rotated onto the map with its derivatives.
    #[test]
    fn pings_are_placed_on_the_map(
        steps in prop::collection::vec((0.0_f32..0.4, -0.5_f32..0.5, -3.1_f32..3.1), 1..10), mount in vector(0.2),
        placement in placement(),
    ) {
        let mut window: Window<16> = Window::new(mount);
        for (advance, turn, bearing) in steps {
            window.drive(advance, turn);
            window.ping(bearing, Some(1.0), [Radians(0.0); 2]);
        }
        window.rebase();
        let turned = |vector: Vector| {
            let (x, y) = (f64::from(vector.x), f64::from(vector.y));
            let (cos, sin) = (f64::from(placement.rotation.x), f64::from(placement.rotation.y));
            (cos * x - sin * y, sin * x + cos * y)
        };
        let is = |vector: Vector, (x, y): (f64, f64)| {
            is_near(vector.x, x, 1e-5) && is_near(vector.y, y, 1e-5)
        };
        let (mut chain, mut other) = (Chain::new(Vector::default()), Chain::new(Vector::default()));
        for ping in window.pings().iter().rev() {
            chain.add(&window.link(ping, placement.bend.minus(window.bend())));
            let placed = Placed::new(ping, &placement, &chain);
            let link = window.link(ping, placement.bend);
            other.add(&link);
            let arm = turned(other.sonar(&link));
            prop_assert!(is(placed.arm, arm));
            let at = (arm.0 + f64::from(placement.at.x), arm.1 + f64::from(placement.at.y));
            prop_assert!(is(placed.beam.from, at));
            prop_assert!(is(placed.beam.axis, turned(ping.axis.turned(link.bent))));
            prop_assert!(is(placed.by_drift, turned(other.by_drift)));
            prop_assert!(is(placed.by_turn_scale, turned(other.by_turn_scale)));
            prop_assert_eq!(placed.beam.range, ping.range());
            prop_assert_eq!((placed.travelled, placed.turned), (ping.station.travelled, ping.station.turned));
        }
    }
}

/// Rounding errors of a rotation do not add up over many steps.
#[test]
fn a_step_normalizes_the_rotation() {
    let prior = Prior { drift: 0.1, turn_scale: 0.1 };
    for length in [0.97, 1.03] {
        let rotation = Vector::of_angle(0.5).times(length);
        let placement = Placement { at: Vector::default(), rotation, bend: Bend::NONE };
        let next = Equations::default().step(&placement, prior).unwrap();
        assert!(is_near(next.rotation.length_squared(), 1.0, 1e-6), "{next:?}");
    }
}

/// What is not finite gives no step.
#[test]
fn infinite_information_gives_no_step() {
    let mut equations = Equations::default();
    equations.rows[0][0] = f32::INFINITY;
    let prior = Prior { drift: 0.1, turn_scale: 0.1 };
    let placement =
        Placement { at: Vector::default(), rotation: Vector::new(1.0, 0.0), bend: Bend::NONE };
    equations.right = [f32::INFINITY; PARAMETERS];
    assert!(equations.step(&placement, prior).is_none());
}
