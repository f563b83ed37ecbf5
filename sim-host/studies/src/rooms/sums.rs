//! The sums of the runs of one cell.

use sonarfix_sim::statistics::RunResult;

use super::watch::Watch;

/// The sums of some runs.
#[derive(Debug, Clone, Default)]
pub struct Sums {
    /// Number of runs.
    pub runs: u32,
    /// NEES over the number of states of every run that is not lost.
    nees: Vec<f64>,
    nis: (f64, u64),
    /// Errors of the range scale in its deviations, of the runs that are not lost.
    range_scales: Vec<f64>,
    /// Mean squares of the observable position error, and of its bound, m².
    mean_square: f64,
    mean_bound: f64,
    /// Runs that are lost at the end.
    pub lost: u32,
    /// Runs in which the verdict became `Lost` at a right pose.
    pub falsely: u32,
    /// Runs with an error above 20 cm in an observable direction.
    pub far: u32,
    /// Seconds at a wrong pose with the verdict `Tracking`.
    wrong_tracking: f64,
    /// The longest time until such an error was noticed, seconds.
    pub longest_unnoticed: f64,
    untracked: f64,
    /// Runs in which each mismatch of the robot file is named, in the order of [`sonarfix_sim::mismatch::MismatchTimes::all`].
    pub named: [u32; 3],
    /// Sum of the shares of the time with the position inside the 99 % ellipse.
    inside: f64,
}

impl Sums {
    /// Those of one run.
    pub(super) fn of(result: &RunResult, watch: &Watch) -> Self {
        let states = f64::from(u32::try_from(result.estimated_states).unwrap_or(1));
        let is_lost = watch.is_lost();
        let unless_lost = |value: f64| if is_lost { Vec::new() } else { vec![value] };
        let [.., range_scale]: [f64; 7] = result.error.into();
        let range_scale = range_scale / watch.range_scale_deviation();
        Self {
            runs: 1,
            nees: unless_lost(result.nees / states),
            nis: result.nis.parts(),
            range_scales: unless_lost(range_scale),
            mean_square: watch.mean_square(),
            mean_bound: watch.mean_bound(),
            lost: is_lost.into(),
            falsely: u32::from(result.integrity.false_alarms() > 0),
            far: watch.went_far().into(),
            wrong_tracking: watch.wrong_tracking(),
            longest_unnoticed: watch.longest_unnoticed(),
            untracked: watch.share_untracked(),
            named: watch.has_named().map(u32::from),
            inside: result.integrity.share_within_99(),
        }
    }

    /// Both together.
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        self.nees.extend(&other.nees);
        self.range_scales.extend(&other.range_scales);
        let ([noise, wheels, mount], [more_noise, more_wheels, more_mount]) =
            (self.named, other.named);
        Self {
            runs: self.runs + other.runs,
            nis: (self.nis.0 + other.nis.0, self.nis.1 + other.nis.1),
            mean_square: self.mean_square + other.mean_square,
            mean_bound: self.mean_bound + other.mean_bound,
            lost: self.lost + other.lost,
            falsely: self.falsely + other.falsely,
            far: self.far + other.far,
            wrong_tracking: self.wrong_tracking + other.wrong_tracking,
            longest_unnoticed: self.longest_unnoticed.max(other.longest_unnoticed),
            untracked: self.untracked + other.untracked,
            named: [noise + more_noise, wheels + more_wheels, mount + more_mount],
            inside: self.inside + other.inside,
            ..self
        }
    }

    /// Mean NEES over its number of states, of the runs that are not lost; NaN without any.
    #[must_use]
    pub fn nees(&self) -> f64 {
        mean(&self.nees)
    }

    /// Mean normalised innovation squared.
    #[must_use]
    pub fn nis(&self) -> f64 {
        self.nis.0 / as_f64(self.nis.1)
    }

    /// Mean error of the range scale in its deviations.
    #[must_use]
    pub fn range_scale(&self) -> f64 {
        mean(&self.range_scales)
    }

    /// RMS of the position error in the observable directions, metres.
    #[must_use]
    pub fn rms(&self) -> f64 {
        (self.mean_square / f64::from(self.runs)).sqrt()
    }

    /// RMS of the bound on it, metres.
    #[must_use]
    pub fn bound(&self) -> f64 {
        (self.mean_bound / f64::from(self.runs)).sqrt()
    }

    /// Seconds of a run at a wrong pose with the verdict `Tracking`.
    #[must_use]
    pub fn wrong_tracking(&self) -> f64 {
        self.wrong_tracking / f64::from(self.runs)
    }

    /// Share of the time with another verdict than `Tracking`.
    #[must_use]
    pub fn untracked(&self) -> f64 {
        self.untracked / f64::from(self.runs)
    }

    /// Share of the time with the position inside the 99 % ellipse.
    #[must_use]
    pub fn inside(&self) -> f64 {
        self.inside / f64::from(self.runs)
    }

    /// Share of the runs.
    #[must_use]
    pub fn share(&self, count: u32) -> f64 {
        f64::from(count) / f64::from(self.runs)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / as_f64(values.len() as u64)
}

#[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
fn as_f64(count: u64) -> f64 {
    count as f64
}
