//! The reflectors of a ping, sought among all walls without an index: the definition that the search is compared with.

use proptest::prelude::*;
use sonarfix_map::Oscillation;

use super::obstacle::{Obstacle, Outline};
use super::reflector::{Reflector, Search, Source};
use super::scene::{Ping, World};
use super::segment::{Point, Segment, direction, distance};
use super::sensor::SensorModel;
use super::vertex::{Shape, Vertex};
use crate::angle;

/// Every condition for every wall, vertex, obstacle and pair of walls.
struct Exhaustive<'a> {
    world: &'a World,
    sensor: &'a SensorModel,
    ping: &'a Ping<'a>,
    obstacles: Vec<Outline>,
    from: Point,
}

impl Exhaustive<'_> {
    fn run(&self) -> Vec<Reflector> {
        let walls = self.world.walls.iter().enumerate().filter_map(|(wall, segment)| {
            let (foot, _) = segment.foot(self.from)?;
            let half_way = |to| segment.half_way_over(self.from, to);
            self.reflector_at(Source::Wall(wall), foot, 1.0, half_way, &[wall])
        });
        let mut found: Vec<Reflector> = walls.collect();
        found.extend(self.obstacles.iter().filter_map(|outline| self.obstacle(outline)));
        if self.sensor.corner > 0.0 || self.sensor.edge > 0.0 {
            found.extend(self.world.vertices.iter().filter_map(|vertex| self.vertex(vertex)));
        }
        if self.sensor.double_bounce > 0.0 {
            let walls = 0..self.world.walls.len();
            let pairs =
                walls.clone().flat_map(|first| walls.clone().map(move |next| (first, next)));
            found.extend(pairs.filter_map(|(first, next)| self.double_bounce(first, next)));
        }
        found.sort_by(|one, other| one.distance.total_cmp(&other.distance));
        found
    }

    fn obstacle(&self, outline: &Outline) -> Option<Reflector> {
        let near = outline.nearest(self.from);
        let strength = if outline.faces(self.from) { 1.0 } else { self.sensor.edge };
        let share = 1.0 - 1e-6;
        let [dx, dy] = [near[0] - self.from[0], near[1] - self.from[1]];
        let before = [self.from[0] + share * dx, self.from[1] + share * dy];
        self.reflector_at(Source::Obstacle, before, strength, |to| self.over(near, to), &[])
    }

    fn vertex(&self, vertex: &Vertex) -> Option<Reflector> {
        let (source, strength) = match vertex.shape_from(self.from)? {
            Shape::Corner => (Source::Corner, self.sensor.corner),
            Shape::Edge => (Source::Edge, self.sensor.edge),
        };
        self.reflector_at(source, vertex.at, strength, |to| self.over(vertex.at, to), &vertex.walls)
    }

    fn double_bounce(&self, first: usize, next: usize) -> Option<Reflector> {
        let (mirror, target) = (self.world.walls.get(first)?, self.world.walls.get(next)?);
        let image = mirror.mirror(self.from);
        let (foot, _) = target.foot(image).filter(|_| first != next)?;
        let turning = mirror.crossing(image, foot)?;
        if self.is_hidden(turning, foot, &[first, next]) {
            return None;
        }
        let half_way = |to| target.half_way_over(image, mirror.mirror(to));
        let strength = self.sensor.double_bounce;
        self.reflector_at(Source::DoubleBounce, turning, strength, half_way, &[first])
    }

    fn over(&self, by: Point, to: Point) -> f64 {
        0.5 * (distance(self.from, by) + distance(by, to))
    }

    fn reflector_at(
        &self,
        source: Source,
        turning: Point,
        strength: f64,
        half_way: impl Fn(Point) -> f64,
        own: &[usize],
    ) -> Option<Reflector> {
        let off_axis = angle::wrap(direction(self.from, turning) - self.ping.direction);
        if off_axis.abs() > self.sensor.cone {
            return None;
        }
        let mut distance = half_way(self.from);
        for _ in 0..2 {
            let flight = 2.0 * distance / self.world.speed_of_sound;
            distance = half_way((self.ping.sonar_after)(flight));
        }
        let (nearest, farthest) = self.sensor.reach;
        let in_reach = distance >= nearest && distance <= farthest;
        let audible = strength * self.sensor.mirror.at(distance, off_axis);
        let is_detectable = in_reach && audible > 0.0 && !self.is_hidden(self.from, turning, own);
        is_detectable.then_some(Reflector { source, distance, off_axis, audible })
    }

    fn is_hidden(&self, from: Point, to: Point, own: &[usize]) -> bool {
        let mut walls = self.world.walls.iter().enumerate();
        walls.any(|(wall, segment)| !own.contains(&wall) && segment.crossing(from, to).is_some())
            || self.obstacles.iter().any(|outline| outline.blocks(from, to))
    }
}

/// The first wall on the axis, of all walls.
fn on_axis(world: &World, from: Point, axis: f64) -> Option<(usize, Point)> {
    let hits = world.walls.iter().enumerate();
    let hits = hits.filter_map(|(wall, segment)| Some((wall, segment.hit(from, axis)?)));
    hits.min_by(|(_, one), (_, other)| distance(from, *one).total_cmp(&distance(from, *other)))
}

/// The places of the vertices and their walls, each point compared with all others.
fn vertices(walls: &[Segment]) -> Vec<(Point, Vec<usize>)> {
    let mut vertices: Vec<(Point, Vec<usize>)> = Vec::new();
    for at in walls.iter().flat_map(Segment::ends) {
        if vertices.iter().all(|(other, _)| distance(*other, at) > 1e-4) {
            let touching = walls.iter().enumerate();
            let touching = touching.filter(|(_, wall)| distance(wall.nearest(at), at) <= 1e-4);
            vertices.push((at, touching.map(|(wall, _)| wall).collect()));
        }
    }
    vertices
}

/// Walls on a grid of 10 cm, many of which meet, overlap or are collinear, and some anywhere.
fn walls() -> impl Strategy<Value = Vec<Segment>> {
    let tenths = || (-60_i32..60).prop_map(|tenth| 0.1 * f64::from(tenth));
    let on_grid = || [tenths(), tenths()].boxed();
    let anywhere = || [-6.0..6.0_f64, -6.0..6.0].boxed();
    let along = (on_grid(), 1_i32..50, any::<bool>()).prop_map(|([x, y], tenths, is_level)| {
        let length = 0.1 * f64::from(tenths);
        ([x, y], if is_level { [x + length, y] } else { [x, y + length] })
    });
    let wall = prop_oneof![4 => along, 1 => (on_grid(), on_grid()), 1 => (anywhere(), anywhere())];
    let wall = wall.prop_filter("a length", |&(from, to)| distance(from, to) > 0.01);
    prop::collection::vec(wall.prop_map(|(from, to)| Segment::new(from, to)), 1..80)
}

fn obstacles() -> impl Strategy<Value = Vec<Obstacle>> {
    let point = || [-6.0..6.0_f64, -6.0..6.0];
    let circle =
        (point(), 0.02..0.3_f64).prop_map(|(centre, radius)| Outline::Circle { centre, radius });
    let face = (point(), point()).prop_map(|(from, to)| Outline::Face(Segment::new(from, to)));
    let walk = prop::option::of(Just(Oscillation { by: [0.5, -1.0], takes: 3.0 }));
    let obstacle = (prop_oneof![circle, face], walk);
    prop::collection::vec(obstacle.prop_map(|(outline, walk)| Obstacle { outline, walk }), 0..4)
}

/// Bits of every number of the reflectors.
fn bits(found: &[Reflector]) -> Vec<(Source, [u64; 3])> {
    let of = |r: &Reflector| (r.source, [r.distance, r.off_axis, r.audible].map(f64::to_bits));
    found.iter().map(of).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_500))]

    /// In any map the search finds the same reflectors, to the bit and in the same order, as a comparison of all walls,
    /// vertices and pairs; so do the vertices and the first wall on the axis.
    #[test]
    fn the_index_changes_no_bit(
        walls in walls(), obstacles in obstacles(), from in [-7.0..7.0_f64, -7.0..7.0],
        is_on_grid: bool, velocity in [-30.0..30.0_f64, -30.0..30.0], eighths in -8_i8..8,
        turned in prop_oneof![Just(0.0), -0.4..0.4_f64],
    ) {
        // On the grid the sonar is in line with walls, where rounding decides.
        let from = if is_on_grid { from.map(|x| (10.0 * x).round() * 0.1) } else { from };
        let axis = angle::wrap(f64::from(eighths) * std::f64::consts::FRAC_PI_4 + turned);
        let world = World::of(walls).with_obstacles(obstacles);
        let places: Vec<_> = world.vertices.iter().map(|v| (v.at, v.walls.clone())).collect();
        prop_assert_eq!(places, vertices(&world.walls));
        let hit = |found: Option<(usize, Point)>| found.map(|(wall, at)| (wall, at.map(f64::to_bits)));
        prop_assert_eq!(hit(world.on_axis(from, axis)), hit(on_axis(&world, from, axis)));
        let sonar_after =
            |after: f64| [from[0] + after * velocity[0], from[1] + after * velocity[1]];
        let ping = Ping { time: 1.3, sonar_after: &sonar_after, direction: axis };
        for sensor in [SensorModel::nxt(), SensorModel::hc_sr04(), SensorModel::polaroid_6500()] {
            let obstacles = world.obstacles.iter().map(|o| o.outline_at(ping.time)).collect();
            let all = Exhaustive { world: &world, sensor: &sensor, ping: &ping, obstacles, from };
            prop_assert_eq!(bits(&Search::new(&world, &sensor, &ping, from).run()), bits(&all.run()));
        }
    }
}
