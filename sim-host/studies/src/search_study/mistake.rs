//! Robots that search with a wrong map or robot file.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{FileError, Floor, NamedWall, Scenario};

use crate::floor_plan::FloorPlan;

/// Seeds of other plans for a plan, from its own.
pub(super) const BESIDE: u64 = 1_000_000;
/// How far a wall of the map is from its place, metres.
const MOVED: f64 = 0.2;
/// Errors of wheels that are wrong, and noise that is too large, by those of other trials.
const TIMES: f64 = 3.0;

/// What is wrong with the map or the robot file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Mistake {
    /// The map of another plan of the same kind: every answer is wrong.
    OtherMap,
    /// A map without one of the walls.
    WallMissing,
    /// A map in which one of the walls is 20 cm from its place.
    WallMoved,
    /// Wheels whose scales are wrong by up to 3 % each, instead of 1 %.
    Wheels,
    /// Three times the noise of the robot file, of wheels and ranges.
    Noise,
}

impl Mistake {
    /// The map that the robot has, instead of that of its floor plan, which is of this seed.
    pub(super) fn map(self, floor: &Floor, seed: u64) -> Result<Floor, FileError> {
        let mut walls = floor.named_walls().to_vec();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let wall = rng.random_range(0..walls.len().max(1));
        match self {
            Self::OtherMap => return Ok(another(seed).scenario()?.floor),
            Self::WallMissing if wall < walls.len() => {
                walls.remove(wall);
            }
            Self::WallMoved => {
                let by = if rng.random() { MOVED } else { -MOVED };
                let moved = walls.get(wall).and_then(|wall| beside(wall, by));
                walls.splice(wall..=wall, moved);
            }
            Self::WallMissing | Self::Wheels | Self::Noise => {}
        }
        Ok(Floor::new(walls))
    }

    /// The scenario with the noise of this mistake.
    pub(super) fn noisy(self, mut scenario: Scenario) -> Scenario {
        if self == Self::Noise {
            let truth = &mut scenario.truth;
            truth.wheel_noise *= TIMES;
            truth.range_noise *= TIMES;
            truth.range_noise_per_metre *= TIMES;
        }
        scenario
    }

    /// The errors of the wheels by those of other trials.
    pub(super) fn wheels(self) -> f64 {
        if self == Self::Wheels { TIMES } else { 1.0 }
    }
}

/// Another plan of the same kind than that of the seed.
fn another(seed: u64) -> FloorPlan {
    let kind = FloorPlan::new(seed).kind;
    let mut number = seed.wrapping_add(BESIDE);
    loop {
        let plan = FloorPlan::new(number);
        if plan.kind == kind {
            return plan;
        }
        number = number.wrapping_add(1);
    }
}

/// A wall so far to the left of its place, seen from its first end.
fn beside(wall: &NamedWall, by: f64) -> Option<NamedWall> {
    let [[x, y], [to_x, to_y]] = [wall.from(), wall.to()];
    let length = (to_x - x).hypot(to_y - y);
    let [left, up] = [(y - to_y) / length * by, (to_x - x) / length * by];
    NamedWall::new(wall.name().to_owned(), [x + left, y + up], [to_x + left, to_y + up]).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One wall is not in the map, or lies 20 cm beside its place; the others are the same.
    #[test]
    fn one_wall_is_missing_or_moved() {
        for seed in 43_000..43_010 {
            let floor = FloorPlan::new(seed).scenario().unwrap().floor;
            let walls = floor.named_walls();
            let missing = Mistake::WallMissing.map(&floor, seed).unwrap();
            assert_eq!(missing.named_walls().len(), walls.len() - 1);
            assert!(missing.named_walls().iter().all(|wall| walls.contains(wall)));

            let moved = Mistake::WallMoved.map(&floor, seed).unwrap();
            let pairs = || walls.iter().zip(moved.named_walls());
            let other: Vec<_> = pairs().filter(|(wall, moved)| wall != moved).collect();
            let [(wall, moved)] = other.as_slice() else { panic!("{other:?}") };
            for ([x, y], [to_x, to_y]) in [(wall.from(), moved.from()), (wall.to(), moved.to())] {
                assert!(((to_x - x).hypot(to_y - y) - 0.2).abs() < 1e-9);
            }
            let along = [wall.to()[0] - wall.from()[0], wall.to()[1] - wall.from()[1]];
            let by = [moved.from()[0] - wall.from()[0], moved.from()[1] - wall.from()[1]];
            assert!((along[0] * by[0] + along[1] * by[1]).abs() < 1e-9);
        }
    }

    /// The robot file is right about neither wheels nor ranges.
    #[test]
    fn the_noise_is_three_times_that_of_the_plan() {
        let scenario = FloorPlan::new(43_000).scenario().unwrap();
        let noisy = Mistake::Noise.noisy(scenario.clone());
        let [is, of] = [&noisy, &scenario].map(|of| &of.truth);
        for ratio in [is.wheel_noise / of.wheel_noise, is.range_noise / of.range_noise] {
            assert!((ratio - 3.0).abs() < 1e-9, "{ratio}");
        }
        assert_eq!(noisy.robot, scenario.robot);
    }
}
