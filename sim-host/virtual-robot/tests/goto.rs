//! Routes in the classroom, by the telemetry and the commands of the link: the robot of the scenario, with bad wheels, in a room with
//! furniture that is not on its map.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test should stop")]

#[path = "support/bench.rs"]
mod bench;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::Radians;
use sonarfix::localizer::Start;
use sonarfix_drive::obstacles::Settings;
use sonarfix_drive::pursuit::{Limits, Progress, Reason};
use sonarfix_link::{Command, CommandResult};
use sonarfix_map::{Outline, Scenario};
use sonarfix_monitor::route::{RouteDriver, Surroundings};
use sonarfix_sim::world::segment::{Segment, distance};
use sonarfix_virtual_robot::robot::Parts;

use bench::{Bench, SECOND, classroom};

/// Goals of a run, one after the other.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Goals {
    /// The corners of the path of the scenario.
    Corners,
    /// Three points of the room with a free straight leg to each.
    Anywhere,
}

impl Goals {
    /// A goal after the one before.
    fn next(
        self,
        number: usize,
        scenario: &Scenario,
        from: [f64; 2],
        rng: &mut ChaCha8Rng,
    ) -> Option<[f64; 2]> {
        match self {
            Self::Corners => scenario.path.plan().corners.get(number).copied(),
            Self::Anywhere => (number < 3).then(|| goal(scenario, from, rng)),
        }
    }
}

/// Radius of the robot around the middle of its axle: its sonar is 6 cm ahead of it.
const RADIUS: f64 = 0.1;
/// Free space on both sides of a leg: the margin of a person who plans a route.
const FREE: f64 = 0.35;
/// The largest distance from the goal that counts as arrived.
const ARRIVED: f64 = 0.05;

/// What became of the legs of a run.
#[derive(Debug, Clone, Copy, Default)]
struct Legs {
    all: u32,
    /// Those that ended within [`ARRIVED`] of their goal.
    arrived: u32,
    /// Those on which the robot touched a wall of the map.
    collided: u32,
    /// The largest distance from a goal, metres.
    worst: f64,
}

/// The distance of a point from a segment.
fn aside(point: [f64; 2], [from, to]: [[f64; 2]; 2]) -> f64 {
    distance(point, Segment::new(from, to).nearest(point))
}

/// Distance of two segments of which none crosses the other in this room: the least of their ends.
fn apart(one: [[f64; 2]; 2], other: [[f64; 2]; 2]) -> f64 {
    let ends =
        [aside(one[0], other), aside(one[1], other), aside(other[0], one), aside(other[1], one)];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

/// What stands in the room or walks through it, as segments with a radius.
fn furniture(scenario: &Scenario) -> Vec<([[f64; 2]; 2], f64)> {
    let obstacles = scenario.surroundings.obstacles.iter();
    obstacles
        .map(|obstacle| match (&obstacle.outline, &obstacle.walk) {
            (Outline::Circle { centre, radius }, None) => {
                ([*centre, [centre[0], centre[1] + 1e-6]], *radius)
            }
            (Outline::Circle { centre, radius }, Some(walk)) => {
                let to = [centre[0] + walk.by[0], centre[1] + walk.by[1]];
                ([*centre, to], *radius)
            }
            (Outline::Face { from, to }, _) => ([*from, *to], 0.0),
        })
        .collect()
}

fn walls(scenario: &Scenario) -> Vec<[[f64; 2]; 2]> {
    scenario.floor.named_walls().iter().map(|wall| [wall.from(), wall.to()]).collect()
}

/// The pose that a person sets: off the true one by up to 3 cm and 3°.
fn start(parts: &Parts, rng: &mut ChaCha8Rng) -> Start {
    let start = parts.start().unwrap();
    let mut off = |most: f32| rng.random_range(-most..most);
    let pose = start.pose;
    let heading = pose.heading.turned(Radians::from_degrees(off(3.0))).radians();
    Start { pose: Pose::new(pose.x.0 + off(0.03), pose.y.0 + off(0.03), heading), ..start }
}

/// A goal with a straight free leg from here.
fn goal(scenario: &Scenario, from: [f64; 2], rng: &mut ChaCha8Rng) -> [f64; 2] {
    let (walls, furniture) = (walls(scenario), furniture(scenario));
    loop {
        let to = [rng.random_range(0.0..6.0), rng.random_range(0.0..8.0)];
        let leg = [from, to];
        let is_long = (to[0] - from[0]).hypot(to[1] - from[1]) > 0.5;
        let is_free = walls.iter().all(|wall| apart(leg, *wall) > FREE)
            && furniture.iter().all(|(place, radius)| apart(leg, *place) > FREE + radius);
        if is_long && is_free {
            return to;
        }
    }
}

/// Drives to some goals, one after the other.
fn run(parts: &Parts, scenario: &Scenario, goals: Goals, seed: u64) -> Legs {
    let surroundings = surroundings(scenario);
    let mut bench = Bench::new(parts, seed, true);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    bench.run(start(parts, &mut rng));
    let walls = walls(scenario);
    let mut legs = Legs::default();
    let mut from = scenario.path.plan().start;
    let mut number = 0;
    while let Some(to) = goals.next(number, scenario, from, &mut rng) {
        number += 1;
        let (progress, nearest) = drive(&mut bench, to, 120, &surroundings, &walls);
        let at = bench.robot.pose();
        let error = (at.x - to[0]).hypot(at.y - to[1]);
        legs.all += 1;
        legs.arrived += u32::from(progress == Progress::Arrived && error <= ARRIVED);
        legs.collided += u32::from(nearest < RADIUS);
        legs.worst = legs.worst.max(error);
        if progress != Progress::Arrived || error > ARRIVED {
            eprintln!("seed {seed}: {from:?} to {to:?}: {progress:?} at {at:?}");
        }
        from = to;
    }
    legs
}

/// Drives to a goal, for at most so many seconds; what the robot did last, and its smallest distance from a wall.
fn drive(
    bench: &mut Bench,
    to: [f64; 2],
    seconds: u64,
    surroundings: &Surroundings,
    walls: &[[[f64; 2]; 2]],
) -> (Progress, f64) {
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    let route = [Point::new(to[0] as f32, to[1] as f32)];
    let mut driver = RouteDriver::new(&route, Limits::SMALL, Some(surroundings)).unwrap();
    let (mut progress, mut nearest) = (Progress::Driving, f64::INFINITY);
    let end = bench.robot.now() + seconds * SECOND;
    while progress != Progress::Arrived && bench.robot.now() < end {
        let mut motion = None;
        for telemetry in bench.wait(50_000) {
            if let Some((now, commanded)) = driver.take(&telemetry) {
                (progress, motion) = (now, Some(commanded));
            }
        }
        if let Some(motion) = motion {
            assert_eq!(bench.order(&Command::Drive(motion)), CommandResult::Done);
        }
        let at = bench.robot.pose();
        nearest = walls.iter().map(|wall| aside([at.x, at.y], *wall)).fold(nearest, f64::min);
    }
    bench.wait(SECOND);
    (progress, nearest)
}

fn surroundings(scenario: &Scenario) -> Surroundings {
    Surroundings {
        walls: scenario.floor.walls(),
        rangers: scenario.robot.localizer.rangers,
        settings: Settings::SMALL,
    }
}

fn runs(goals: Goals, seeds: std::ops::Range<u64>) -> Legs {
    let scenario = classroom();
    let parts = Parts::new(scenario.clone()).unwrap();
    let mut all = Legs::default();
    for seed in seeds {
        let Legs { all: legs, arrived, collided, worst } = run(&parts, &scenario, goals, seed);
        all.all += legs;
        all.arrived += arrived;
        all.collided += collided;
        all.worst = all.worst.max(worst);
    }
    println!("{goals:?}: {all:?}");
    all
}

#[test]
fn the_robot_arrives_at_the_corners_of_its_path() {
    let Legs { all, arrived, collided, .. } = runs(Goals::Corners, 0..3);
    assert_eq!((arrived, collided), (all, 0));
}

/// `cargo test --release -p sonarfix-virtual-robot --test goto corners -- --ignored --nocapture`
#[test]
#[ignore = "minutes"]
fn at_corners_99_percent_arrive_and_none_collides() {
    let Legs { all, arrived, collided, .. } = runs(Goals::Corners, 0..100);
    assert!(100 * arrived >= 99 * all && collided == 0);
}

/// Where furniture hides the walls, or none is in reach, the robot stands instead of driving on.
#[test]
#[ignore = "minutes"]
fn anywhere_none_collides() {
    let Legs { collided, .. } = runs(Goals::Anywhere, 0..100);
    assert_eq!(collided, 0);
}

/// A box that is not on the map stands on the leg, in front of the wall to which the sonar is square.
#[test]
fn the_robot_stops_in_front_of_a_box() {
    let mut scenario = classroom();
    let mut added = scenario.surroundings.obstacles[3];
    added.outline = Outline::Face { from: [3.0, 1.2], to: [3.0, 1.8] };
    scenario.surroundings.obstacles = vec![added];
    let surroundings = surroundings(&scenario);
    let parts = Parts::new(scenario.clone()).unwrap();
    let mut bench = Bench::new(&parts, 1, true);
    bench.run(parts.start().unwrap());
    // Less than for which the object is remembered.
    let (progress, _) = drive(&mut bench, [4.5, 1.5], 30, &surroundings, &walls(&scenario));
    assert_eq!(progress, Progress::Stopped(Reason::Obstructed));
    let gap = 3.0 - bench.robot.pose().x;
    assert!((RADIUS..0.35).contains(&gap), "{gap} m in front of the box");
}
