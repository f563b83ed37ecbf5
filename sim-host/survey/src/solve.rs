//! Levenberg–Marquardt on a window of the problem.

#![expect(clippy::indexing_slicing, reason = "windows lie within the chain")]

use nalgebra::DVector;
use sonarfix_batch::chain::{Covariance, Normal, Singular, Step};
use sonarfix_batch::odometry::wrap;

use crate::problem::{COUNT, DIFFERENCE, Problem, RANGE_SCALE, State, TRACK, Window};

/// Relative decrease of the cost below which the iteration has converged.
const CONVERGED: f64 = 1e-5;
/// Largest damping.
const STUCK: f64 = 1e6;
/// Largest error of wheel difference, track width and range scale.
const LARGEST: f64 = 0.4;

/// Iterates at most `iterations` times; returns the cost. A window without a solution leaves the state as it is.
pub fn solve(problem: &Problem, state: &mut State, window: &Window, iterations: usize) -> f64 {
    let mut damping = 1e-6;
    let (mut normal, mut cost, lines) = problem.linearize(state, window);
    for _ in 0..iterations {
        let next = normal.solve(damping).ok().and_then(|step| {
            let trial = moved(state, window, &lines, &step)?;
            let (normal, cost, _) = problem.linearize(&trial, window);
            Some((trial, normal, cost))
        });
        match next {
            Some((trial, next, lower)) if lower <= cost => {
                let has_converged = cost - lower <= CONVERGED * (1.0 + cost);
                (*state, normal, cost) = (trial, next, lower);
                damping = (damping * 0.1_f64).max(1e-9);
                if has_converged {
                    break;
                }
            }
            _ => {
                damping *= 30.0;
                if damping > STUCK {
                    break;
                }
            }
        }
    }
    cost
}

/// The covariance at a solution, and the lines in the order of its columns.
///
/// # Errors
/// [`Singular`].
pub fn covariance(
    problem: &Problem,
    state: &State,
    window: &Window,
) -> Result<(Covariance, Vec<usize>), Singular> {
    let (normal, _, lines): (Normal, _, _) = problem.linearize(state, window);
    Ok((normal.covariance()?, lines))
}

fn moved(state: &State, window: &Window, lines: &[usize], step: &Step) -> Option<State> {
    let constants: &DVector<f64> = &step.constants;
    if !constants.iter().chain(step.poses.iter().flatten()).all(|value| value.is_finite()) {
        return None;
    }
    let mut moved = state.clone();
    for (i, step) in window.poses.clone().zip(&step.poses) {
        moved.poses[i] += step;
        moved.poses[i].z = wrap(moved.poses[i].z);
    }
    for k in 0..COUNT {
        moved.constants[k] += constants[k];
    }
    for (n, &line) in lines.iter().enumerate() {
        moved.lines[line].angle = wrap(moved.lines[line].angle + constants[COUNT + 2 * n]);
        moved.lines[line].offset += constants[COUNT + 2 * n + 1];
    }
    let is_possible =
        [DIFFERENCE, TRACK, RANGE_SCALE].iter().all(|&k| moved.constants[k].abs() < LARGEST);
    is_possible.then_some(moved)
}
