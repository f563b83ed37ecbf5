//! Whether the error stays inside what the filter claims, or health says otherwise.

use sonarfix::health::Verdict;

use crate::dense::{Matrix, Vector};

/// χ² of two degrees of freedom at 99.9 %.
const ELLIPSE: f64 = 13.8;

/// A heading off by no more than this still finds its walls, rad: half of the cone of the narrowest
/// sonar of the scenarios.
const HEADING: f64 = 0.1;

/// The books on a run's claims.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Claim {
    ticks: u32,
    outside: u32,
    /// Seconds for which the error has been outside and health silent.
    silence: f64,
    longest_silence: f64,
    worst: f64,
    holds: bool,
    verdict: Verdict,
    degraded: u32,
    called_lost: u32,
    falsely_lost: u32,
}

impl Claim {
    /// Takes the error and the covariance after a tick of so many seconds.
    pub fn add(&mut self, seconds: f64, error: &Vector, p: &Matrix, verdict: Verdict) {
        let is_inside = distance_squared(error, p) <= ELLIPSE;
        self.ticks += 1;
        self.outside += u32::from(!is_inside);
        let is_silent = !is_inside && verdict == Verdict::Tracking;
        self.silence = if is_silent { self.silence + seconds } else { 0.0 };
        self.longest_silence = self.longest_silence.max(self.silence);
        self.worst = self.worst.max(error[0].hypot(error[1]));
        self.degraded += u32::from(verdict == Verdict::Degraded);
        if verdict == Verdict::Lost && self.verdict != Verdict::Lost {
            self.called_lost += 1;
            self.falsely_lost += u32::from(is_inside && error[2].abs() <= HEADING);
        }
        self.verdict = verdict;
        self.holds = is_inside && verdict != Verdict::Lost;
    }

    /// Share of the ticks with the position outside the 99.9 % ellipse.
    #[must_use]
    pub fn share_outside(&self) -> f64 {
        f64::from(self.outside) / f64::from(self.ticks.max(1))
    }

    /// Longest time outside of it during which health said `Tracking`, seconds.
    #[must_use]
    pub fn longest_silence(&self) -> f64 {
        self.longest_silence
    }

    /// For how long, when the run ended, the error had been outside and health had said
    /// `Tracking`, seconds.
    #[must_use]
    pub fn silence_at_the_end(&self) -> f64 {
        self.silence
    }

    /// Share of the ticks that health called `Degraded`.
    #[must_use]
    pub fn share_degraded(&self) -> f64 {
        f64::from(self.degraded) / f64::from(self.ticks.max(1))
    }

    /// How often health has begun to say `Lost`.
    #[must_use]
    pub fn called_lost(&self) -> u32 {
        self.called_lost
    }

    /// How often it began to while the position was inside the 99.9 % ellipse and the heading off by
    /// no more than 0.1 rad.
    #[must_use]
    pub fn falsely_lost(&self) -> u32 {
        self.falsely_lost
    }

    /// The largest error of the position, metres.
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.worst
    }

    /// Whether at the last tick the error was inside, and health did not say `Lost`.
    #[must_use]
    pub fn holds_at_the_end(&self) -> bool {
        self.holds
    }
}

/// Mahalanobis distance squared of x and y.
fn distance_squared(error: &Vector, p: &Matrix) -> f64 {
    let determinant = p[(0, 0)] * p[(1, 1)] - p[(0, 1)] * p[(1, 0)];
    let (x, y) = (error[0], error[1]);
    (p[(1, 1)] * x * x - 2.0 * p[(0, 1)] * x * y + p[(0, 0)] * y * y) / determinant
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(steps: &[(f64, Verdict)]) -> Claim {
        let mut p = Matrix::zeros();
        p[(0, 0)] = 4e-4;
        p[(1, 1)] = 1e-4;
        let mut claim = Claim::default();
        for &(x, verdict) in steps {
            let mut error = Vector::zeros();
            error[0] = x;
            claim.add(0.5, &error, &p, verdict);
        }
        claim
    }

    #[test]
    fn lost_is_false_where_the_claim_holds() {
        use Verdict::{Degraded, Lost, Tracking};
        let claim = taken(&[
            (0.01, Tracking),
            (0.01, Lost),
            (0.20, Lost),
            (0.20, Degraded),
            (0.20, Lost),
            (0.01, Degraded),
        ]);
        assert_eq!((claim.called_lost(), claim.falsely_lost()), (2, 1));
        assert!((claim.share_degraded() - 2.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn an_error_outside_counts_as_silent_only_while_health_says_nothing() {
        use Verdict::{Degraded, Lost, Tracking};
        // The ellipse reaches √13.8 · 2 cm = 7.4 cm along x.
        let claim = taken(&[
            (0.07, Tracking),
            (0.08, Tracking),
            (-0.09, Tracking),
            (0.20, Degraded),
            (0.08, Tracking),
            (0.08, Lost),
        ]);
        assert!((claim.longest_silence() - 1.0).abs() < 1e-12, "{claim:?}");
        assert!((claim.share_outside() - 5.0 / 6.0).abs() < 1e-12);
        assert!((claim.worst() - 0.2).abs() < 1e-12);
        assert!(!claim.holds_at_the_end() && claim.silence_at_the_end() == 0.0);
        assert!(taken(&[(0.08, Tracking)]).silence_at_the_end() > 0.0);
        assert!(taken(&[(0.08, Lost), (0.01, Degraded)]).holds_at_the_end());
        assert!(!taken(&[(0.01, Lost)]).holds_at_the_end());
    }
}
