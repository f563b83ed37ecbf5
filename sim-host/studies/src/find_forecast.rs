//! The forecast of `sonarfix map check --starts` beside simulated searches in the same floor plans.
//!
//! The forecast has the map and the path that a board must leave free. It has neither the furniture that is not in the map, nor the
//! errors of the robot, nor the way that it drives. The searches are those of [`crate::search_study`].

use serde::Serialize;
use sonarfix_map::Scenario;
use sonarfix_plan::anywhere::{Anywhere, AnywhereError, Confusion, Landmarks, Settings, Times};
use sonarfix_plan::bare;
use sonarfix_plan::trial::{SetDown, Trial, TrialError, trial};
use sonarfix_sim::progress::Progress;

use crate::search_study::Plans;

/// A forecast is near the simulation if it differs by at most this share.
const NEAR: f64 = 0.3;
/// The share of starts from which on a map is one without an answer: then nine in ten have none.
const UNANSWERED: f64 = 0.1;

/// A floor plan, forecast and simulated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Its seed.
    pub seed: u64,
    /// Walls of the map.
    pub walls: usize,
    /// What was forecast.
    pub forecast: Times,
    /// What was simulated.
    pub simulated: Times,
    /// What the forecast says is confused, and in how many starts.
    pub confused: Vec<Confusion>,
    /// The proposed boards, with their forecast.
    pub landmarks: Option<Landmarks>,
    /// The same searches with these boards.
    pub with_boards: Option<Times>,
}

/// Why a plan cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A trial failed.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// The forecast failed.
    #[error(transparent)]
    Forecast(#[from] AnywhereError),
}

/// Which forecasts are compared with which searches.
#[derive(Debug, Clone, Copy)]
pub struct Comparison {
    /// The starts of each forecast; its seeds are the same in all plans.
    pub forecast: Settings,
    /// Searches in each plan, of at most as many seconds.
    pub trials: u32,
    /// Whether boards are proposed, and the searches repeated with them.
    pub boards: bool,
}

/// Compares forecasts with searches in each plan.
///
/// # Errors
/// [`CompareError`] of the first plan that cannot be used.
pub fn floor_plans(
    plans: &Plans,
    comparison: &Comparison,
    progress: &impl Progress,
) -> Result<Vec<Compared>, CompareError> {
    let compared = plans.each(progress, |scenario, seed| compared(&scenario, seed, comparison))?;
    Ok(compared.into_iter().flatten().collect())
}

fn compared(
    scenario: &Scenario,
    seed: u64,
    comparison: &Comparison,
) -> Result<Option<Compared>, CompareError> {
    let Comparison { forecast: settings, trials, boards } = comparison;
    let map = bare::scenario(scenario.floor.clone(), scenario.name.clone())
        .map_err(TrialError::Scenario)?;
    let Some(mut anywhere) = Anywhere::new(&map, settings, &|| ())? else { return Ok(None) };
    let Some(simulated) = simulated(scenario, seed, *trials, settings.seconds)? else {
        return Ok(None);
    };
    if *boards {
        let path = Some(scenario.path.plan());
        anywhere = anywhere.with_landmarks(&map, path, settings, &|| ())?;
    }
    let with_boards = anywhere.landmarks.as_ref().map(|landmarks| {
        let boards = landmarks.boards.iter();
        let floor = boards.fold(scenario.floor.clone(), |floor, board| board.on(&floor));
        let scenario = Scenario { floor, ..scenario.clone() };
        self::simulated(&scenario, seed, *trials, settings.seconds)
    });
    Ok(Some(Compared {
        seed,
        walls: scenario.floor.named_walls().len(),
        forecast: anywhere.times,
        simulated,
        confused: anywhere.confused,
        landmarks: anywhere.landmarks,
        with_boards: with_boards.transpose()?.flatten(),
    }))
}

/// The times of so many trials of a scenario.
fn simulated(
    scenario: &Scenario,
    first: u64,
    trials: u32,
    seconds: f64,
) -> Result<Option<Times>, TrialError> {
    let seeds = (first..).take(trials as usize);
    let trials = seeds.map(|seed| trial(scenario.clone(), seed, SetDown::Anywhere, seconds));
    let trials: Vec<Trial> = trials.collect::<Result<_, _>>()?;
    let right = trials.iter().filter(|trial| trial.is_right).filter_map(|trial| trial.unique_after);
    let wrong = trials.iter().filter(|t| t.unique_after.is_some() && !t.is_right).count();
    Ok(Times::of(right.collect(), wrong, trials.len(), seconds))
}

/// How well a forecast of a time agrees with the simulation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Agreement {
    /// The median over the plans of forecast and of simulation, seconds; a time that is not reached is the longest.
    pub forecast: f64,
    /// The same of the simulation.
    pub simulated: f64,
    /// Share of the plans whose forecast is within 30 % of the simulation.
    pub near: f64,
    /// Rank correlation over the plans (Spearman).
    pub rank_correlation: f64,
}

/// How well the forecasts of many plans agree with the simulation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Plans.
    pub plans: usize,
    /// Of the median time.
    pub median: Agreement,
    /// Of the time within which nine in ten have the answer.
    pub most: Agreement,
    /// Share of the starts without a right answer: forecast, simulated, and rank correlation.
    pub without: [f64; 3],
    /// Plans where a tenth of the starts or more are without a right answer: forecast, simulated, and in both.
    pub hard: [usize; 3],
    /// What the boards change; `None` without any.
    pub boards: Option<Boards>,
}

/// What the proposed boards change, over the plans that got some.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Boards {
    /// Plans with boards.
    pub plans: usize,
    /// Of the median time, seconds.
    pub median: Change,
    /// Of the time within which nine in ten have the answer, seconds.
    pub most: Change,
    /// Of the share without a right answer.
    pub without: Change,
    /// Plans in which fewer simulated searches are without a right answer, or as many and the median is sooner.
    pub better: usize,
}

/// Means over the plans, each as forecast and as simulated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Change {
    /// Without the boards.
    pub before: [f64; 2],
    /// With them.
    pub after: [f64; 2],
}

impl Summary {
    /// The summary of some plans.
    #[must_use]
    pub fn new(plans: &[Compared]) -> Self {
        let pairs = |of: fn(&Times) -> f64| -> Vec<(f64, f64)> {
            plans.iter().map(|plan| (of(&plan.forecast), of(&plan.simulated))).collect()
        };
        let without = pairs(without);
        let is_hard = |share: f64| share >= UNANSWERED - 1e-9;
        let count = |is: &dyn Fn(bool, bool) -> bool| {
            without.iter().filter(|(one, other)| is(is_hard(*one), is_hard(*other))).count()
        };
        Self {
            plans: plans.len(),
            median: Agreement::new(&pairs(median)),
            most: Agreement::new(&pairs(most)),
            without: [
                mean(without.iter().map(|(forecast, _)| *forecast)),
                mean(without.iter().map(|(_, simulated)| *simulated)),
                rank_correlation(&without),
            ],
            hard: [
                count(&|forecast, _| forecast),
                count(&|_, simulated| simulated),
                count(&|forecast, simulated| forecast && simulated),
            ],
            boards: Boards::new(plans),
        }
    }
}

impl Agreement {
    fn new(pairs: &[(f64, f64)]) -> Self {
        let near = pairs.iter().filter(|(forecast, of)| (forecast / of - 1.0).abs() <= NEAR);
        Self {
            forecast: middle(pairs.iter().map(|(forecast, _)| *forecast).collect()),
            simulated: middle(pairs.iter().map(|(_, simulated)| *simulated).collect()),
            near: share(near.count(), pairs.len()),
            rank_correlation: rank_correlation(pairs),
        }
    }
}

impl Boards {
    fn new(plans: &[Compared]) -> Option<Self> {
        let with: Vec<(&Compared, &Landmarks, &Times)> = plans
            .iter()
            .filter_map(|plan| Some((plan, plan.landmarks.as_ref()?, plan.with_boards.as_ref()?)))
            .collect();
        let change = |of: fn(&Times) -> f64| Change {
            before: [
                mean(with.iter().map(|(plan, ..)| of(&plan.forecast))),
                mean(with.iter().map(|(plan, ..)| of(&plan.simulated))),
            ],
            after: [
                mean(with.iter().map(|(_, board, _)| of(&board.times))),
                mean(with.iter().map(|(.., simulated)| of(simulated))),
            ],
        };
        let is_better = |(plan, _, after): &&(&Compared, &Landmarks, &Times)| {
            let before = &plan.simulated;
            without(after) < without(before)
                || (without(after) <= without(before) && median(after) < median(before))
        };
        (!with.is_empty()).then(|| Self {
            plans: with.len(),
            median: change(median),
            most: change(most),
            without: change(without),
            better: with.iter().filter(is_better).count(),
        })
    }
}

fn median(times: &Times) -> f64 {
    times.median_seconds.unwrap_or(times.seconds)
}

fn most(times: &Times) -> f64 {
    times.most_seconds.unwrap_or(times.seconds)
}

fn without(times: &Times) -> f64 {
    1.0 - times.right
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

#[expect(clippy::cast_precision_loss, reason = "some plans")]
fn share(part: usize, of: usize) -> f64 {
    part as f64 / of as f64
}

/// The correlation of the ranks of two quantities, equal ones with their mean rank.
fn rank_correlation(pairs: &[(f64, f64)]) -> f64 {
    let one = ranks(&pairs.iter().map(|(one, _)| *one).collect::<Vec<_>>());
    let other = ranks(&pairs.iter().map(|(_, other)| *other).collect::<Vec<_>>());
    let centred = |ranks: &[f64]| -> Vec<f64> {
        let mean = mean(ranks.iter().copied());
        ranks.iter().map(|rank| rank - mean).collect()
    };
    let (one, other) = (centred(&one), centred(&other));
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    product(&one, &other) / (product(&one, &one) * product(&other, &other)).sqrt()
}

/// The rank of each value, equal ones with their mean rank.
#[expect(clippy::cast_precision_loss, reason = "some plans")]
fn ranks(values: &[f64]) -> Vec<f64> {
    let rank = |value: &f64| {
        let below = values.iter().filter(|other| *other < value).count();
        let equal = values.iter().filter(|other| other.total_cmp(value).is_eq()).count();
        below as f64 + 0.5 * (equal as f64 - 1.0)
    };
    values.iter().map(rank).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rank_correlation_is_that_of_the_order() {
        let pairs = |values: &[(f64, f64)]| rank_correlation(values);
        assert!((pairs(&[(1.0, 10.0), (2.0, 100.0), (3.0, 1e9)]) - 1.0).abs() < 1e-12);
        assert!((pairs(&[(1.0, 3.0), (2.0, 2.0), (3.0, 1.0)]) + 1.0).abs() < 1e-12);
        // Two equal values have the rank between them.
        assert_eq!(ranks(&[5.0, 1.0, 5.0]), [1.5, 0.0, 1.5]);
    }
}
