//! Errors of the estimate against the reference, its consistency, and the health verdicts.

use serde::Serialize;
use sonarfix::health::{Mismatch, Verdict};
use sonarfix_sim::angle;
use sonarfix_sim::mismatch::MismatchTimes;
use sonarfix_sim::trace::{Estimate, Pose};

use crate::median::Median;

/// Position error above which an estimate has diverged, metres.
const ASTRAY: f64 = 0.5;
/// The 99.73 % quantile of χ² with two degrees of freedom: "3σ" in the plane.
const THREE_SIGMA: f64 = 11.829;

/// Errors of positions and headings.
#[derive(Debug, Clone, Default)]
struct Errors {
    count: u64,
    position_squares: f64,
    position_median: Median,
    position_max: f64,
    heading_squares: f64,
    heading_median: Median,
    heading_max: f64,
}

impl Errors {
    fn add(&mut self, estimate: &Pose, truth: &Pose) {
        let position = (estimate.x - truth.x).hypot(estimate.y - truth.y);
        let heading = angle::wrap(estimate.heading - truth.heading).abs();
        self.count += 1;
        self.position_squares += position * position;
        self.position_median.add(position);
        self.position_max = self.position_max.max(position);
        self.heading_squares += heading * heading;
        self.heading_median.add(heading);
        self.heading_max = self.heading_max.max(heading);
    }

    fn figures(&self) -> Option<Figures> {
        #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
        let count = self.count as f64;
        Some(Figures {
            position_rms: (self.position_squares / count).sqrt(),
            position_median: self.position_median.value()?,
            position_max: self.position_max,
            heading_rms: (self.heading_squares / count).sqrt(),
            heading_median: self.heading_median.value()?,
            heading_max: self.heading_max,
        })
    }
}

/// Errors against the reference, metres and radians. Medians are within half a per cent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures {
    /// Root mean square.
    pub position_rms: f64,
    /// Median.
    pub position_median: f64,
    /// Maximum.
    pub position_max: f64,
    /// Root mean square.
    pub heading_rms: f64,
    /// Median.
    pub heading_median: f64,
    /// Maximum.
    pub heading_max: f64,
}

/// Compares the estimate with the reference.
#[derive(Debug, Clone, Default)]
pub struct Score {
    localizer: Errors,
    odometry: Errors,
    beyond_three_sigma: u64,
    beyond_three_sigma_at: Option<f64>,
    diverged_at: Option<f64>,
    first_loss: Option<Loss>,
    /// Since when the position has been wrong without the verdict `Lost`.
    wrong_since: Option<Loss>,
    longest_wrong: Option<Delay>,
    by_verdict: [Errors; 3],
    /// Time of the latest row, seconds since the start.
    latest: f64,
    /// Seconds with the position error within half a metre, and beyond it.
    within: ByVerdict,
    beyond: ByVerdict,
}

impl Score {
    /// Adds the estimate and the true pose at a time, in seconds since the start, and after a distance
    /// travelled, in metres.
    pub fn add(
        &mut self,
        (time, distance): (f64, f64),
        estimate: &Estimate,
        odometry: &Pose,
        truth: &Pose,
    ) {
        let verdict = estimate.verdict;
        self.localizer.add(&estimate.pose, truth);
        let [tracking, degraded, lost] = &mut self.by_verdict;
        match verdict {
            Verdict::Tracking => tracking,
            Verdict::Degraded => degraded,
            Verdict::Lost => lost,
        }
        .add(&estimate.pose, truth);
        self.odometry.add(odometry, truth);
        let error = [estimate.pose.x - truth.x, estimate.pose.y - truth.y];
        let seconds = time - self.latest;
        self.latest = time;
        let is_astray = error[0].hypot(error[1]) > ASTRAY;
        if is_astray || verdict == Verdict::Lost {
            self.first_loss.get_or_insert(Loss { time, distance });
        }
        if is_astray {
            self.diverged_at.get_or_insert(time);
            self.beyond.add(verdict, seconds);
        } else {
            self.within.add(verdict, seconds);
        }
        if is_astray && verdict != Verdict::Lost {
            let since = *self.wrong_since.get_or_insert(Loss { time, distance });
            self.note_wrong(since, time, distance);
        } else {
            self.wrong_since = None;
        }
        if distance_squared(estimate, error) > THREE_SIGMA {
            self.beyond_three_sigma += 1;
            self.beyond_three_sigma_at.get_or_insert(time);
        }
    }

    /// Takes the verdict between two rows: `Lost` ends the time in which a wrong position was not reported.
    pub fn note_verdict(&mut self, (time, distance): (f64, f64), verdict: Verdict) {
        if verdict == Verdict::Lost
            && let Some(since) = self.wrong_since.take()
        {
            self.note_wrong(since, time, distance);
        }
    }

    fn note_wrong(&mut self, since: Loss, time: f64, distance: f64) {
        let delay = Delay {
            since: since.time,
            seconds: time - since.time,
            distance: distance - since.distance,
        };
        if self.longest_wrong.is_none_or(|longest| longest.seconds < delay.seconds) {
            self.longest_wrong = Some(delay);
        }
    }

    /// How many rows of the reference were compared.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.localizer.count
    }

    /// Errors of the localizer.
    #[must_use]
    pub fn localizer(&self) -> Option<Figures> {
        self.localizer.figures()
    }

    /// Errors of dead reckoning.
    #[must_use]
    pub fn odometry(&self) -> Option<Figures> {
        self.odometry.figures()
    }

    fn errors(&self) -> FiguresByVerdict {
        let [tracking, degraded, lost] = self.by_verdict.each_ref().map(Errors::figures);
        FiguresByVerdict { tracking, degraded, lost }
    }

    /// Consistency of the errors with the covariance.
    #[must_use]
    pub fn consistency(&self) -> Consistency {
        #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
        let share = |count: u64| count as f64 / self.rows() as f64;
        let all = self.within.sum() + self.beyond.sum();
        Consistency {
            within_half_a_metre: self.within.over(all),
            beyond_half_a_metre: self.beyond.over(all),
            diverged_at: self.diverged_at,
            first_loss: self.first_loss,
            longest_wrong: self.longest_wrong,
            errors: self.errors(),
            beyond_three_sigma_at: self.beyond_three_sigma_at,
            beyond_three_sigma: (self.rows() > 0).then(|| share(self.beyond_three_sigma)),
        }
    }
}

/// When an estimate was first lost: half a metre off, or with the verdict `Lost`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Loss {
    /// Seconds since the start.
    pub time: f64,
    /// Distance travelled until then, metres.
    pub distance: f64,
}

/// How long, and how far, the position was wrong before the verdict was `Lost` or the position right again.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Delay {
    /// Seconds since the start at its first row of the reference.
    pub since: f64,
    /// Seconds that it lasted.
    pub seconds: f64,
    /// Distance travelled meanwhile, metres.
    pub distance: f64,
}

/// Errors at the rows of the reference by verdict; `None` where there was no such row.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct FiguresByVerdict {
    /// While `Tracking`.
    pub tracking: Option<Figures>,
    /// While `Degraded`.
    pub degraded: Option<Figures>,
    /// While `Lost`.
    pub lost: Option<Figures>,
}

/// Something by verdict.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ByVerdict {
    /// While `Tracking`.
    pub tracking: f64,
    /// While `Degraded`.
    pub degraded: f64,
    /// While `Lost`.
    pub lost: f64,
}

impl ByVerdict {
    fn add(&mut self, verdict: Verdict, amount: f64) {
        match verdict {
            Verdict::Tracking => self.tracking += amount,
            Verdict::Degraded => self.degraded += amount,
            Verdict::Lost => self.lost += amount,
        }
    }

    /// The sum over the verdicts.
    #[must_use]
    pub fn sum(&self) -> f64 {
        self.tracking + self.degraded + self.lost
    }

    fn over(&self, all: f64) -> Self {
        let share = |part: f64| if all > 0.0 { part / all } else { 0.0 };
        let Self { tracking, degraded, lost } = *self;
        Self { tracking: share(tracking), degraded: share(degraded), lost: share(lost) }
    }
}

/// Mahalanobis distance squared of a position error.
fn distance_squared(estimate: &Estimate, [ex, ey]: [f64; 2]) -> f64 {
    let [sx, sy, ..] = estimate.deviation;
    let (xx, yy, xy) = (sx * sx, sy * sy, estimate.covariance_xy);
    let determinant = xx * yy - xy * xy;
    (yy * ex * ex - 2.0 * xy * ex * ey + xx * ey * ey) / determinant
}

/// Consistency of the estimate; times in seconds since the start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Consistency {
    /// Share of the time with a position error of up to half a metre, by verdict. The time before a row
    /// of the reference counts as that row.
    pub within_half_a_metre: ByVerdict,
    /// Share of the time with a larger error.
    pub beyond_half_a_metre: ByVerdict,
    /// When the position error first exceeded half a metre.
    pub diverged_at: Option<f64>,
    /// When the estimate was first lost.
    pub first_loss: Option<Loss>,
    /// The longest time with the position error above half a metre without the verdict `Lost`; `None` if there was none.
    pub longest_wrong: Option<Delay>,
    /// Errors by verdict.
    pub errors: FiguresByVerdict,
    /// When the position error first left the 99.73 % ellipse.
    pub beyond_three_sigma_at: Option<f64>,
    /// Share of the reference rows at which it was outside; 0.0027 is expected.
    pub beyond_three_sigma: Option<f64>,
}

/// The health verdicts over time, seconds since the start.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Verdicts {
    /// When the verdict first was `Degraded`.
    pub degraded_at: Option<f64>,
    /// When the verdict first was `Lost`.
    pub lost_at: Option<f64>,
    /// Time with the verdict `Degraded`.
    pub degraded_seconds: f64,
    /// Time with the verdict `Lost`.
    pub lost_seconds: f64,
    /// Whether the verdict was `Lost` at the end.
    pub lost_at_end: bool,
    /// Time with each mismatch of the robot file named.
    pub mismatches: MismatchTimes,
    #[serde(skip)]
    mismatch: Option<Mismatch>,
    #[serde(skip)]
    until: f64,
}

impl Verdicts {
    /// Adds the mismatch from the latest time on.
    pub fn note_mismatch(&mut self, mismatch: Option<Mismatch>) {
        self.mismatch = mismatch;
    }

    /// Adds the verdict from a time on.
    pub fn note(&mut self, time: f64, before: Verdict, now: Verdict) {
        let lasted = time - self.until;
        self.until = time;
        self.mismatches.add(lasted, self.mismatch);
        match before {
            Verdict::Tracking => {}
            Verdict::Degraded => self.degraded_seconds += lasted,
            Verdict::Lost => self.lost_seconds += lasted,
        }
        match now {
            Verdict::Tracking => {}
            Verdict::Degraded => _ = self.degraded_at.get_or_insert(time),
            Verdict::Lost => _ = self.lost_at.get_or_insert(time),
        }
        self.lost_at_end = now == Verdict::Lost;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(x: f64, y: f64) -> Estimate {
        Estimate {
            pose: Pose { x, y, heading: 0.1 },
            deviation: [0.1, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
            covariance_xy: 0.01,
            ..Estimate::default()
        }
    }

    #[test]
    fn errors_are_summed_up() {
        let mut score = Score::default();
        assert_eq!(score.localizer(), None);
        let truth = Pose::default();
        score.add((1.0, 0.5), &estimate(0.3, 0.4), &truth, &truth);
        score.add((2.0, 1.0), &estimate(0.0, 0.1), &truth, &truth);
        let figures = score.localizer().unwrap();
        assert!((figures.position_rms - 0.13_f64.sqrt()).abs() < 1e-12);
        assert!((figures.position_max - 0.5).abs() < 1e-12);
        assert!((figures.position_median / 0.1 - 1.0).abs() < 0.0051);
        assert!((figures.heading_rms - 0.1).abs() < 1e-12);
        assert!(score.odometry().unwrap().position_rms < 1e-12);
    }

    #[test]
    fn an_error_is_measured_by_the_ellipse_of_the_estimate() {
        // det = 0.01·0.04 − 0.01² = 3e-4; e = (0.3, 0): 0.04·0.09/3e-4 = 12.
        assert!((distance_squared(&estimate(0.0, 0.0), [0.3, 0.0]) - 12.0).abs() < 1e-9);
        let mut score = Score::default();
        let truth = Pose::default();
        score.add((1.0, 0.5), &estimate(0.29, 0.0), &truth, &truth);
        score.add((2.0, 1.0), &estimate(0.3, 0.0), &truth, &truth);
        score.add((3.0, 1.5), &estimate(0.0, 0.6), &truth, &truth);
        let consistency = score.consistency();
        assert_eq!(consistency.beyond_three_sigma_at, Some(2.0));
        assert_eq!(consistency.diverged_at, Some(3.0));
        assert!((consistency.beyond_three_sigma.unwrap() - 2.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn errors_shares_and_the_first_loss_are_by_verdict() {
        let mut score = Score::default();
        let truth = Pose::default();
        let mut add = |time, distance, error, verdict| {
            let estimate = Estimate { verdict, ..estimate(error, 0.0) };
            score.add((time, distance), &estimate, &truth, &truth);
        };
        // Rows 1 s apart, of which the third to fifth are wrong: one without being reported.
        add(1.0, 0.25, 0.1, Verdict::Tracking);
        add(2.0, 0.5, 0.3, Verdict::Tracking);
        add(3.0, 0.75, 0.7, Verdict::Tracking);
        add(4.0, 1.0, 0.9, Verdict::Degraded);
        add(8.0, 2.0, 2.0, Verdict::Lost);
        add(10.0, 2.5, 0.4, Verdict::Lost);
        let found = score.consistency();
        let are_shares = |of: ByVerdict, expected: [f64; 3]| {
            let found = [of.tracking, of.degraded, of.lost];
            found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-12)
        };
        assert!(are_shares(found.within_half_a_metre, [0.2, 0.0, 0.2]));
        assert!(are_shares(found.beyond_half_a_metre, [0.1, 0.1, 0.4]));
        assert_eq!(found.first_loss, Some(Loss { time: 3.0, distance: 0.75 }));
        let rms = |figures: Option<Figures>| figures.unwrap().position_rms;
        assert!((rms(found.errors.tracking) - (0.59_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((rms(found.errors.degraded) - 0.9).abs() < 1e-12);
        assert!((found.errors.lost.unwrap().position_max - 2.0).abs() < 1e-12);
        let mut only_the_verdict = Score::default();
        let lost = Estimate { verdict: Verdict::Lost, ..estimate(0.1, 0.0) };
        only_the_verdict.add((5.0, 3.0), &lost, &truth, &truth);
        let found = only_the_verdict.consistency();
        assert_eq!(found.first_loss, Some(Loss { time: 5.0, distance: 3.0 }));
        assert_eq!((found.diverged_at, found.errors.tracking), (None, None));
    }

    /// Wrong from 2 s on, reported as lost at 6.5 s between two rows; wrong again for a second; the end of the log ends the
    /// last stretch.
    #[test]
    fn a_late_verdict_is_measured_in_seconds_and_metres() {
        let truth = Pose::default();
        let mut score = Score::default();
        let add = |score: &mut Score, time, error, verdict| {
            let estimate = Estimate { verdict, ..estimate(error, 0.0) };
            score.add((time, 0.25 * time), &estimate, &truth, &truth);
        };
        add(&mut score, 1.0, 0.1, Verdict::Tracking);
        assert_eq!(score.consistency().longest_wrong, None);
        add(&mut score, 2.0, 0.7, Verdict::Tracking);
        add(&mut score, 5.0, 2.0, Verdict::Degraded);
        score.note_verdict((5.5, 1.375), Verdict::Degraded);
        score.note_verdict((6.5, 1.625), Verdict::Lost);
        let late = Delay { since: 2.0, seconds: 4.5, distance: 1.125 };
        assert_eq!(score.consistency().longest_wrong, Some(late));
        add(&mut score, 7.0, 2.0, Verdict::Lost);
        add(&mut score, 8.0, 0.6, Verdict::Degraded);
        add(&mut score, 9.0, 0.6, Verdict::Degraded);
        add(&mut score, 10.0, 0.4, Verdict::Degraded);
        // The last row was right: the verdict ends nothing.
        score.note_verdict((40.0, 10.0), Verdict::Lost);
        assert_eq!(score.consistency().longest_wrong, Some(late));
        add(&mut score, 50.0, 0.6, Verdict::Degraded);
        add(&mut score, 60.0, 0.6, Verdict::Degraded);
        let late = Delay { since: 50.0, seconds: 10.0, distance: 2.5 };
        assert_eq!(score.consistency().longest_wrong, Some(late));
    }

    #[test]
    fn verdicts_are_timed() {
        use Verdict::{Degraded, Lost, Tracking};
        let mut verdicts = Verdicts::default();
        for (time, before, now) in [
            (1.0, Tracking, Tracking),
            (2.0, Tracking, Degraded),
            (4.0, Degraded, Lost),
            (5.0, Lost, Degraded),
            (9.0, Degraded, Tracking),
        ] {
            verdicts.note(time, before, now);
        }
        assert_eq!(verdicts.degraded_at, Some(2.0));
        assert_eq!(verdicts.lost_at, Some(4.0));
        assert!((verdicts.degraded_seconds - 6.0).abs() < 1e-12);
        assert!((verdicts.lost_seconds - 1.0).abs() < 1e-12);
        assert!(!verdicts.lost_at_end);
    }
}
