//! How good the estimate was, and what it said of itself.

use serde::Serialize;
use sonarfix::health::Verdict;

use crate::angle;
use crate::replay::median::Median;
use crate::trace::{Estimate, Pose};

/// Farther off than this, a robot is in another place than it thinks, metres.
const ASTRAY: f64 = 0.5;
/// χ² of two degrees of freedom that 99.73 % stay below: "3σ" in the plane.
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

/// Errors against the reference, metres and radians. A median is right to half a per cent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures {
    /// Root mean square.
    pub position_rms: f64,
    /// Median.
    pub position_median: f64,
    /// Worst.
    pub position_max: f64,
    /// Root mean square.
    pub heading_rms: f64,
    /// Median.
    pub heading_median: f64,
    /// Worst.
    pub heading_max: f64,
}

/// Keeps the score against the reference.
#[derive(Debug, Clone, Default)]
pub struct Score {
    localizer: Errors,
    odometry: Errors,
    beyond_three_sigma: u64,
    beyond_three_sigma_at: Option<f64>,
    astray_at: Option<f64>,
}

impl Score {
    /// Takes what was estimated at a time, and what was true.
    pub fn add(&mut self, time: f64, estimate: &Estimate, odometry: &Pose, truth: &Pose) {
        self.localizer.add(&estimate.pose, truth);
        self.odometry.add(odometry, truth);
        let error = [estimate.pose.x - truth.x, estimate.pose.y - truth.y];
        if error[0].hypot(error[1]) > ASTRAY {
            self.astray_at.get_or_insert(time);
        }
        if distance_squared(estimate, error) > THREE_SIGMA {
            self.beyond_three_sigma += 1;
            self.beyond_three_sigma_at.get_or_insert(time);
        }
    }

    /// How many rows of the reference were compared.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.localizer.count
    }

    /// Of the localizer.
    #[must_use]
    pub fn localizer(&self) -> Option<Figures> {
        self.localizer.figures()
    }

    /// Of the encoders alone.
    #[must_use]
    pub fn odometry(&self) -> Option<Figures> {
        self.odometry.figures()
    }

    /// What the localizer's own uncertainty was worth.
    #[must_use]
    pub fn honesty(&self) -> Honesty {
        #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
        let share = |count: u64| count as f64 / self.rows() as f64;
        Honesty {
            astray_at: self.astray_at,
            beyond_three_sigma_at: self.beyond_three_sigma_at,
            beyond_three_sigma: (self.rows() > 0).then(|| share(self.beyond_three_sigma)),
        }
    }
}

/// The squared distance of an error in the plane, in standard deviations of the estimate.
fn distance_squared(estimate: &Estimate, [ex, ey]: [f64; 2]) -> f64 {
    let [sx, sy, ..] = estimate.deviation;
    let (xx, yy, xy) = (sx * sx, sy * sy, estimate.covariance_xy);
    let determinant = xx * yy - xy * xy;
    (yy * ex * ex - 2.0 * xy * ex * ey + xx * ey * ey) / determinant
}

/// When the estimate was wrong, seconds since the start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Honesty {
    /// When it was first half a metre off.
    pub astray_at: Option<f64>,
    /// When its error first left the ellipse that 99.73 % stay within.
    pub beyond_three_sigma_at: Option<f64>,
    /// The share of the reference's rows at which it was outside; 0.0027 is to be expected.
    pub beyond_three_sigma: Option<f64>,
}

/// What the localizer said of itself over time, seconds since the start.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Verdicts {
    /// When it first said that it was degraded.
    pub degraded_at: Option<f64>,
    /// When it first said that it was lost.
    pub lost_at: Option<f64>,
    /// For how long it said that it was degraded.
    pub degraded_seconds: f64,
    /// For how long it said that it was lost.
    pub lost_seconds: f64,
    /// Whether it said so at the end.
    pub lost_at_end: bool,
    #[serde(skip)]
    until: f64,
}

impl Verdicts {
    /// Takes the verdict that holds from a time on.
    pub fn note(&mut self, time: f64, before: Verdict, now: Verdict) {
        let lasted = time - self.until;
        self.until = time;
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
        score.add(1.0, &estimate(0.3, 0.4), &truth, &truth);
        score.add(2.0, &estimate(0.0, 0.1), &truth, &truth);
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
        score.add(1.0, &estimate(0.29, 0.0), &truth, &truth);
        score.add(2.0, &estimate(0.3, 0.0), &truth, &truth);
        score.add(3.0, &estimate(0.0, 0.6), &truth, &truth);
        let honesty = score.honesty();
        assert_eq!(honesty.beyond_three_sigma_at, Some(2.0));
        assert_eq!(honesty.astray_at, Some(3.0));
        assert!((honesty.beyond_three_sigma.unwrap() - 2.0 / 3.0).abs() < 1e-12);
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
