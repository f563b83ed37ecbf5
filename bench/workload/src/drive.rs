//! The drive of every filter: curves to both sides, a turn in place, and after every tenth travel a range to one of four
//! walls.

use crate::Filter;
use crate::model::{Range, STATES, Step, Vector, turn};

/// Wheel travels of the drive.
pub const STEPS: usize = 200;
/// Wheel travels between two ranges: one range per second at ten samples per second.
pub const STEPS_A_RANGE: usize = 10;

/// Start: 1 m from two walls, with a heading and small errors other than zero.
pub const START: Vector = [1.0, 1.2, 0.3, 0.002, -0.003, 0.001];
/// Variances at the start: 5 cm, 0.02 rad, 1 %, 2 %, 1 cm.
pub const VARIANCES: Vector = [25e-4, 25e-4, 4e-4, 1e-4, 4e-4, 1e-4];
/// The diagonal of Q of one travel: 0.3 mm, 1 mrad, and 1e-6 of each parameter.
pub const NOISE: Vector = [1e-7, 1e-7, 1e-6, 1e-12, 1e-12, 1e-12];
/// 5 mm, in m².
const RANGE_VARIANCE: f32 = 25e-6;
/// Errors of the ranges, metres, cyclically.
const OFF: [f32; 5] = [0.004, -0.006, 0.001, 0.007, -0.003];

/// Travel of the right and the left wheel, metres.
fn travel(step: usize) -> (f32, f32) {
    match step % 50 {
        0..20 => (0.04, 0.038),
        20..30 => (0.03, 0.036),
        30..36 => (0.02, -0.02),
        _ => (0.041, 0.04),
    }
}

/// One travel, at a filter's own estimate of the heading. Sine and cosine are computed here, outside of the measured calls.
#[must_use]
pub fn step(filter: &impl Filter, step: usize) -> Step {
    let (right, left) = travel(step);
    let [_, _, heading, mean, difference, width_error] = filter.state();
    let (turned, _) = turn(mean, difference, width_error, right, left);
    let (sin, cos) = libm::sincosf(heading + 0.5 * turned);
    Step { right, left, sin, cos, noise: NOISE }
}

/// The range after this number of travels, if one is due, with the error of the script.
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

/// Runs a filter over the whole drive.
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
