//! How soon a pose can be found at all: the posterior over all poses of the map, by the model of the simulated sonar and the pings of a
//! trial of the search.
//!
//! | module | what |
//! |---|---|
//! | `posterior` | the grid of poses at the first ping, and the likelihood of a ping |
//! | `odometry` | the motion since the first ping: the true one, or by the encoders |

mod odometry;
mod posterior;

use serde::Serialize;
use sonarfix_map::Scenario;
use sonarfix_plan::trial::{Heard, SetDown, Trial, TrialError, are_one, observed_trial};
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::Simulation;

use crate::quantiles::Quantiles;
use crate::search_study::Plans;
use odometry::Odometry;
use posterior::Posterior;

/// How soon the posterior odds of one pose against all others exceed 1000.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Bound {
    /// Seconds until then.
    pub after: Option<f64>,
    /// Whether that pose is the true one.
    pub is_right: bool,
}

/// How soon one trial was found, and could have been.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bounded {
    /// The trial.
    pub trial: Trial,
    /// The bound with the odometry known exactly.
    pub exact: Bound,
    /// The bound with the odometry of the encoders; of a robot that stands, the same.
    pub measured: Bound,
}

/// Trials in floor plans, each with its bound.
///
/// # Errors
/// [`TrialError`] of the first plan that cannot be used.
pub fn floor_plans(
    plans: &Plans,
    seconds: f64,
    progress: &impl Progress,
) -> Result<Vec<Bounded>, TrialError> {
    plans.each(progress, |scenario, seed| bounded(scenario, seed, SetDown::Anywhere, seconds))
}

/// The times over many trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Times {
    /// Trials.
    pub trials: usize,
    /// The bound with the odometry known exactly.
    pub exact: Quantiles,
    /// The bound with the odometry of the encoders.
    pub measured: Quantiles,
    /// The search.
    pub found: Quantiles,
    /// Median of the time of the search over the bound with exact odometry, of the trials that have a right bound. A trial that the search
    /// does not find counts as the largest; `None` if it finds fewer than half.
    pub ratio_exact: Option<f64>,
    /// The same with the odometry of the encoders.
    pub ratio_measured: Option<f64>,
}

impl Times {
    /// The times of some trials.
    #[must_use]
    pub fn new(trials: &[Bounded]) -> Self {
        let quantiles = |of: &dyn Fn(&Bounded) -> (Option<f64>, bool)| {
            Quantiles::new(&trials.iter().map(of).collect::<Vec<_>>())
        };
        Self {
            trials: trials.len(),
            exact: quantiles(&|it| (it.exact.after, it.exact.is_right)),
            measured: quantiles(&|it| (it.measured.after, it.measured.is_right)),
            found: quantiles(&|it| (it.trial.unique_after, it.trial.is_right)),
            ratio_exact: ratio(trials, |it| it.exact),
            ratio_measured: ratio(trials, |it| it.measured),
        }
    }
}

/// Median of the time of the search over a bound, of the trials in which the bound is right.
fn ratio(trials: &[Bounded], bound: impl Fn(&Bounded) -> Bound) -> Option<f64> {
    let with_bound = trials.iter().filter(|it| bound(it).is_right);
    let mut ratios: Vec<f64> = with_bound
        .filter_map(|it| Some(it.trial.unique_after.unwrap_or(f64::INFINITY) / bound(it).after?))
        .collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied().filter(|ratio| ratio.is_finite())
}

/// One trial with its bound.
///
/// # Errors
/// [`TrialError`], if the map cannot be used.
pub fn bounded(
    scenario: Scenario,
    seed: u64,
    set_down: SetDown,
    seconds: f64,
) -> Result<Bounded, TrialError> {
    let simulation = Simulation::new(scenario.clone());
    let mut exact = Pending::new(&simulation, Odometry::Exact);
    let is_driving = set_down != SetDown::Standing;
    let mut measured = is_driving.then(|| Pending::new(&simulation, Odometry::Measured));
    let trial = observed_trial(scenario, seed, set_down, seconds, |heard, _| {
        let is_exact_open = exact.take(&heard);
        let is_measured_open = measured.as_mut().is_some_and(|measured| measured.take(&heard));
        is_exact_open || is_measured_open
    })?;
    let measured = measured.map_or(exact.bound, |measured| measured.bound);
    Ok(Bounded { trial, exact: exact.bound, measured })
}

/// A bound that is being computed.
struct Pending<'a> {
    posterior: Posterior<'a>,
    bound: Bound,
}

impl<'a> Pending<'a> {
    fn new(simulation: &'a Simulation, odometry: Odometry) -> Self {
        Self { posterior: Posterior::new(simulation, odometry), bound: Bound::default() }
    }

    /// Takes a ping until the pose is found. Returns whether it is not found yet.
    fn take(&mut self, heard: &Heard) -> bool {
        if self.bound.after.is_none() {
            self.posterior.add(*heard);
            if let Some(pose) = self.posterior.found() {
                let is_right = are_one(&pose, &heard.pose);
                self.bound = Bound { after: Some(heard.time), is_right };
            }
        }
        self.bound.after.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_within_which_a_share_is_found() {
        let trials: Vec<_> = (0..10_u8).map(|n| (Some(f64::from(n)), n != 3)).collect();
        let times = Quantiles::new(&trials);
        assert_eq!((times.half, times.four_fifths), (Some(6.0), Some(9.0)));
        assert_eq!((times.nineteen_twentieths, times.wrong), (None, 0.1));
    }
}
