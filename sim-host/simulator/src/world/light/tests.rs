use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::world::obstacle::Obstacle;
use crate::world::segment::Segment;

/// Without errors, with this half of the field of view.
fn exact(half_view: f64) -> SensorModel {
    let light = LightModel { half_view, pointing: 0.0, absorbed: 0.0, through: 0.0 };
    SensorModel { light: Some(light), ..SensorModel::vl53l1x().undistorted() }
}

fn range_in(world: &World, sensor: &SensorModel, direction: f64, seed: u64) -> Option<Echo> {
    let ping = Ping { time: 0.0, sonar_after: &|_| [0.0, 0.0], direction };
    let mut noise = ChaCha8Rng::seed_from_u64(seed);
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 1);
    world.echo(&ping, sensor, &mut noise, &mut rng)
}

fn with_wall_at(distance: f64) -> World {
    World::of(vec![Segment::new([distance, -9.0], [distance, 9.0])])
}

proptest! {
    /// A single ray at an angle measures the distance over its cosine: there is no foot of a perpendicular.
    #[test]
    fn a_ray_measures_along_its_axis(distance in 0.2_f64..1.5, angle in -0.8_f64..0.8) {
        let echo = range_in(&with_wall_at(distance), &exact(0.0), angle, 0);
        let expected = distance / angle.cos();
        let found = echo.unwrap();
        prop_assert!((found.range - expected).abs() < 1e-9, "{found:?} {expected}");
        prop_assert_eq!(found.source, Source::Wall(0));
    }

    /// A spot on a wall at up to 29° is within 2 % of its axis.
    #[test]
    fn a_spot_measures_about_its_axis(distance in 0.2_f64..1.5, angle in -0.5_f64..0.5) {
        let view = 13.5_f64.to_radians();
        let echo = range_in(&with_wall_at(distance), &exact(view), angle, 0).unwrap();
        let expected = distance / angle.cos();
        prop_assert!((echo.range / expected - 1.0).abs() < 0.02, "{} {}", echo.range, expected);
    }
}

#[test]
fn an_obstacle_in_the_beam_is_nearer() {
    let post =
        Obstacle { outline: Outline::Circle { centre: [1.0, 0.0], radius: 0.25 }, walk: None };
    let world = with_wall_at(2.0).with_obstacles(vec![post]);
    let echo = range_in(&world, &exact(0.0), 0.0, 0).unwrap();
    assert_eq!(echo.source, Source::Obstacle);
    assert!((echo.range - 0.75).abs() < 1e-9);
    // Beside the post, the single ray meets the wall.
    let beside = range_in(&world, &exact(0.0), 0.4, 0).unwrap();
    assert_eq!(beside.source, Source::Wall(0));
}

#[test]
fn dark_walls_and_glass_fail_with_their_probability() {
    let world = World::of(vec![
        Segment::new([1.0, -9.0], [1.0, 9.0]),
        Segment::new([1.8, -9.0], [1.8, 9.0]),
    ]);
    let mut sensor = exact(0.0);
    sensor.light = sensor.light.map(|light| LightModel { absorbed: 0.2, through: 0.1, ..light });
    let ranges: Vec<_> = (0..4_000).map(|seed| range_in(&world, &sensor, 0.0, 2 * seed)).collect();
    let share = |of: fn(&Option<Echo>) -> bool| {
        ranges.iter().map(|echo| f64::from(u8::from(of(echo)))).sum::<f64>() / 4_000.0
    };
    // Three sampling errors of a share of 4,000.
    assert!((share(Option::is_none) - 0.2).abs() < 0.02);
    assert!((share(|echo| echo.is_some_and(|echo| echo.range > 1.5)) - 0.08).abs() < 0.013);
}

#[test]
fn the_air_does_not_matter() {
    let cold = with_wall_at(2.0).at_temperature(-10.0);
    let echo = range_in(&cold, &exact(0.0), 0.0, 0).unwrap();
    assert!((echo.range - 2.0).abs() < 1e-12);
}
