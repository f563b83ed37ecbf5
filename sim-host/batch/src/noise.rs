//! Estimates the noises from the residuals: each variance is the weighted sum of squares of its group over the group's
//! redundancy, the number of residuals minus the trace of their leverage. Iterated, this is the restricted maximum of
//! the marginal likelihood (Förstner 1979; Koch, *Parameter Estimation*, ch. 3.6).

#![expect(
    clippy::indexing_slicing,
    reason = "matches and covariance have the lengths of the chain"
)]

use crate::chain::Covariance;
use crate::odometry::WheelNoise;
use crate::problem::{Noise, Problem, State};

/// Residuals beyond this many deviations are outliers.
pub const INLIER: f64 = 3.0;
/// Variance of a normal variable that is cut off at [`INLIER`] deviations.
const CUT_OFF: f64 = 0.973;
/// Largest change of a noise in one iteration, as a factor.
const CHANGE: f64 = 3.0;
/// Smallest redundancy from which a variance is estimated.
const ENOUGH: f64 = 20.0;

#[derive(Debug, Clone, Copy, Default)]
struct Group {
    squares: f64,
    redundancy: f64,
}

impl Group {
    /// The factor by which the deviation changes.
    fn factor(&self) -> f64 {
        if self.redundancy < ENOUGH {
            return 1.0;
        }
        (self.squares / self.redundancy).sqrt().clamp(1.0 / CHANGE, CHANGE)
    }
}

/// One iteration: the noises that the residuals of the inliers have.
#[must_use]
pub fn estimate(problem: &Problem, state: &State, covariance: &Covariance) -> Noise {
    let noise = &problem.noise;
    let wheel = edges(problem, state, covariance).factor();
    let range = ranges(problem, state, covariance).factor();
    let [position, heading] = references(problem, state, covariance).map(|group| group.factor());
    Noise {
        wheel: WheelNoise::independent((noise.wheel.turn * wheel).clamp(1e-5, 0.1)),
        range: (noise.range * range).clamp(2e-4, 0.2),
        range_per_metre: noise.range_per_metre * range,
        position: (noise.position * position).clamp(1e-5, 1.0),
        heading: (noise.heading * heading).clamp(1e-5, 1.0),
    }
}

fn ranges(problem: &Problem, state: &State, covariance: &Covariance) -> Group {
    let mut group = Group::default();
    for (k, event) in problem.chain.pings.iter().enumerate() {
        let Some(reflector) = problem.matches[k].filter(|_| problem.window.contains(&event.pose))
        else {
            continue;
        };
        let Some(term) = problem.range_term(state, k, reflector) else { continue };
        let normalized = term.residual / term.deviation;
        if normalized.abs() > INLIER {
            continue;
        }
        let leverage = problem.variance(covariance, event.pose, &term);
        group.squares += normalized * normalized / CUT_OFF;
        group.redundancy += (1.0 - leverage / term.deviation.powi(2)).clamp(0.0, 1.0);
    }
    group
}

fn edges(problem: &Problem, state: &State, covariance: &Covariance) -> Group {
    let mut group = Group::default();
    for i in problem.window.start..problem.window.end.saturating_sub(1) {
        let Some(term) = problem.edge_term(state, i) else { continue };
        let square = term.residual.dot(&(term.information * term.residual));
        if square > (INLIER + 1.0).powi(2) {
            continue;
        }
        let at = i - problem.window.start;
        let (from, to, by) = (&term.by_from, &term.by_to, &term.by_constants);
        let neighbours = &covariance.neighbours[at];
        let (one, other) = (&covariance.cross[at], &covariance.cross[at + 1]);
        let mixed = from * neighbours * to.transpose()
            + from * one * by.transpose()
            + to * other * by.transpose();
        let spread = from * covariance.poses[at] * from.transpose()
            + to * covariance.poses[at + 1] * to.transpose()
            + by * &covariance.constants * by.transpose()
            + mixed
            + mixed.transpose();
        let leverage = (term.information * spread).trace();
        group.squares += square;
        group.redundancy += (3.0 - leverage).clamp(0.0, 3.0);
    }
    group
}

fn references(problem: &Problem, state: &State, covariance: &Covariance) -> [Group; 2] {
    let mut groups = [Group::default(); 2];
    let deviations = [problem.noise.position, problem.noise.position, problem.noise.heading];
    for i in problem.window.clone() {
        let Some(term) = problem.reference_term(state, i) else { continue };
        let at = i - problem.window.start;
        let (by_pose, by) = (&term.by_pose, &term.by_constants);
        let mixed = by_pose * &covariance.cross[at] * by.transpose();
        let spread = by_pose * covariance.poses[at] * by_pose.transpose()
            + by * &covariance.constants * by.transpose()
            + mixed
            + mixed.transpose();
        for (k, deviation) in deviations.iter().enumerate() {
            let normalized = term.residual[k] / deviation;
            if normalized.abs() > INLIER {
                continue;
            }
            let group = &mut groups[usize::from(k == 2)];
            group.squares += normalized * normalized / CUT_OFF;
            group.redundancy += (1.0 - spread[(k, k)] / (deviation * deviation)).clamp(0.0, 1.0);
        }
    }
    groups
}
