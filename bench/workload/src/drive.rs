//! The drive that every filter is taken on: curves to both sides, a turn on the spot, and every
//! tenth step a range to one of four walls.

use crate::Filter;
use crate::model::{Range, STATES, Step, Vector, turn};

/// Steps of the drive.
pub const STEPS: usize = 200;
/// A range comes after so many steps: a fix a second at ten steps a second.
pub const STEPS_A_RANGE: usize = 10;

/// Where it starts: 1 m from two walls, with a heading and small errors that are not zero.
pub const START: Vector = [1.0, 1.2, 0.3, 0.002, -0.003, 0.001];
/// Variances at the start: 5 cm, 0.02 rad, 1 %, 2 %, 1 cm.
pub const VARIANCES: Vector = [25e-4, 25e-4, 4e-4, 1e-4, 4e-4, 1e-4];
/// The diagonal of Q of a step: 0.3 mm, 1 mrad, and 1e-6 of each parameter.
pub const NOISE: Vector = [1e-7, 1e-7, 1e-6, 1e-12, 1e-12, 1e-12];
/// 5 mm, in m².
const RANGE_VARIANCE: f32 = 25e-6;
/// How far each range is off, metres, in turn.
const OFF: [f32; 5] = [0.004, -0.006, 0.001, 0.007, -0.003];

/// How far right and left wheel roll in a step, metres.
fn travel(step: usize) -> (f32, f32) {
    match step % 50 {
        0..20 => (0.04, 0.038),
        20..30 => (0.03, 0.036),
        30..36 => (0.02, -0.02),
        _ => (0.041, 0.04),
    }
}

/// The step, at a filter's own estimate of the heading: sine and cosine are computed here, outside
/// of what is measured.
#[must_use]
pub fn step(filter: &impl Filter, step: usize) -> Step {
    let (right, left) = travel(step);
    let [_, _, heading, mean, difference, width_error] = filter.state();
    let (turned, _) = turn(mean, difference, width_error, right, left);
    let (sin, cos) = libm::sincosf(heading + 0.5 * turned);
    Step { right, left, sin, cos, noise: NOISE }
}

/// The range after so many steps, if one is due: off by as many millimetres as the script says.
#[must_use]
pub fn range(filter: &impl Filter, step: usize) -> Option<Range> {
    if !(step + 1).is_multiple_of(STEPS_A_RANGE) {
        return None;
    }
    let turn = step / STEPS_A_RANGE;
    // Two walls along the axes and two slanted ones, 6 m away or so.
    let (by_x, by_y) = [(-1.0, 0.0), (0.0, -1.0), (0.8, 0.6), (-0.6, 0.8)][turn % 4];
    let [x, y, ..] = filter.state();
    let mut range = Range { by_x, by_y, offset: 6.0, measured: 0.0, variance: RANGE_VARIANCE };
    range.measured = range.expected(x, y) + OFF[turn % OFF.len()];
    Some(range)
}

/// Takes a filter along the whole drive.
pub fn run(filter: &mut impl Filter) {
    for i in 0..STEPS {
        let step = step(filter, i);
        filter.predict(&step);
        if let Some(range) = range(filter, i) {
            filter.update(&range);
        }
    }
}

const _: () = assert!(START.len() == STATES);
