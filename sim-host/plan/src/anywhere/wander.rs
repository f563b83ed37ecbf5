//! A drive from a random place to random places.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{Path, PathError, PathPlan};
use sonarfix_sim::world::segment::{Point, distance};

use super::free_space::{FreeSpace, ROOMY};
use super::route::{self, Steps};

/// Minimum distance of two corners, metres.
const SHORTEST: f64 = 0.3;
/// Draws of a place that has room around it, or is far enough.
const DRAWS: usize = 50;
/// Places to which a robot drives at most.
const MOST_TARGETS: usize = 1_000;

/// A drive of at least so many seconds, with speed and turn rate of `plan`; `None` if no place is free or all are one.
///
/// # Errors
/// [`PathError`], if speed or turn rate are invalid.
pub(super) fn drive(
    space: &FreeSpace,
    steps: &Steps,
    plan: &PathPlan,
    seconds: f64,
    rng: &mut ChaCha8Rng,
) -> Result<Option<Path>, PathError> {
    let Some(mut here) = roomy(space, rng, |_| true) else { return Ok(None) };
    let start = space.centre(here);
    let mut corners: Vec<Point> = Vec::new();
    for _ in 0..MOST_TARGETS {
        let is_apart = |cell: usize| {
            space.part(cell) == space.part(here)
                && distance(space.centre(cell), space.centre(here)) >= SHORTEST
        };
        let Some(target) = roomy(space, rng, is_apart) else { return Ok(None) };
        corners.extend(route::corners(space, steps, here, target));
        here = target;
        let plan = PathPlan { start, corners: corners.clone(), laps: 1, ..plan.clone() };
        let path = Path::new(plan)?;
        if path.duration() >= seconds {
            return Ok(Some(path));
        }
    }
    Ok(None)
}

/// A random free cell with this property and, if one is drawn soon, with room around it.
fn roomy(space: &FreeSpace, rng: &mut ChaCha8Rng, is: impl Fn(usize) -> bool) -> Option<usize> {
    let free = space.free();
    let mut found = None;
    for _ in 0..DRAWS {
        if free.is_empty() {
            break;
        }
        let drawn = free.get(rng.random_range(0..free.len())).copied();
        let Some(cell) = drawn.filter(|cell| is(*cell)) else { continue };
        if space.room(cell) >= ROOMY {
            return Some(cell);
        }
        found = found.or(Some(cell));
    }
    found
}
