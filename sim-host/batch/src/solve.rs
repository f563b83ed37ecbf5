//! Levenberg–Marquardt on the problem, and the covariance of its solution.

#![expect(clippy::indexing_slicing, reason = "windows lie within the chain")]

use crate::chain::{Covariance, Singular};
use crate::constants::{COUNT, Name};
use crate::odometry::wrap;
use crate::problem::{Problem, State};

/// Why a problem has no solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SolveError {
    /// See [`Singular`].
    #[error(transparent)]
    Singular(#[from] Singular),
    /// The cost is not finite.
    #[error(
        "the estimate is not finite: check the robot file against the recording (units, mirrored wheels)"
    )]
    Diverged,
}

/// Relative decrease of the cost below which the iteration has converged.
const CONVERGED: f64 = 1e-6;
/// Largest damping.
const STUCK: f64 = 1e8;

/// Iterates from a state to a minimum of the cost, at most `iterations` times; returns the cost there.
///
/// # Errors
/// [`SolveError`].
pub fn solve(problem: &Problem, state: &mut State, iterations: usize) -> Result<f64, SolveError> {
    let mut damping = 1e-6;
    let (mut normal, mut cost) = problem.linearize(state);
    for _ in 0..iterations {
        if !cost.is_finite() {
            return Err(SolveError::Diverged);
        }
        let step = normal.solve(damping);
        let trial = step
            .ok()
            .and_then(|step| moved(problem, state, &step.poses, step.constants.as_slice()));
        let next = trial.map(|trial| {
            let (normal, cost) = problem.linearize(&trial);
            (trial, normal, cost)
        });
        match next {
            Some((trial, next, lower)) if lower <= cost => {
                let has_converged = cost - lower <= CONVERGED * (1.0 + cost);
                (*state, normal, cost) = (trial, next, lower);
                damping = (damping * 0.1).max(1e-9);
                if has_converged {
                    return Ok(cost);
                }
            }
            _ => {
                damping *= 20.0;
                if damping > STUCK {
                    return Ok(cost);
                }
            }
        }
    }
    Ok(cost)
}

/// The covariance of poses and constants at a solution; zero for the fixed constants.
///
/// # Errors
/// [`Singular`].
pub fn covariance(problem: &Problem, state: &State) -> Result<Covariance, Singular> {
    let mut covariance = problem.linearize(state).0.covariance()?;
    for name in Name::ALL.into_iter().filter(|name| !problem.priors.is_free(*name)) {
        covariance.constants[(name as usize, name as usize)] = 0.0;
    }
    Ok(covariance)
}

/// The state after a step; `None` if it is not finite or leaves the range of possible robots.
fn moved(
    problem: &Problem,
    state: &State,
    poses: &[nalgebra::Vector3<f64>],
    constants: &[f64],
) -> Option<State> {
    let mut moved = state.clone();
    for (i, step) in problem.window.clone().zip(poses) {
        moved.poses[i] += step;
        moved.poses[i].z = wrap(moved.poses[i].z);
    }
    for k in 0..COUNT {
        moved.constants.values[k] += constants[k];
    }
    let is_finite = |value: &f64| value.is_finite();
    let drive = moved.constants.drive();
    let is_possible = [drive.right, drive.left, drive.track].iter().all(|error| error.abs() < 0.5);
    let finite = moved.constants.values.iter().all(is_finite)
        && moved.poses.iter().all(|pose| pose.iter().all(is_finite));
    (is_possible && finite).then_some(moved)
}
