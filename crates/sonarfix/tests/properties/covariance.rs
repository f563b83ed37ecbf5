//! The covariance stays positive definite.

use proptest::prelude::*;
use sonarfix::filter::ekf::{Ekf, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::Drive;
use sonarfix::geometry::units::{Metres, Radians, SquareMetres};
use sonarfix::sensor::range::ExpectedRange;

use crate::oracle::{
    ROUNDING, SCALE_LEFT, SCALE_RIGHT, SHARPEST, corrected, covariance_of, is_positive_definite,
    jacobian_of, limited_noise, variance_along, variance_of_terms,
};
use crate::strategies::{
    Event, any_deviation, any_drive, any_ekf, any_event, any_mount, any_sight, live,
};

/// Runs all events and checks P after every step.
fn stays_positive_definite(
    drive: Drive,
    deviation: StandardDeviations,
    events: &[Event],
) -> Result<(), TestCaseError> {
    let mut ekf = Ekf::new(drive, StateEstimate::default(), deviation).unwrap();
    for event in events {
        let mut failed = None;
        live(&mut ekf, *event, |_, _, after| {
            let p = covariance_of(after);
            let sound = is_positive_definite(&p) && p.diagonal().min() > 0.0;
            if p != p.transpose() || !sound {
                failed = Some(p);
            }
        });
        prop_assert!(failed.is_none(), "{event:?} led to {failed:?}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// From a usual prior, over some 2,000 steps.
    #[test]
    fn p_stays_positive_definite(
        drive in any_drive(),
        deviation in any_deviation(),
        events in proptest::collection::vec(any_event(1e-6..1e-3), 200),
    ) {
        stays_positive_definite(drive, deviation, &events)?;
    }

    /// From a prior of 10 m to 100 m, with range noise of 0.1–1 mm: the variance of a range is up
    /// to 10¹² times smaller than the prior, where `f32` has 7 digits.
    #[test]
    fn p_stays_positive_definite_from_a_wide_prior(
        drive in any_drive(),
        deviation in any_deviation(),
        wide in 10.0_f32..100.0,
        events in proptest::collection::vec(any_event(1e-8..1e-6), 200),
    ) {
        let deviation = StandardDeviations { x: Metres(wide), y: Metres(wide), ..deviation };
        stays_positive_definite(drive, deviation, &events)?;
    }

    /// A parked robot with a wide prior and 500 precise ranges of the same few walls.
    #[test]
    fn p_stays_positive_definite_while_parked(
        drive in any_drive(),
        deviation in any_deviation(),
        wide in 10.0_f32..100.0,
        ranges in proptest::collection::vec((any_sight(), any_mount()), 1..4),
        noise in 1e-8_f32..1e-6,
    ) {
        let deviation = StandardDeviations { x: Metres(wide), y: Metres(wide), ..deviation };
        let events: Vec<_> = ranges.iter().cycle().take(500).map(|&(sight, mount)| Event::Range {
            sight, mount, sigmas: 0.5, noise,
        }).collect();
        stays_positive_definite(drive, deviation, &events)?;
    }
}

proptest! {
    /// A range reduces the variance along its own direction to the theoretical value, eq. (20)
    /// included, and raises no variance beyond the rounding of four operations.
    #[test]
    fn a_correction_never_raises_a_variance(
        mut ekf in any_ekf(), sight in any_sight(), mount in any_mount(), exponent in -8.0_f32..-2.0,
    ) {
        let before = covariance_of(&ekf);
        let state = ekf.state();
        let noise = 10.0_f32.powf(exponent);
        let wall = sight.wall(state.pose().position());
        let expected = ExpectedRange::new(&wall, mount, &state);
        ekf.update(expected.range, &expected, SquareMetres(noise)).unwrap();
        let after = covariance_of(&ekf);

        let h = jacobian_of(&expected);
        let r = limited_noise(&before, &h, noise.into()).unwrap();
        let (_, exact) = corrected(&before, &h, r);
        let allowed = 16.0 * ROUNDING * variance_of_terms(&before, &h);
        let (was, is) = (variance_along(&before, &h), variance_along(&after, &h));
        prop_assert!(is < was + allowed);
        prop_assert!((is - variance_along(&exact, &h)).abs() <= allowed, "{is} after {was}");
        for i in 0..7 {
            // The variance of a wheel is rounded in the size of both, because mean and difference
            // are held.
            let wheels = before[(SCALE_RIGHT, SCALE_RIGHT)] + before[(SCALE_LEFT, SCALE_LEFT)];
            let size = if [SCALE_RIGHT, SCALE_LEFT].contains(&i) { wheels } else { before[(i, i)] };
            let limit = before[(i, i)] + 4.0 * ROUNDING * size;
            prop_assert!(after[(i, i)] <= limit, "state {i}: {} after {}", after[(i, i)], before[(i, i)]);
        }
    }

    /// For any prior: after one precise range of a wall parallel to an axis, the variance along it
    /// is P R / (P + R) to 2 %, plus the limit of eq. (20): two passes square the rounding, which
    /// is 6e-8 of a P that is 10¹² R. The plain form returns zero or less.
    #[test]
    fn a_precise_range_leaves_its_own_variance(
        drive in any_drive(), wide in 10.0_f32..100.0, exponent in -8.0_f32..-6.0, along_x in any::<bool>(),
        distance in 0.3_f32..8.0,
    ) {
        let deviation = StandardDeviations { x: Metres(wide), y: Metres(wide), heading: Radians(0.01), ..StandardDeviations::default() };
        let mut ekf = Ekf::new(drive, StateEstimate::default(), deviation).unwrap();
        let noise = 10.0_f32.powf(exponent);
        let expected = ExpectedRange {
            range: Metres(distance),
            by_x: if along_x { 1.0 } else { 0.0 },
            by_y: if along_x { 0.0 } else { 1.0 },
            by_heading: 0.0,
            by_range_scale: distance,
            direction: sonarfix::geometry::pose::Heading::default(),
        };
        ekf.update(expected.range, &expected, SquareMetres(noise)).unwrap();
        let left = covariance_of(&ekf)[if along_x { (0, 0) } else { (1, 1) }];
        let (p, r) = (f64::from(wide).powi(2), f64::from(noise));
        let exact = p * r / (p + r);
        let by_rounding = SHARPEST * 2.0 * ROUNDING * p;
        prop_assert!(left > 0.98 * exact && left < 1.02 * (exact + by_rounding), "{left} instead of {exact}");
    }

    /// Along a slanted wall the variance stops at the limit of eq. (20), after any number of
    /// ranges.
    #[test]
    fn a_slanted_wall_keeps_the_variance_that_f32_can_represent(
        drive in any_drive(), wide in 10.0_f32..100.0, direction in 0.2_f32..1.3,
    ) {
        let deviation = StandardDeviations { x: Metres(wide), y: Metres(wide), ..StandardDeviations::default() };
        let mut ekf = Ekf::new(drive, StateEstimate::default(), deviation).unwrap();
        let expected = ExpectedRange {
            range: Metres(1.0),
            by_x: direction.cos(),
            by_y: direction.sin(),
            by_heading: 0.0,
            by_range_scale: 1.0,
            direction: sonarfix::geometry::pose::Heading::default(),
        };
        let mut range = || {
            ekf.update(expected.range, &expected, SquareMetres(1e-8)).unwrap();
            ekf
        };
        for times in 1..100 {
            let p = covariance_of(&range());
            let h = jacobian_of(&expected);
            let share = variance_along(&p, &h) / variance_of_terms(&p, &h) / SHARPEST;
            prop_assert!((share - 1.0).abs() < 0.02, "{share} after {times}");
        }
    }
}
