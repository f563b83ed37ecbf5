//! Comparison of the policies nearest and informative on the same plans with the same random streams.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sonarfix::aim::Policy;
use sonarfix_map::FileError;
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::{Simulation, SimulationError};
use sonarfix_sim::statistics::RunResult;

use super::FloorPlan;

/// Number of bootstrap resamples.
const RESAMPLES: usize = 2_000;
/// Share of the resamples below the interval, and above.
const TAIL: f64 = 0.025;

/// The score of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Mean square of the position error along the path, m².
    pub mean_square: f64,
    /// Whether the robot was lost at the end.
    pub lost: bool,
}

impl Score {
    fn of(result: &RunResult) -> Self {
        Self { mean_square: result.path.position_mean_square(), lost: result.lost }
    }
}

/// A run with the same seed under either policy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Policy nearest.
    pub nearest: Score,
    /// Policy informative.
    pub informative: Score,
}

/// The results of one plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanResult {
    /// The plan.
    pub plan: FloorPlan,
    /// Number of walls in its map.
    pub walls: usize,
    /// Length of its path, metres.
    pub length: f64,
    /// Its runs, in the order of their seeds.
    pub pairs: Vec<Pair>,
}

/// A value with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The value.
    pub value: f64,
    /// Start of the interval.
    pub from: f64,
    /// End of the interval.
    pub to: f64,
}

/// Why the comparison failed.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A plan is invalid.
    #[error(transparent)]
    Plan(#[from] FileError),
    /// A run failed.
    #[error("floor plan {seed}: {source}")]
    Run {
        /// The plan's seed.
        seed: u64,
        /// The cause.
        source: SimulationError,
    },
}

/// Runs the plans with the seeds from `first`, each `runs` times under either policy, with the
/// seeds from 0, and reports every pair of runs. After an interruption, plans without a finished pair are missing. A plan that fails does not end the others:
/// its error is returned beside their results.
pub fn run(
    first: u64,
    plans: u32,
    runs: u32,
    progress: &impl Progress,
) -> (Vec<PlanResult>, Vec<CompareError>) {
    let seeds = (0..u64::from(plans)).into_par_iter().filter(|_| !progress.is_interrupted());
    divide(seeds.map(|plan| run_plan(first.wrapping_add(plan), runs, progress)).collect())
}

/// The plans with a finished pair, and the errors of the others.
fn divide(results: Vec<Result<PlanResult, CompareError>>) -> (Vec<PlanResult>, Vec<CompareError>) {
    let (mut plans, mut errors) = (Vec::new(), Vec::new());
    for result in results {
        match result {
            Ok(plan) if plan.pairs.is_empty() => {}
            Ok(plan) => plans.push(plan),
            Err(error) => errors.push(error),
        }
    }
    (plans, errors)
}

/// A plan, prepared to be run under a policy.
///
/// # Errors
/// [`FileError`], if the scenario is invalid.
pub fn simulation(plan: &FloorPlan, policy: Policy) -> Result<Simulation, FileError> {
    let mut scenario = plan.scenario()?;
    scenario.robot.localizer.policy = policy;
    Ok(Simulation::new(scenario))
}

fn run_plan(seed: u64, runs: u32, progress: &impl Progress) -> Result<PlanResult, CompareError> {
    let plan = FloorPlan::new(seed);
    let nearest = simulation(&plan, Policy::Nearest)?;
    let informative = simulation(&plan, Policy::Informative)?;
    let score = |simulation: &Simulation, run| {
        let result = simulation.run(run, &mut ());
        result.map(|r| Score::of(&r)).map_err(|source| CompareError::Run { seed, source })
    };
    let pair = |run| {
        let pair = Pair { nearest: score(&nearest, run)?, informative: score(&informative, run)? };
        progress.finished();
        Ok::<_, CompareError>(pair)
    };
    let seeds = (0..u64::from(runs)).into_par_iter().filter(|_| !progress.is_interrupted());
    let pairs = seeds.map(pair).collect::<Result<_, _>>()?;
    let scenario = &nearest.scenario;
    Ok(PlanResult {
        walls: scenario.floor.named_walls().len(),
        length: scenario.path.length(),
        plan,
        pairs,
    })
}

impl PlanResult {
    /// Position RMS over all runs, metres.
    #[must_use]
    pub fn rms(&self, of: fn(&Pair) -> Score) -> f64 {
        rms(self.pairs.iter().map(of))
    }

    /// Ratio of the position RMS, informative to nearest, with its interval over the runs.
    #[must_use]
    pub fn ratio(&self) -> Interval {
        let mut rng = ChaCha8Rng::seed_from_u64(self.plan.seed);
        bootstrap(&self.pairs, ratio, &mut rng)
    }

    /// Number of runs that ended lost.
    #[must_use]
    pub fn lost(&self, of: fn(&Pair) -> Score) -> usize {
        self.pairs.iter().filter(|pair| of(pair).lost).count()
    }
}

/// The score of the policy nearest.
#[must_use]
pub fn nearest(pair: &Pair) -> Score {
    pair.nearest
}

/// The score of the policy informative.
#[must_use]
pub fn informative(pair: &Pair) -> Score {
    pair.informative
}

/// The median of the plans' ratios, with its interval over the plans.
#[must_use]
pub fn median_ratio(results: &[PlanResult]) -> Interval {
    let ratios: Vec<f64> = results.iter().map(|result| ratio(&result.pairs)).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    bootstrap(&ratios, |ratios| quantile(ratios.to_vec(), 0.5), &mut rng)
}

fn ratio(pairs: &[Pair]) -> f64 {
    rms(pairs.iter().map(informative)) / rms(pairs.iter().map(nearest))
}

fn rms(scores: impl ExactSizeIterator<Item = Score>) -> f64 {
    let count = as_f64(scores.len());
    (scores.map(|score| score.mean_square).sum::<f64>() / count).sqrt()
}

/// The 95 % percentile interval of a statistic (Efron, 1979).
fn bootstrap<T: Copy>(
    sample: &[T],
    statistic: impl Fn(&[T]) -> f64,
    rng: &mut ChaCha8Rng,
) -> Interval {
    let mut again = || -> f64 {
        let draw = |_| sample.get(rng.random_range(0..sample.len())).copied();
        statistic(&sample.iter().filter_map(draw).collect::<Vec<_>>())
    };
    let values: Vec<f64> = (0..RESAMPLES).map(|_| again()).collect();
    Interval {
        value: statistic(sample),
        from: quantile(values.clone(), TAIL),
        to: quantile(values, 1.0 - TAIL),
    }
}

/// A quantile, linearly interpolated.
#[must_use]
pub fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = share * as_f64(values.len().saturating_sub(1));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
    let below = place as usize;
    let at = |index: usize| values.get(index).or(values.last()).copied().unwrap_or(f64::NAN);
    at(below) + (place - as_f64(below)) * (at(below + 1) - at(below))
}

#[expect(clippy::cast_precision_loss, reason = "some thousand")]
fn as_f64(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_that_fails_does_not_end_the_others() {
        let score = Score { mean_square: 1.0, lost: false };
        let pair = Pair { nearest: score, informative: score };
        let plan = |seed, pairs: &[Pair]| PlanResult {
            plan: FloorPlan::new(seed),
            walls: 4,
            length: 1.0,
            pairs: pairs.to_vec(),
        };
        let failed = CompareError::Run { seed: 4, source: SimulationError::NoPose };
        let results =
            vec![Ok(plan(1, &[pair])), Err(failed), Ok(plan(2, &[])), Ok(plan(3, &[pair]))];
        let (plans, errors) = divide(results);
        let seeds: Vec<u64> = plans.iter().map(|result| result.plan.seed).collect();
        assert_eq!((seeds, errors.len()), (vec![1, 3], 1));
    }
}
