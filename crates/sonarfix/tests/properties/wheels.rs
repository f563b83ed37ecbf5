//! Scale errors of wheels of one type, eq. (48).

use proptest::prelude::*;
use sonarfix::config::Config;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::{Map, Wall};

use crate::oracle::{SCALE_LEFT, SCALE_RIGHT, covariance_of, is_positive_definite};

/// A localizer at its start, as `f64` matrix P.
fn covariance(config: &Config) -> crate::oracle::Matrix {
    let walls = [Wall::new(Point::new(3.0, -2.0), Point::new(3.0, 2.0)).unwrap()];
    let start = Start {
        pose: Pose::new(0.0, 0.0, Radians(0.0)),
        position_deviation: Metres(0.01),
        heading_deviation: Radians(0.01),
    };
    let now = Instant::from_ticks(0);
    covariance_of(Localizer::new(*config, Map::new(&walls), start, now).unwrap().filter())
}

proptest! {
    /// The difference has its deviation, as far as those of the wheels permit it, which stay; without it the errors are independent.
    #[test]
    fn the_difference_of_the_wheels_has_its_deviation(
        (right, left) in (1e-3_f32..0.1, 1e-3_f32..0.1),
        share in 0.01_f32..2.0,
    ) {
        let mut config = Config::for_track_width(Metres(0.2));
        (config.prior.scale_right, config.prior.scale_left) = (right, left);
        let independent = covariance(&config);
        prop_assert!(independent[(SCALE_RIGHT, SCALE_LEFT)].abs() < 1e-7);

        config.prior.scale_difference = Some(share * right.hypot(left));
        let p = covariance(&config);
        let [wide_right, wide_left] = [right, left].map(f64::from);
        let (most, least) = (wide_right.hypot(wide_left), 1.1 * (wide_right - wide_left).abs());
        let expected = (f64::from(share) * most).max(least).min(most);
        let (rr, ll) = (p[(SCALE_RIGHT, SCALE_RIGHT)], p[(SCALE_LEFT, SCALE_LEFT)]);
        let difference = rr + ll - 2.0 * p[(SCALE_RIGHT, SCALE_LEFT)];
        // Sums of a few terms in `f32`.
        let rounding = 1e-6 * most * most;
        prop_assert!((rr - wide_right * wide_right).abs() < rounding, "{}", rr);
        prop_assert!((ll - wide_left * wide_left).abs() < rounding, "{}", ll);
        prop_assert!((difference - expected * expected).abs() < rounding, "{} {}", difference, expected);
        prop_assert!(is_positive_definite(&p));
        if share >= 1.0 {
            prop_assert_eq!(p, independent);
        }
    }
}
