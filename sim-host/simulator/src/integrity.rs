//! Integrity of a run: whether the error stays inside the filter's confidence ellipse, and if not,
//! whether the health verdict reports it.

use nalgebra::Matrix2;
use sonarfix::health::Verdict;

use crate::dense::Vector;

/// The 99.9 % quantile of χ² with two degrees of freedom.
const ELLIPSE: f64 = 13.8;
/// The 99 % quantile.
const ELLIPSE_99: f64 = 9.21;

/// A heading error up to this is tolerable, rad: half of the cone of the narrowest sonar of the
/// scenarios.
const HEADING: f64 = 0.1;

/// A position error beyond this is a failure that the verdict has to report, metres.
const POSITION: f64 = 0.1;

/// Errors up to these are those of a right pose, however sure the filter is of it: metres, radians (3°).
const RIGHT_POSITION: f64 = 0.05;
const RIGHT_HEADING: f64 = 0.052;

/// Integrity statistics of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Integrity {
    ticks: u32,
    outside: u32,
    within_99: u32,
    /// Current time outside the ellipse with the verdict `Tracking`, seconds.
    undetected: f64,
    longest_undetected: f64,
    /// Seconds.
    longest_blind: f64,
    worst: f64,
    holds: bool,
    /// Whether the pose of the last tick was right.
    was_right: bool,
    verdict: Verdict,
    degraded: u32,
    called_lost: u32,
    false_alarms: u32,
    /// Seconds.
    undetected_error: f64,
}

impl Integrity {
    /// Adds a time without odometry or without a used range, seconds, with the verdict at its end.
    pub fn add_blindness(&mut self, seconds: f64, verdict: Verdict) {
        if verdict == Verdict::Tracking {
            self.longest_blind = self.longest_blind.max(seconds);
        }
    }

    /// Adds the error and the covariance of x and y after a tick of a length in seconds.
    pub fn add(&mut self, seconds: f64, error: &Vector, p: &Matrix2<f64>, verdict: Verdict) {
        let squared = distance_squared(error, p);
        let is_inside = squared <= ELLIPSE;
        let off = libm::hypot(error[0], error[1]);
        self.ticks += 1;
        if verdict == Verdict::Tracking && off > POSITION {
            self.undetected_error += seconds;
        }
        self.outside += u32::from(!is_inside);
        self.within_99 += u32::from(squared <= ELLIPSE_99);
        let is_undetected = !is_inside && verdict == Verdict::Tracking;
        self.undetected = if is_undetected { self.undetected + seconds } else { 0.0 };
        self.longest_undetected = self.longest_undetected.max(self.undetected);
        self.worst = self.worst.max(off);
        self.degraded += u32::from(verdict == Verdict::Degraded);
        if verdict == Verdict::Lost && self.verdict != Verdict::Lost {
            self.called_lost += 1;
            // The verdict inflates the covariance, so that the pose before it is judged.
            self.false_alarms += u32::from(self.was_right);
        }
        self.was_right = is_right(off, error[2].abs(), is_inside);
        self.verdict = verdict;
        self.holds = is_inside && verdict != Verdict::Lost;
    }

    /// Share of the ticks with the position outside the 99.9 % ellipse.
    #[must_use]
    pub fn share_outside(&self) -> f64 {
        f64::from(self.outside) / f64::from(self.ticks.max(1))
    }

    /// Share of the ticks with the position inside the 99 % ellipse.
    #[must_use]
    pub fn share_within_99(&self) -> f64 {
        f64::from(self.within_99) / f64::from(self.ticks.max(1))
    }

    /// Time with a position error of more than 10 cm and the verdict `Tracking`, seconds.
    #[must_use]
    pub fn undetected_error(&self) -> f64 {
        self.undetected_error
    }

    /// Longest time outside the ellipse with the verdict `Tracking`, seconds.
    #[must_use]
    pub fn longest_undetected(&self) -> f64 {
        self.longest_undetected
    }

    /// Longest time without odometry or without a used range at whose end the verdict was `Tracking`, seconds.
    #[must_use]
    pub fn longest_blind(&self) -> f64 {
        self.longest_blind
    }

    /// Time up to the end of the run outside the ellipse with the verdict `Tracking`, seconds.
    #[must_use]
    pub fn undetected_at_end(&self) -> f64 {
        self.undetected
    }

    /// Share of the ticks with the verdict `Degraded`.
    #[must_use]
    pub fn share_degraded(&self) -> f64 {
        f64::from(self.degraded) / f64::from(self.ticks.max(1))
    }

    /// How often the verdict became `Lost`.
    #[must_use]
    pub fn called_lost(&self) -> u32 {
        self.called_lost
    }

    /// How often it became `Lost` although the pose of the tick before was right: within 5 cm and 3° of the truth, or inside
    /// the 99.9 % ellipse and within 10 cm and 0.1 rad.
    #[must_use]
    pub fn false_alarms(&self) -> u32 {
        self.false_alarms
    }

    /// The largest position error, metres.
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.worst
    }

    /// Whether at the last tick the error was inside the ellipse and the verdict was not `Lost`.
    #[must_use]
    pub fn holds_at_end(&self) -> bool {
        self.holds
    }
}

/// Whether a pose with these errors of position (metres) and heading (radians) is right.
fn is_right(off: f64, turned: f64, is_inside: bool) -> bool {
    let is_near = off <= RIGHT_POSITION && turned <= RIGHT_HEADING;
    is_near || is_inside && off <= POSITION && turned <= HEADING
}

/// Mahalanobis distance squared of x and y.
fn distance_squared(error: &Vector, p: &Matrix2<f64>) -> f64 {
    let determinant = p[(0, 0)] * p[(1, 1)] - p[(0, 1)] * p[(1, 0)];
    let (x, y) = (error[0], error[1]);
    (p[(1, 1)] * x * x - 2.0 * p[(0, 1)] * x * y + p[(0, 0)] * y * y) / determinant
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(steps: &[(f64, Verdict)]) -> Integrity {
        let p = Matrix2::new(4e-4, 0.0, 0.0, 1e-4);
        let mut integrity = Integrity::default();
        for &(x, verdict) in steps {
            let mut error = Vector::zeros();
            error[0] = x;
            integrity.add(0.5, &error, &p, verdict);
        }
        integrity
    }

    #[test]
    fn blindness_counts_while_the_verdict_is_tracking() {
        let mut integrity = Integrity::default();
        let times = [(2.0, Verdict::Tracking), (9.0, Verdict::Degraded), (1.0, Verdict::Tracking)];
        for (seconds, verdict) in times {
            integrity.add_blindness(seconds, verdict);
        }
        assert!((integrity.longest_blind() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn lost_at_a_right_pose_is_a_false_alarm() {
        use Verdict::{Degraded, Lost, Tracking};
        let integrity = taken(&[
            (0.01, Tracking),
            (0.20, Lost),
            (0.20, Lost),
            (0.20, Degraded),
            (0.01, Lost),
            (0.01, Degraded),
        ]);
        assert_eq!((integrity.called_lost(), integrity.false_alarms()), (2, 1));
        assert!((integrity.share_degraded() - 2.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn an_ellipse_that_reaches_far_does_not_make_a_wrong_pose_right() {
        let wide = Matrix2::identity();
        for (x, false_alarms) in [(0.09, 1), (0.11, 0)] {
            let mut error = Vector::zeros();
            error[0] = x;
            let mut integrity = Integrity::default();
            integrity.add(0.5, &error, &wide, Verdict::Degraded);
            integrity.add(0.5, &error, &wide, Verdict::Lost);
            assert_eq!(integrity.false_alarms(), false_alarms, "{x}");
        }
    }

    #[test]
    fn an_error_outside_counts_as_undetected_only_while_the_verdict_is_tracking() {
        use Verdict::{Degraded, Lost, Tracking};
        // The ellipse reaches √13.8 · 2 cm = 7.4 cm along x.
        let integrity = taken(&[
            (0.07, Tracking),
            (0.08, Tracking),
            (-0.09, Tracking),
            (0.20, Degraded),
            (0.08, Tracking),
            (0.08, Lost),
        ]);
        assert!((integrity.longest_undetected() - 1.0).abs() < 1e-12, "{integrity:?}");
        assert!((integrity.share_outside() - 5.0 / 6.0).abs() < 1e-12);
        assert!((integrity.worst() - 0.2).abs() < 1e-12);
        assert!(!integrity.holds_at_end() && integrity.undetected_at_end() == 0.0);
        assert!(taken(&[(0.08, Tracking)]).undetected_at_end() > 0.0);
        assert!(taken(&[(0.08, Lost), (0.01, Degraded)]).holds_at_end());
        assert!(!taken(&[(0.01, Lost)]).holds_at_end());
    }
}
