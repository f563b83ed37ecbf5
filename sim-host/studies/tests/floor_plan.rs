//! Random floor plans, and the measurement policies on them.

use std::collections::HashSet;

use sonarfix_map::{Outline, Scenario};
use sonarfix_sim::plant::follower::Follower;
use sonarfix_sim::trace::Pose;
use sonarfix_studies::floor_plan::compare::{self, informative, median_ratio, nearest};
use sonarfix_studies::floor_plan::{FloorPlan, Kind};

/// Clearance in the plans' scenarios, metres.
const CLEARANCE: f64 = 0.2;
const SEEDS: std::ops::Range<u64> = 0..200;

type Point = [f64; 2];
type Ends = [Point; 2];

/// Distance of two segments by brute force: the ends, and 1 cm steps along both. An oracle that is
/// independent of the reader's check, with an error below a centimetre.
fn distance(a: Ends, b: Ends) -> f64 {
    let steps = |[from, to]: Ends| {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let count = (length / 0.01).ceil().max(1.0);
        let mut points = Vec::new();
        let mut step = 0.0;
        while step <= count {
            let share = step / count;
            points.push([from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]);
            step += 1.0;
        }
        points
    };
    let to_segment = |[px, py]: Point, [from, to]: Ends| {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let (x, y) = (px - from[0], py - from[1]);
        let share = ((x * dx + y * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
        (x - share * dx).hypot(y - share * dy)
    };
    steps(a).into_iter().map(|point| to_segment(point, b)).fold(f64::INFINITY, f64::min)
}

fn legs(scenario: &Scenario) -> Vec<Ends> {
    let plan = scenario.path.plan();
    let corners: Vec<Point> = std::iter::once(plan.start).chain(plan.corners.clone()).collect();
    corners.iter().zip(corners.iter().skip(1)).map(|(&from, &to)| [from, to]).collect()
}

/// Every seed gives a valid scenario (walls with names and lengths, a path with clearance) within the
/// size limits, with a path through doors.
#[test]
fn every_seed_gives_a_plan_that_can_be_driven() {
    let mut kinds = HashSet::new();
    for seed in SEEDS {
        let plan = FloorPlan::new(seed);
        let scenario = plan.scenario().unwrap_or_else(|error| panic!("{seed}: {error}"));
        let ends = scenario.floor.named_walls().iter().flat_map(|wall| [wall.from(), wall.to()]);
        for axis in 0..2 {
            let size = ends.clone().map(|end| end[axis]).fold(0.0, f64::max);
            assert!((3.5..=20.0).contains(&size), "{seed}: {size} m");
        }
        // Paths are at least 25 m long, unless many rooms are too small.
        let length = scenario.path.length();
        assert!((25.0..=100.0).contains(&length), "{seed}: {length} m");
        kinds.insert(plan.kind.name());
    }
    assert_eq!(kinds.len(), 3);
}

/// By an independent oracle: no wall and no unmapped object is closer to the path than the clearance.
#[test]
fn the_path_has_clearance_from_walls_and_furniture() {
    for seed in SEEDS.step_by(5) {
        let scenario = FloorPlan::new(seed).scenario().unwrap();
        let walls = scenario.floor.named_walls().iter().map(|wall| ([wall.from(), wall.to()], 0.0));
        let unmapped = scenario.surroundings.obstacles.iter().map(|o| match o.outline {
            Outline::Face { from, to } => ([from, to], 0.0),
            Outline::Circle { centre: [x, y], radius } => ([[x, y], [x + 1e-6, y]], radius),
        });
        let things: Vec<(Ends, f64)> = walls.chain(unmapped).collect();
        for leg in legs(&scenario) {
            for &(ends, radius) in &things {
                let distance = distance(leg, ends) - radius;
                assert!(distance > CLEARANCE - 1e-9, "{seed}: {leg:?} and {ends:?}: {distance}");
            }
        }
    }
}

/// The path of a plan with several rooms crosses from room to room. A crossing is a short leg with a
/// wall on both sides at half a door's width.
#[test]
fn paths_lead_through_doors() {
    let mut crossings = 0;
    for seed in SEEDS {
        let plan = FloorPlan::new(seed);
        if plan.rooms < 3 {
            continue;
        }
        let scenario = plan.scenario().unwrap();
        let through = legs(&scenario).into_iter().filter(|&[from, to]| {
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            let length = dx.hypot(dy);
            let middle = [f64::midpoint(from[0], to[0]), f64::midpoint(from[1], to[1])];
            let beside = |side: f64| {
                let reach = side * 0.56 / length;
                let probe = [middle, [middle[0] - dy * reach, middle[1] + dx * reach]];
                scenario
                    .floor
                    .named_walls()
                    .iter()
                    .any(|w| distance(probe, [w.from(), w.to()]) < 0.02)
            };
            (dx.abs() < 1e-9 || dy.abs() < 1e-9) && beside(1.0) && beside(-1.0)
        });
        let through = through.count();
        assert!(through > 0, "{seed}: never through a door");
        crossings += through;
    }
    assert!(crossings > 1_000, "{crossings}");
}

/// Some furniture is mapped, some is not.
#[test]
fn plans_have_mapped_and_unmapped_furniture() {
    let (mut mapped, mut unmapped, mut thick) = (0, 0, 0);
    for seed in SEEDS {
        let scenario = FloorPlan::new(seed).scenario().unwrap();
        let walls = scenario.floor.named_walls();
        mapped += usize::from(walls.iter().any(|wall| wall.name().starts_with("furniture")));
        unmapped += usize::from(!scenario.surroundings.obstacles.is_empty());
        // The outermost face of a thick wall is not at the edge of the grid.
        let west = walls.iter().map(|wall| wall.from()[0]).fold(f64::INFINITY, f64::min);
        thick += usize::from(west > 0.0);
    }
    assert!(mapped > 150 && unmapped > 180, "{mapped} {unmapped}");
    assert!((100..180).contains(&thick), "{thick}");
}

#[test]
fn a_seed_gives_the_same_plan_again_and_another_seed_another() {
    assert_eq!(FloorPlan::new(7), FloorPlan::new(7));
    let plans: HashSet<String> = SEEDS.map(|seed| FloorPlan::new(seed).toml).collect();
    assert_eq!(plans.len(), SEEDS.count());
    // Plans do not change, so that results stay comparable.
    let plan = FloorPlan::new(0);
    assert_eq!((plan.kind, plan.rooms), (Kind::Office, 9));
}

/// A path follower with the true pose reaches the end.
#[test]
fn a_follower_reaches_the_end() {
    let scenario = FloorPlan::new(3).scenario().unwrap();
    let mut follower = Follower::new(&scenario.path, 0.1);
    let start = scenario.path.pose_at(0.0);
    let mut pose = Pose { x: start.x, y: start.y, heading: start.heading };
    for _ in 0..10_000 {
        let command = follower.command(&pose);
        pose.heading += 0.1 * command.turn_rate;
        pose.x += 0.1 * command.speed * pose.heading.cos();
        pose.y += 0.1 * command.speed * pose.heading.sin();
    }
    let end = scenario.path.pose_at(scenario.path.duration());
    assert!((end.x - pose.x).hypot(end.y - pose.y) < 0.03);
}

/// A short comparison. The margins are for this number of runs: docs/floor-plans.md has more.
#[test]
fn informative_is_no_worse_in_the_median_plan() {
    let results = compare::run(0, 24, 3, &|| ()).0;
    let median = median_ratio(&results);
    assert!(median.value < 1.0 && median.to < 1.15, "{median:?}");
    let lost = |of| results.iter().map(|result| result.lost(of)).sum::<usize>();
    assert!(lost(informative) <= lost(nearest) + 2, "{} {}", lost(informative), lost(nearest));
}

/// Both policies have the same wheel errors, and the comparison is reproducible.
#[test]
fn a_comparison_can_be_repeated() {
    let results = compare::run(5, 2, 2, &|| ()).0;
    assert_eq!(results, compare::run(5, 2, 2, &|| ()).0);
    assert_eq!(results[1].plan.seed, 6);
    for result in &results {
        assert_eq!(result.pairs.len(), 2);
        assert_ne!(result.pairs[0], result.pairs[1]);
        let ratio = result.ratio();
        assert!(ratio.from <= ratio.value && ratio.value <= ratio.to, "{ratio:?}");
        let by_hand = result.rms(informative) / result.rms(nearest);
        assert!((ratio.value - by_hand).abs() < 1e-12);
    }
}
