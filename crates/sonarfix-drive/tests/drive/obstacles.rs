//! Objects by pings, against rays through the cone.

use proptest::prelude::*;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::map::{Map, Wall};
use sonarfix_drive::obstacles::{Obstacles, Ping, Settings};

const SETTINGS: Settings = Settings::SMALL;
const NOW: Instant = Instant::from_ticks(5_000_000);

/// A ping ahead from a sonar in the middle of a robot at the origin.
fn ping(range: Option<f32>) -> Ping {
    Ping {
        at: NOW,
        pose: Pose::new(0.0, 0.0, Radians(0.0)),
        mount: Point::new(0.0, 0.0),
        bearing: Radians(0.0),
        half_cone: Radians(0.2),
        range: range.map(Metres),
    }
}

fn wall(from: (f32, f32), to: (f32, f32)) -> Wall {
    Wall::new(Point::new(from.0, from.1), Point::new(to.0, to.1)).unwrap()
}

fn ahead(obstacles: &Obstacles) -> Option<Metres> {
    obstacles.ahead(NOW, Pose::new(0.0, 0.0, Radians(0.0)))
}

/// The shortest of many rays in the cone to a wall.
fn nearest(walls: &[Wall], half_cone: f32) -> f32 {
    let rays = (-200_i16..=200).map(|part| half_cone * f32::from(part) / 200.0);
    let lengths = rays.flat_map(|angle| {
        walls.iter().filter_map(move |wall| {
            let (sin, cos) = angle.sin_cos();
            let (fx, fy) = (wall.from().x.0, wall.from().y.0);
            let (dx, dy) = (wall.to().x.0 - fx, wall.to().y.0 - fy);
            let cross = cos * dy - sin * dx;
            let (length, share) = ((fx * dy - fy * dx) / cross, (fx * sin - fy * cos) / cross);
            (length > 0.0 && (0.0..=1.0).contains(&share)).then_some(length)
        })
    });
    lengths.fold(f32::INFINITY, f32::min)
}

proptest! {
    /// An echo is an object exactly if it comes from nearer than every wall in the cone, by more than the margin.
    #[test]
    fn an_object_is_nearer_than_every_wall_in_the_cone(
        ends in prop::collection::vec(((-2.0_f32..2.0, -2.0_f32..2.0), (-2.0_f32..2.0, -2.0_f32..2.0)), 1..5),
        range in 0.1_f32..1.0,
    ) {
        let walls: Vec<Wall> = ends
            .into_iter()
            .filter_map(|(from, to)| Wall::new(Point::new(from.0, from.1), Point::new(to.0, to.1)).ok())
            .collect();
        let limit = range + SETTINGS.margin.0;
        let nearest = nearest(&walls, 0.2);
        // The rays are a little coarser than the cone.
        prop_assume!((nearest - limit).abs() > 0.02);
        let mut obstacles = Obstacles::new(SETTINGS);
        obstacles.take(&Map::new(&walls), &ping(Some(range)));
        let is_object = nearest > limit;
        prop_assert_eq!(ahead(&obstacles).is_some(), is_object, "nearest wall {}", nearest);
    }

    /// A ping that is not finite is inert.
    #[test]
    fn a_ping_that_is_not_finite_is_inert(which in 0_usize..4) {
        let bad = f32::NAN;
        let ping = ping(Some(0.5));
        let pings = [
            Ping { pose: Pose { x: Metres(bad), ..ping.pose }, ..ping },
            Ping { bearing: Radians(bad), ..ping },
            Ping { half_cone: Radians(bad), ..ping },
            Ping { range: Some(Metres(bad)), ..ping },
        ];
        let mut obstacles = Obstacles::new(SETTINGS);
        obstacles.take(&Map::new(&[]), &pings[which]);
        prop_assert_eq!(obstacles, Obstacles::new(SETTINGS));
    }
}

#[test]
fn an_object_is_forgotten_when_a_ping_passes_through_its_place_or_after_its_time() {
    let walls = [wall((3.0, -1.0), (3.0, 1.0))];
    let map = Map::new(&walls);
    let mut met = Obstacles::new(SETTINGS);
    met.take(&map, &ping(Some(0.5)));
    assert_eq!(ahead(&met), Some(Metres(0.5)));
    // The wall behind its place, or silence; a ping that ends before it or passes beside it shows nothing.
    for (later, stays) in [
        (ping(Some(3.0)), false),
        (ping(None), false),
        (Ping { bearing: Radians(0.5), ..ping(None) }, true),
        (Ping { bearing: Radians(3.1), ..ping(None) }, true),
    ] {
        let mut obstacles = met;
        obstacles.take(&map, &later);
        assert_eq!(ahead(&obstacles).is_some(), stays, "{later:?}");
    }
    let pose = Pose::new(0.0, 0.0, Radians(0.0));
    assert!(met.ahead(NOW + SETTINGS.memory, pose).is_some());
    assert_eq!(met.ahead(NOW + SETTINGS.memory + Duration::from_ticks(1), pose), None);
}

#[test]
fn ahead_is_the_nearest_object_in_the_strip_of_the_robot() {
    let map = Map::new(&[]);
    let mut obstacles = Obstacles::new(SETTINGS);
    // More objects than are remembered, all of them ahead; the nearest comes last.
    for range in [0.9, 0.8, 0.7, 0.6, 0.55, 0.5] {
        obstacles.take(&map, &ping(Some(range)));
    }
    assert_eq!(ahead(&obstacles), Some(Metres(0.5)));
    let from = |x, y, heading| obstacles.ahead(NOW, Pose::new(x, y, Radians(heading)));
    assert!(from(0.0, 0.11, 0.0).is_some() && from(0.0, 0.13, 0.0).is_none());
    assert_eq!(from(0.0, 0.0, 1.5), None);
    assert_eq!(from(2.0, 0.0, 0.0), None);
    // Beyond the reach an echo is no object.
    let mut obstacles = Obstacles::new(SETTINGS);
    obstacles.take(&map, &ping(Some(1.1)));
    assert_eq!(ahead(&obstacles), None);
}
