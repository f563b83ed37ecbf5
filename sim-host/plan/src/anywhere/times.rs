//! Many starts: their simulation, their times and shares.

use rayon::prelude::*;
use serde::Serialize;
use sonarfix_sim::progress::Progress;

use super::settings::{AnywhereError, Settings};
use super::start::{Outcome, Place, Start};

/// Share of the starts without a right answer from which on a board is looked for.
const TOLERATED: f64 = 0.05;

/// Times and shares of many starts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Times {
    /// Longest time of driving, seconds.
    pub seconds: f64,
    /// Starts.
    pub starts: usize,
    /// Share with a unique and right answer.
    pub right: f64,
    /// Share with a unique and wrong answer.
    pub wrong: f64,
    /// Seconds within which half of the starts had the right answer; `None` if fewer had.
    pub median_seconds: Option<f64>,
    /// The same for nine in ten.
    pub most_seconds: Option<f64>,
}

impl Times {
    /// Those of starts; `None` without one.
    #[must_use]
    pub fn new(starts: &[Start], seconds: f64) -> Option<Self> {
        let right = starts.iter().filter(|start| start.outcome == Outcome::Right);
        let wrong = starts.iter().filter(|start| start.outcome == Outcome::Wrong).count();
        Self::of(right.filter_map(|start| start.after).collect(), wrong, starts.len(), seconds)
    }

    /// Those of so many starts, of which these were right after as many seconds.
    #[must_use]
    pub fn of(mut right: Vec<f64>, wrong: usize, starts: usize, seconds: f64) -> Option<Self> {
        if starts == 0 {
            return None;
        }
        right.sort_by(f64::total_cmp);
        let within = |tenths: usize| right.get((tenths * starts).div_ceil(10) - 1).copied();
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 starts")]
        let share = |part: usize| part as f64 / starts as f64;
        Some(Self {
            seconds,
            starts,
            right: share(right.len()),
            wrong: share(wrong),
            median_seconds: within(5),
            most_seconds: within(9),
        })
    }

    /// Whether so many starts have the right answer that no board is looked for.
    #[must_use]
    pub fn suffices(&self) -> bool {
        self.right >= 1.0 - TOLERATED
    }

    /// Share without a unique answer.
    #[must_use]
    pub fn unanswered(&self) -> f64 {
        1.0 - self.right - self.wrong
    }
}

/// The starts of these seeds, in their order; fewer if it was interrupted.
pub(super) fn simulate(
    place: &Place<'_>,
    seeds: &[u64],
    settings: &Settings,
    progress: &impl Progress,
) -> Result<Vec<Start>, AnywhereError> {
    let seeds = seeds.par_iter().filter(|_| !progress.is_interrupted());
    let one = |seed: &u64| {
        let start = place.start(*seed, settings)?;
        progress.finished();
        Ok(start)
    };
    seeds.map(one).collect()
}
