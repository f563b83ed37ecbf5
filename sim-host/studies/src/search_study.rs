//! Global localization in simulation: trials in floor plans, also with a wrong map or robot file, and in scenarios.

use rayon::prelude::*;
use serde::Serialize;
use sonarfix_map::{Floor, NamedWall, Scenario};
use sonarfix_plan::trial::{SetDown, Trial, TrialError, mistaken_trial, trial};
use sonarfix_sim::progress::Progress;

use crate::floor_plan::{FloorPlan, Kind};
use crate::quantiles::Quantiles;
use mistake::BESIDE;
pub use mistake::Mistake;

mod mistake;

/// Which floor plans.
#[derive(Debug, Clone, Copy)]
pub struct Plans {
    /// The seed of the first; the others count up from it.
    pub first: u64,
    /// How many.
    pub trials: u32,
    /// Of one kind alone.
    pub kind: Option<Kind>,
    /// Walls of each map: those of other plans stand far beside a plan, and a plan with more is left out.
    pub walls: Option<usize>,
    /// What is wrong with the map or the robot file.
    pub mistake: Option<Mistake>,
}

impl Plans {
    /// Each with its scenario.
    fn scenarios(&self) -> Result<Vec<(u64, Scenario)>, TrialError> {
        let seeds = (0..u64::MAX).map(|n| self.first.wrapping_add(n));
        let plans = seeds.map(FloorPlan::new);
        let plans = plans.filter(|plan| self.kind.is_none_or(|kind| plan.kind == kind));
        let scenarios = plans.map(|plan| Ok((plan.seed, plan.scenario()?)));
        let Some(walls) = self.walls else {
            return scenarios.take(self.trials as usize).collect();
        };
        let fits = |plan: &Result<(u64, Scenario), TrialError>| {
            plan.as_ref().map_or(true, |(_, of)| of.floor.named_walls().len() <= walls)
        };
        let filled = scenarios.filter(fits).map(|plan| {
            let (seed, mut scenario) = plan?;
            scenario.floor = filled(&scenario.floor, seed, walls)?;
            Ok((seed, scenario))
        });
        filled.take(self.trials as usize).collect()
    }
}

impl Plans {
    /// What is computed of each plan with its seed, on all cores.
    ///
    /// # Errors
    /// Of the first plan that cannot be used.
    pub(crate) fn each<T: Send, E: From<TrialError> + Send>(
        &self,
        progress: &impl Progress,
        of: impl Fn(Scenario, u64) -> Result<T, E> + Sync + Send,
    ) -> Result<Vec<T>, E> {
        let one = |(seed, scenario)| {
            let result = of(scenario, seed);
            progress.finished();
            result
        };
        let scenarios = self.scenarios()?.into_par_iter();
        scenarios.filter(|_| !progress.is_interrupted()).map(one).collect()
    }
}

/// Distance between two plans in one map, metres: more than the largest plan and the longest range.
const APART: f64 = 60.0;

/// A floor with walls of other plans beside it, as many as make it `count`.
fn filled(floor: &Floor, seed: u64, count: usize) -> Result<Floor, TrialError> {
    let mut walls = floor.named_walls().to_vec();
    let mut east = 0.0;
    for n in 0..u64::MAX {
        if walls.len() >= count {
            break;
        }
        east += APART;
        let other = FloorPlan::new(seed.wrapping_add(BESIDE + n)).scenario()?;
        let shifted = other.floor.named_walls().iter().filter_map(|wall| {
            let [from, to] = [wall.from(), wall.to()].map(|[x, y]| [x + east, y]);
            NamedWall::new(format!("{} of {n}", wall.name()), from, to).ok()
        });
        walls.extend(shifted.take(count - walls.len()));
    }
    Ok(Floor::new(walls))
}

/// Trials in floor plans: the plan, the wheels and the place on the path of each come from its seed.
///
/// # Errors
/// [`TrialError`] of the first plan that cannot be used.
pub fn floor_plans(
    plans: &Plans,
    seconds: f64,
    progress: &impl Progress,
) -> Result<Vec<Trial>, TrialError> {
    plans.each(progress, |scenario, seed| {
        let Some(mistake) = plans.mistake else {
            return trial(scenario, seed, SetDown::Anywhere, seconds);
        };
        let map = mistake.map(&scenario.floor, seed)?;
        mistaken_trial(mistake.noisy(scenario), &map, mistake.wheels(), seed, seconds)
    })
}

/// Trials in one scenario.
///
/// # Errors
/// [`TrialError`], if its map cannot be used.
pub fn scenario(
    scenario: &Scenario,
    first: u64,
    trials: u32,
    seconds: f64,
    progress: &impl Progress,
) -> Result<Vec<Trial>, TrialError> {
    let seeds = (0..u64::from(trials)).into_par_iter().map(|n| first.wrapping_add(n));
    let one = |seed| {
        let trial = trial(scenario.clone(), seed, SetDown::Anywhere, seconds);
        progress.finished();
        trial
    };
    seeds.filter(|_| !progress.is_interrupted()).map(one).collect()
}

/// Shares and errors over many trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Summary {
    /// Trials.
    pub trials: usize,
    /// Share with a unique and right answer.
    pub unique_and_right: f64,
    /// The times of the unique answers.
    pub found: Quantiles,
    /// Share with the true pose in the bank at the end.
    pub in_bank: f64,
    /// Share with the true pose as the best hypothesis at the end.
    pub best_is_right: f64,
    /// Share with the true pose and all its images among the last answers, of the trials in a
    /// map with symmetry; `None` without such trials.
    pub with_all_twins: Option<f64>,
    /// Mean evaluations of a cycle.
    pub cycle: f64,
    /// The same by the walls of its map.
    pub cycle_a_wall: f64,
    /// Evaluations of the longest cycle of a trial, on average.
    pub longest_cycle: f64,
    /// The same by the walls of the map.
    pub longest_cycle_a_wall: f64,
    /// Mean time to a unique answer, seconds.
    pub mean_seconds: f64,
    /// 95th percentile of the position error of right unique answers, metres.
    pub position_error_95: f64,
    /// 95th percentile of their heading error, radians.
    pub heading_error_95: f64,
}

impl Summary {
    /// The summary of some trials.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 trials")]
    pub fn new(trials: &[Trial]) -> Self {
        let count = |is: &dyn Fn(&Trial) -> bool| trials.iter().filter(|t| is(t)).count() as f64;
        let share = |is: &dyn Fn(&Trial) -> bool| count(is) / trials.len() as f64;
        let is_unique = |trial: &Trial| trial.unique_after.is_some();
        let mean =
            |of: &dyn Fn(&Trial) -> f64| trials.iter().map(of).sum::<f64>() / trials.len() as f64;
        let evaluations = trials.iter().map(|trial| trial.evaluations as f64).sum::<f64>();
        let found: Vec<_> = trials.iter().map(|t| (t.unique_after, t.is_right)).collect();
        let right = || trials.iter().filter(|trial| trial.is_right);
        Self {
            trials: trials.len(),
            unique_and_right: share(&|trial| trial.is_right),
            found: Quantiles::new(&found),
            in_bank: share(&|trial| trial.rank.is_some()),
            best_is_right: share(&|trial| trial.rank == Some(0)),
            with_all_twins: trials.iter().any(|trial| trial.has_all_twins.is_some()).then(|| {
                count(&|trial| trial.has_all_twins == Some(true))
                    / count(&|trial| trial.has_all_twins.is_some())
            }),
            cycle: evaluations / trials.iter().map(|t| f64::from(t.cycles)).sum::<f64>(),
            cycle_a_wall: evaluations
                / trials.iter().map(|t| f64::from(t.cycles) * t.walls as f64).sum::<f64>(),
            longest_cycle: mean(&|trial| trial.longest_cycle as f64),
            longest_cycle_a_wall: mean(&|trial| trial.longest_cycle as f64 / trial.walls as f64),
            mean_seconds: trials.iter().filter_map(|trial| trial.unique_after).sum::<f64>()
                / count(&is_unique),
            position_error_95: percentile_95(right().map(|trial| trial.position_error).collect()),
            heading_error_95: percentile_95(right().map(|trial| trial.heading_error).collect()),
        }
    }
}

fn percentile_95(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() * 95 / 100).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plan keeps its walls, and those of other plans stand out of the sonar's range.
    #[test]
    fn a_map_is_filled_with_other_plans_beside_the_plan() -> Result<(), TrialError> {
        let plans = Plans { first: 43_000, trials: 3, kind: None, walls: Some(200), mistake: None };
        for (seed, scenario) in plans.scenarios()? {
            let own = FloorPlan::new(seed).scenario()?.floor;
            let (own, all) = (own.named_walls(), scenario.floor.named_walls());
            assert_eq!((all.len(), all.get(..own.len())), (200, Some(own)));
            let right = own.iter().flat_map(|wall| [wall.from()[0], wall.to()[0]]);
            let right = right.fold(f64::NEG_INFINITY, f64::max);
            for wall in all.iter().skip(own.len()) {
                assert!(wall.from()[0] > right + 4.0 && wall.to()[0] > right + 4.0, "{wall:?}");
            }
        }
        Ok(())
    }

    #[test]
    fn plans_with_more_walls_are_left_out() -> Result<(), TrialError> {
        let plans = Plans { first: 43_000, trials: 3, kind: None, walls: Some(30), mistake: None };
        for (seed, scenario) in plans.scenarios()? {
            assert!(FloorPlan::new(seed).scenario()?.floor.named_walls().len() <= 30);
            assert_eq!(scenario.floor.named_walls().len(), 30);
        }
        Ok(())
    }

    /// No cycle is longer than all together, and none begins before there are twelve pings, of which each takes 4,800 evaluations.
    #[test]
    fn the_longest_cycle_is_one_of_all() -> Result<(), TrialError> {
        let plans = Plans { first: 43_000, trials: 2, kind: None, walls: None, mistake: None };
        for trial in floor_plans(&plans, 10.0, &|| ())? {
            assert!(trial.cycles > 1 && trial.longest_cycle > 0, "{trial:?}");
            assert!(trial.longest_cycle < trial.evaluations, "{trial:?}");
            assert!(
                trial.longest_cycle * u64::from(trial.cycles) >= trial.evaluations,
                "{trial:?}"
            );
            assert!(trial.evaluations <= 2_640 * (152 - 11), "{trial:?}");
        }
        Ok(())
    }
}
