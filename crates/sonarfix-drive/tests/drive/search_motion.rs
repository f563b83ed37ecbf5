//! A robot that searches, in rooms of straight walls: an independent world in f64 whose sonar returns the nearest foot of a perpendicular
//! within its cone.
#![expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]

use proptest::prelude::*;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Metres, MetresPerSecond, Radians, RadiansPerSecond};
use sonarfix_drive::search_motion::{SearchMover, Speeds};
use sonarfix_hal::config::{SearchMotion, SearchMotionKind};
use sonarfix_link::Motion;

const BUMPER: f64 = 0.3;
const TRACK_WIDTH: f64 = 0.16;
/// Time of a ping, seconds.
const PERIOD: f64 = 0.066;
/// Half of the cone.
const CONE: f64 = 0.26;

type Wall = [[f64; 2]; 2];

fn mover(kind: SearchMotionKind) -> SearchMover {
    let motion = SearchMotion { kind, bumper: Metres(BUMPER as f32) };
    SearchMover::new(motion, Speeds::SMALL)
}

/// The robot, its sonar in the middle of the axle, and its sweep.
struct World {
    walls: Vec<Wall>,
    at: [f64; 2],
    heading: f64,
    bearing: f64,
    step: f64,
    driven: f64,
}

impl World {
    fn new(walls: Vec<Wall>, at: [f64; 2], heading: f64) -> Self {
        let step = 10_f64.to_radians();
        Self { walls, at, heading, bearing: -1.4, step, driven: 0.0 }
    }

    fn foot(&self, [[ax, ay], [bx, by]]: Wall) -> Option<(f64, f64)> {
        let ([x, y], [dx, dy]) = (self.at, [bx - ax, by - ay]);
        let along = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy);
        let [fx, fy] = [ax + along * dx - x, ay + along * dy - y];
        (0.0..=1.0).contains(&along).then(|| (fx.hypot(fy), fy.atan2(fx)))
    }

    fn nearest(&self) -> f64 {
        let ends = self.walls.iter().flatten();
        let ends = ends.map(|[x, y]| (x - self.at[0]).hypot(y - self.at[1]));
        let feet = self.walls.iter().filter_map(|wall| self.foot(*wall)).map(|(range, _)| range);
        feet.chain(ends).fold(f64::INFINITY, f64::min)
    }

    fn ping(&mut self) -> (Radians, Option<Metres>) {
        let bearing = self.bearing;
        let next = bearing + self.step;
        if next.abs() > 1.5 {
            self.step = -self.step;
        }
        self.bearing += self.step;
        let axis = self.heading + bearing;
        let feet = self.walls.iter().filter_map(|wall| self.foot(*wall));
        let within = feet.filter(|(_, toward)| {
            let off = (toward - axis).sin().atan2((toward - axis).cos());
            off.abs() < CONE
        });
        let range = within.map(|(range, _)| range).fold(f64::INFINITY, f64::min);
        (Radians(bearing as f32), (range < 4.0).then_some(Metres(range as f32)))
    }

    fn drive(&mut self, motion: Motion) -> WheelTravel {
        let (advance, turn) =
            (PERIOD * f64::from(motion.speed.0), PERIOD * f64::from(motion.turn.0));
        self.heading += turn;
        self.at[0] += advance * self.heading.cos();
        self.at[1] += advance * self.heading.sin();
        self.driven += advance;
        let half = 0.5 * TRACK_WIDTH * turn;
        WheelTravel::new((advance + half) as f32, (advance - half) as f32)
    }

    /// A ping and the motion after it.
    fn step(&mut self, mover: &mut SearchMover) -> Motion {
        let (bearing, range) = self.ping();
        mover.ping(bearing, range);
        let motion = mover.motion();
        mover.odometry(self.drive(motion), Metres(TRACK_WIDTH as f32));
        motion
    }
}

/// A room of four walls, the corners within 20 % of a rectangle.
fn room() -> impl Strategy<Value = Vec<Wall>> {
    let corner = || (-0.4_f64..0.4, -0.4_f64..0.4);
    (2.0_f64..6.0, 2.0_f64..6.0, [corner(), corner(), corner(), corner()]).prop_map(
        |(width, depth, off)| {
            let [a, b, c, d] = off.map(|(dx, dy)| [0.5 * dx, 0.5 * dy]);
            let at = |x: f64, y: f64, [dx, dy]: [f64; 2]| [x + dx, y + dy];
            around([at(0.0, 0.0, a), at(width, 0.0, b), at(width, depth, c), at(0.0, depth, d)])
        },
    )
}

/// The walls between four corners.
fn around([a, b, c, d]: [[f64; 2]; 4]) -> Vec<Wall> {
    vec![[a, b], [b, c], [c, d], [d, a]]
}

proptest! {
    /// From anywhere in a room that is not nearer than the bumper distance to a wall, it never comes nearer than a part of that, and it
    /// drives on for as long as it searches.
    #[test]
    fn it_stays_away_from_walls_and_drives_on(walls in room(), x in 0.4_f64..0.6, y in 0.4_f64..0.6, heading in -3.1_f64..3.1) {
        let [_, [[width, _], _], [[_, depth], _], _] = walls.as_slice() else { unreachable!() };
        let (width, depth) = (*width, *depth);
        let mut world = World::new(walls, [x * width, y * depth], heading);
        let mut mover = mover(SearchMotionKind::Ahead);
        for _ in 0..3_000 {
            world.step(&mut mover);
            prop_assert!(world.nearest() > 0.5 * BUMPER, "{} m at {:?}", world.nearest(), world.at);
        }
        // 200 s.
        prop_assert!(world.driven > 3.0, "{} m", world.driven);
    }

    /// Nothing but a finite motion within its speeds comes out, whatever goes in, and it never drives backwards.
    #[test]
    fn any_input_gives_a_motion_within_the_speeds(
        inputs in prop::collection::vec((any::<f32>(), any::<Option<f32>>(), any::<f32>(), any::<f32>()), 1..200),
    ) {
        let mut mover = mover(SearchMotionKind::Ahead);
        for (bearing, range, right, left) in inputs {
            mover.ping(Radians(bearing), range.map(Metres));
            mover.odometry(WheelTravel::new(right, left), Metres(TRACK_WIDTH as f32));
            let Motion { speed, turn } = mover.motion();
            prop_assert!(speed.0 >= 0.0 && speed <= Speeds::SMALL.ahead, "{speed:?}");
            prop_assert!(turn.0.abs() <= Speeds::SMALL.turn.0, "{turn:?}");
        }
    }
}

/// In the middle of a square of 4 m, whose walls leave 1.7 m.
fn in_a_square() -> World {
    let walls = around([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
    World::new(walls, [2.0, 2.0], 0.0)
}

/// It stands until it has looked 30° to 45° to both sides, and ends at the bumper distance before the wall.
#[test]
fn it_looks_ahead_before_it_drives_and_stops_at_the_bumper_distance() {
    let mut world = in_a_square();
    let mut mover = mover(SearchMotionKind::Ahead);
    let mut looked = vec![world.bearing];
    while world.step(&mut mover).speed.0 == 0.0 {
        looked.push(world.bearing);
    }
    let (last, before) = looked.split_last().unwrap();
    assert!(*last > 30_f64.to_radians(), "{looked:?}");
    assert!(before.iter().all(|bearing| *bearing < 30_f64.to_radians()), "{looked:?}");
    while world.step(&mut mover).speed.0 > 0.0 {}
    assert!((4.0 - world.at[0] - BUMPER).abs() < 0.02, "{:?}", world.at);
}

/// Before a wall that it meets at an angle: on along the wall, not back across it.
#[test]
fn it_turns_to_where_the_most_is_free() {
    for side in [1.0, -1.0] {
        let mut world = World { heading: 0.7 * side, ..in_a_square() };
        let mut mover = mover(SearchMotionKind::Ahead);
        while world.step(&mut mover).speed.0 == 0.0 {}
        while world.step(&mut mover).speed.0 > 0.0 {}
        let (before, from) = (world.heading, world.driven);
        while world.step(&mut mover).speed.0 == 0.0 {}
        assert!(side * (world.heading - before) > 0.3, "{}", world.heading);
        while world.step(&mut mover).speed.0 > 0.0 {}
        assert!(world.driven - from > 0.2, "{} m", world.driven - from);
    }
}

/// A dead sonar: it stands after 5 cm.
#[test]
fn it_does_not_drive_without_pings() {
    let mut world = in_a_square();
    let mut mover = mover(SearchMotionKind::Ahead);
    while world.step(&mut mover).speed.0 == 0.0 {}
    let from = world.driven;
    for _ in 0..100 {
        let travel = world.drive(mover.motion());
        mover.odometry(travel, Metres(TRACK_WIDTH as f32));
    }
    assert!((0.04..0.06).contains(&(world.driven - from)), "{}", world.driven - from);
}

/// A person turns a robot that drives: what is ahead is not known any more.
#[test]
fn it_sweeps_again_after_a_turn_that_it_has_not_made() {
    let mut world = in_a_square();
    let mut mover = mover(SearchMotionKind::Ahead);
    while world.step(&mut mover).speed.0 == 0.0 {}
    mover.odometry(WheelTravel::new(0.02, -0.02), Metres(TRACK_WIDTH as f32));
    assert_eq!(mover.motion(), Motion::default());
}

#[test]
fn a_spin_is_one_full_turn() {
    let mut world = in_a_square();
    let mut mover = mover(SearchMotionKind::Spin);
    for _ in 0..1_000 {
        assert_eq!(world.step(&mut mover).speed, MetresPerSecond(0.0));
    }
    assert!((0.0..0.1).contains(&(world.heading - std::f64::consts::TAU)), "{}", world.heading);
    assert_eq!(mover.motion(), Motion::default());
}

/// No wheel is faster than half of the fastest.
#[test]
fn the_speeds_are_those_of_the_robot() {
    let slow = Speeds::within(MetresPerSecond(0.1), Metres(0.2));
    assert_eq!(slow.ahead, MetresPerSecond(0.05));
    assert_eq!((slow.turn, slow.spin), (RadiansPerSecond(0.5), RadiansPerSecond(0.5)));
    assert_eq!(Speeds::within(MetresPerSecond(10.0), Metres(0.2)), Speeds::SMALL);
}
