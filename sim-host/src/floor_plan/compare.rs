//! The nearest wall or the most informative one: the same plans, the same wheels, the same chance.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sonarfix::aim::Policy;
use sonarfix_map::FileError;

use super::FloorPlan;
use crate::monte_carlo;
use crate::simulate::{Simulation, SimulationError};
use crate::statistics::RunResult;

/// How often a sample is drawn again for an interval.
const RESAMPLES: usize = 2_000;
/// Of the interval's resamples, how many lie below it, and above.
const TAIL: f64 = 0.025;

/// What is kept of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Mean square of the position error along the way, m².
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
    /// The nearest wall.
    pub nearest: Score,
    /// The most informative one.
    pub informative: Score,
}

/// What became of one plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanResult {
    /// The plan.
    pub plan: FloorPlan,
    /// How many walls its map has.
    pub walls: usize,
    /// How long its way is, metres.
    pub length: f64,
    /// Its runs, in the order of their seeds.
    pub pairs: Vec<Pair>,
}

/// A number with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The number.
    pub value: f64,
    /// Where the interval begins.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
}

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A plan cannot be read.
    #[error(transparent)]
    Plan(#[from] FileError),
    /// A run could not go on.
    #[error("floor plan {seed}: {source}")]
    Run {
        /// The plan's seed.
        seed: u64,
        /// What went wrong.
        source: SimulationError,
    },
}

/// Runs the plans with the seeds from `first`, each `runs` times under either policy, with the
/// seeds from 0.
///
/// # Errors
/// [`CompareError`], of the first plan that could not be run.
pub fn run(first: u64, plans: u32, runs: u32) -> Result<Vec<PlanResult>, CompareError> {
    let bar = monte_carlo::progress_bar(plans.saturating_mul(runs).saturating_mul(2));
    let seeds = (0..u64::from(plans)).into_par_iter();
    let results = seeds
        .map(|plan| run_plan(first.wrapping_add(plan), runs, &|| bar.inc(2)))
        .collect::<Result<Vec<_>, _>>();
    bar.finish_and_clear();
    results
}

/// The plan of a seed, ready to run under a policy.
///
/// # Errors
/// [`FileError`], if the plan were not one that can be driven.
pub fn simulation(plan: &FloorPlan, policy: Policy) -> Result<Simulation, FileError> {
    let mut scenario = plan.scenario()?;
    scenario.robot.config.policy = policy;
    Ok(Simulation::new(scenario))
}

fn run_plan(seed: u64, runs: u32, done: &(dyn Fn() + Sync)) -> Result<PlanResult, CompareError> {
    let plan = FloorPlan::new(seed);
    let nearest = simulation(&plan, Policy::Nearest)?;
    let informative = simulation(&plan, Policy::Informative)?;
    let score = |simulation: &Simulation, run| {
        let result = simulation.run(run, &mut ());
        result.map(|r| Score::of(&r)).map_err(|source| CompareError::Run { seed, source })
    };
    let pair = |run| {
        let pair = Pair { nearest: score(&nearest, run)?, informative: score(&informative, run)? };
        done();
        Ok::<_, CompareError>(pair)
    };
    let pairs = (0..u64::from(runs)).into_par_iter().map(pair).collect::<Result<_, _>>()?;
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

    /// Position RMS, informative over nearest, with its interval over the runs.
    #[must_use]
    pub fn ratio(&self) -> Interval {
        let mut rng = ChaCha8Rng::seed_from_u64(self.plan.seed);
        bootstrap(&self.pairs, ratio, &mut rng)
    }

    /// How many runs ended lost.
    #[must_use]
    pub fn lost(&self, of: fn(&Pair) -> Score) -> usize {
        self.pairs.iter().filter(|pair| of(pair).lost).count()
    }
}

/// The nearest's score of a pair.
#[must_use]
pub fn nearest(pair: &Pair) -> Score {
    pair.nearest
}

/// The informative's score of a pair.
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

/// A quantile, between the two values that are next to it.
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
