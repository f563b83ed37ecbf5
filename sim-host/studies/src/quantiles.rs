//! The times within which shares of many searches have their answer.

use serde::Serialize;

/// The time within which a share of the trials is found right; `None` if fewer are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// 50 %, seconds.
    pub half: Option<f64>,
    /// 80 %.
    pub four_fifths: Option<f64>,
    /// 95 %.
    pub nineteen_twentieths: Option<f64>,
    /// Share of the trials in which a wrong pose is found.
    pub wrong: f64,
}

impl Quantiles {
    /// Of the times of `trials`, and whether what is found then is right.
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 trials")]
    pub(crate) fn new(trials: &[(Option<f64>, bool)]) -> Self {
        let mut right: Vec<f64> =
            trials.iter().filter(|trial| trial.1).filter_map(|trial| trial.0).collect();
        right.sort_by(f64::total_cmp);
        let within = |percent: usize| right.get(trials.len() * percent / 100).copied();
        let wrong = trials.iter().filter(|trial| trial.0.is_some() && !trial.1).count();
        Self {
            half: within(50),
            four_fifths: within(80),
            nineteen_twentieths: within(95),
            wrong: wrong as f64 / trials.len() as f64,
        }
    }
}
