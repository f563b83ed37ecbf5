use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::obstacle::{Obstacle, Outline};
use super::segment::{Point, Segment};
use super::sensor::{Curve, Sensitivity};
use super::*;

/// The paper's cone.
const CONE: f64 = 0.26;

fn room(walls: &[(Point, Point)]) -> World {
    World::of(walls.iter().map(|&(from, to)| Segment::new(from, to)).collect())
}

/// The paper's sensor without its noise.
fn noiseless() -> SensorModel {
    let scenario = sonarfix_map::Scenario::paper().unwrap();
    SensorModel { noise: 0.0, cone: CONE, ..SensorModel::ideal(&scenario) }
}

/// A ping from the origin, by a robot that stands.
fn echo_of(world: &World, sensor: &SensorModel, direction: f64, seed: u64) -> Option<Echo> {
    moving(world, sensor, direction, [0.0, 0.0], seed)
}

fn moving(
    world: &World,
    sensor: &SensorModel,
    direction: f64,
    velocity: [f64; 2],
    seed: u64,
) -> Option<Echo> {
    let sonar_after = |seconds: f64| velocity.map(|v| v * seconds);
    let ping = Ping { time: 0.0, sonar_after: &sonar_after, direction };
    let mut noise = ChaCha8Rng::seed_from_u64(seed);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(1);
    world.echo(&ping, sensor, &mut noise, &mut rng)
}

fn source_and_distance(echo: Option<Echo>) -> Option<(Source, f64)> {
    echo.map(|echo| (echo.source, echo.distance))
}

const FAR_WALL: (Point, Point) = ([2.0, -5.0], [2.0, 5.0]);

#[test]
fn an_oblique_beam_detects_the_foot_of_the_perpendicular() {
    let world = room(&[FAR_WALL]);
    for direction in [-0.25, 0.0, 0.25] {
        let echo = echo_of(&world, &noiseless(), direction, 0).unwrap();
        assert_eq!((echo.source, echo.distance, echo.range), (Source::Wall(0), 2.0, 2.0));
    }
    assert_eq!(echo_of(&world, &noiseless(), 0.27, 0), None);
}

#[test]
fn the_nearest_reflector_in_the_cone_is_detected() {
    let world = room(&[FAR_WALL, ([1.0, -0.5], [1.0, 0.5])]);
    let echo = echo_of(&world, &noiseless(), 0.0, 0);
    assert_eq!(source_and_distance(echo), Some((Source::Wall(1), 1.0)));
}

#[test]
fn a_wall_in_front_occludes_the_one_behind() {
    // The diagonal stands before the far wall, and reflects away.
    let world = room(&[FAR_WALL, ([1.0, -0.5], [1.6, 0.5])]);
    assert_eq!(echo_of(&world, &noiseless(), 0.0, 0), None);
}

#[test]
fn no_echo_without_a_foot_or_out_of_reach() {
    let beside = room(&[([2.0, 0.1], [2.0, 5.0])]);
    assert_eq!(echo_of(&beside, &noiseless(), 0.0, 0), None);
    let far = room(&[([10.5, -5.0], [10.5, 5.0])]);
    assert_eq!(echo_of(&far, &noiseless(), 0.0, 0), None);
}

#[test]
fn a_corner_answers_from_inside_and_an_edge_from_outside() {
    let sensor = SensorModel { corner: 1.0, edge: 1.0, ..noiseless() };
    // The beam is along the diagonal: no foot of a perpendicular is in the cone.
    let inside = room(&[([3.0, -9.0], [3.0, 3.0]), ([-9.0, 3.0], [3.0, 3.0])]);
    let diagonal = std::f64::consts::FRAC_PI_4;
    let (source, distance) = source_and_distance(echo_of(&inside, &sensor, diagonal, 0)).unwrap();
    assert_eq!(source, Source::Corner);
    assert!((distance - 3.0_f64.hypot(3.0)).abs() < 1e-12);
    let outside = room(&[([3.0, 9.0], [3.0, 3.0]), ([9.0, 3.0], [3.0, 3.0])]);
    let echo = source_and_distance(echo_of(&outside, &sensor, diagonal, 0));
    assert_eq!(echo.map(|(source, _)| source), Some(Source::Edge));
    assert_eq!(echo_of(&outside, &noiseless(), diagonal, 0), None);
}

#[test]
fn an_obstacle_reflects_and_occludes_the_wall() {
    let post = |y| {
        let outline = Outline::Circle { centre: [1.0, y], radius: 0.2 };
        room(&[FAR_WALL]).with_obstacles(vec![Obstacle { outline, walk: None }])
    };
    let (source, distance) =
        source_and_distance(echo_of(&post(0.1), &noiseless(), 0.0, 0)).unwrap();
    assert_eq!(source, Source::Obstacle);
    assert!((distance - (1.0_f64.hypot(0.1) - 0.2)).abs() < 1e-9);
    // Outside of the cone, but in front of the wall, which is not detected either.
    let narrow = SensorModel { cone: 0.05, ..noiseless() };
    assert_eq!(echo_of(&post(0.1), &narrow, 0.0, 0), None);
    let beside = echo_of(&post(0.3), &narrow, 0.0, 0);
    assert_eq!(source_and_distance(beside), Some((Source::Wall(0), 2.0)));
}

#[test]
fn a_double_bounce_needs_a_first_wall_that_deflects_the_beam() {
    // The first wall stands at 45° before the sonar and turns the beam up, onto the second.
    let world = room(&[([0.5, -0.5], [1.5, 0.5]), ([-3.0, 2.0], [3.0, 2.0])]);
    let sensor = SensorModel { double_bounce: 1.0, ..noiseless() };
    let (source, distance) = source_and_distance(echo_of(&world, &sensor, 0.0, 0)).unwrap();
    assert_eq!(source, Source::DoubleBounce);
    assert!((distance - 3.0).abs() < 1e-12, "1 m to the first wall and 2 m up: {distance}");
}

#[test]
fn the_echo_of_a_moving_robot_is_that_of_the_middle_of_the_flight() {
    let world = room(&[FAR_WALL]);
    let speed = 10.0;
    let echo = moving(&world, &noiseless(), 0.0, [speed, 0.0], 0).unwrap();
    // 2 d = c t, and d is the mean of the distances at both ends: 2 − v t / 2.
    let exact = 2.0 / (1.0 + speed / world.speed_of_sound());
    assert!((echo.distance - exact).abs() < 1e-4, "{} {exact}", echo.distance);
    assert!((echo.distance - 2.0).abs() > 0.05);
}

#[test]
fn a_wall_of_half_probability_is_detected_half_of_the_time() {
    let half = Sensitivity {
        share: Curve::through(&[(1.0, 0.5), (1.001, 1.0)]),
        half_angle: Curve::level(f64::INFINITY),
        blur: Curve::level(1.0),
    };
    let sensor = SensorModel { mirror: half, ..noiseless() };
    let world = room(&[FAR_WALL, ([1.0, 0.0], [1.0, 0.5])]);
    let runs = 2_000;
    let near = (0..runs)
        .filter_map(|seed| echo_of(&world, &sensor, 0.0, seed))
        .filter(|echo| echo.source == Source::Wall(1))
        .count();
    // The wall behind is hidden by the near one, so the others are silent; ± 4 deviations of 22.
    assert!((910..1_090).contains(&near), "{near}");
}

#[test]
fn outliers_have_their_rate_and_their_source() {
    let sensor = SensorModel { short: Curve::level(0.2), long: Curve::level(0.25), ..noiseless() };
    let world = room(&[FAR_WALL]);
    let echoes: Vec<Echo> =
        (0..4_000).filter_map(|seed| echo_of(&world, &sensor, 0.0, seed)).collect();
    assert_eq!(echoes.len(), 4_000);
    let count = |is: &dyn Fn(&Echo) -> bool| echoes.iter().filter(|echo| is(echo)).count();
    let outlier = |echo: &Echo| echo.source == Source::Outlier;
    // 0.2 of 4,000 is 800 ± 25; the long ones have 0.25 of the rest: 800 ± 25.
    assert!((700..900).contains(&count(&|echo| outlier(echo) && echo.range < 2.0)));
    assert!((700..900).contains(&count(&|echo| outlier(echo) && echo.range > 2.0)));
    assert_eq!(count(&|echo| !outlier(echo) && (echo.range - 2.0).abs() > 1e-12), 0);
}

#[test]
fn a_missed_cycle_costs_half_a_wavelength_and_a_step_is_whole() {
    let sensor = SensorModel { skip: 1.0, ..noiseless() };
    let world = room(&[FAR_WALL]);
    let echo = echo_of(&world, &sensor, 0.0, 0).unwrap();
    assert!((echo.range - 2.0 - 1.5 * sensor::WAVELENGTH).abs() < 1e-12, "{}", echo.range);
    let coarse = SensorModel { quantum: 0.03, ..noiseless() };
    let echo = echo_of(&world, &coarse, 0.0, 0).unwrap();
    assert!((echo.range - 2.01).abs() < 1e-12, "{}", echo.range);
}

#[test]
fn a_rough_wall_reflects_between_normal_and_axis() {
    let rough = SensorModel {
        scatter: Sensitivity { share: Curve::level(1.0), ..noiseless().mirror },
        scatter_lean: 0.5,
        ..noiseless()
    };
    // 0.8 rad off the normal: its foot is far outside the cone.
    let echo = echo_of(&room(&[FAR_WALL]), &rough, 0.8, 0).unwrap();
    assert!((echo.distance - 2.0 / 0.4_f64.cos()).abs() < 1e-9, "{}", echo.distance);
}

proptest! {
    /// Every echo lies within reach, and for a robot at rest the range of the ideal sensor is
    /// exactly the distance of the nearest wall.
    #[test]
    fn the_ideal_sonar_detects_the_nearest_foot_in_its_cone(
        distances in prop::collection::vec(0.1_f64..9.0, 1..5), aside in -0.25_f64..0.25,
    ) {
        let walls: Vec<_> = distances.iter().map(|&x| ([x, -9.0 * x], [x, 9.0 * x])).collect();
        let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
        let echo = echo_of(&room(&walls), &noiseless(), aside, 0);
        prop_assert_eq!(echo.map(|echo| echo.range.to_bits()), Some(nearest.to_bits()));
    }

    /// In any scene a real sensor reports no range outside of its reach except by noise and
    /// bias, and the simulation does not fail.
    #[test]
    fn a_real_sonar_stays_within_its_reach(
        x in 0.01_f64..4.0, length in 0.1_f64..9.0, axis in -3.1_f64..3.1, seed: u64,
    ) {
        let world = room(&[([x, -length], [x, 0.5 * length]), ([-4.0, 1.0], [4.0, 1.2])]);
        for sensor in [SensorModel::nxt(), SensorModel::hc_sr04()] {
            let (nearest, farthest) = sensor.reach;
            for repeat in 0..20 {
                if let Some(echo) = echo_of(&world, &sensor, axis, seed.wrapping_add(repeat)) {
                    prop_assert!((nearest..=farthest).contains(&echo.distance), "{echo:?}");
                    prop_assert!((echo.range - echo.distance).abs() < farthest, "{echo:?}");
                }
            }
        }
    }
}
