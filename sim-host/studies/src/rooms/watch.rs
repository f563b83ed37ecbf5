//! What a run in a room is judged by, tick by tick.

use sonarfix::health::Verdict;
use sonarfix_sim::angle;
use sonarfix_sim::mismatch::MismatchTimes;
use sonarfix_sim::trace::{FixRecord, Pose, Recorder, Tick};

/// A position error beyond this is wrong, and beyond [`FAR`] a failure, metres. Both count in the observable directions alone.
const WRONG: f64 = 0.1;
const FAR: f64 = 0.2;
/// A heading error beyond this is wrong, radians.
const WRONG_HEADING: f64 = 0.1;
/// A run with larger errors at its end is lost: metres, radians.
const LOST: f64 = 0.5;
const LOST_HEADING: f64 = 0.26;

/// For how long a mismatch of the robot file is named in a run that counts, seconds.
const NAMED: f64 = 10.0;

/// The direction in which a room has no wall that a range could measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unobservable {
    /// Every direction is observable.
    None,
    /// Along the x axis.
    X,
}

impl Unobservable {
    /// The length of the observable part of a vector, squared.
    fn observable(self, [x, y]: [f64; 2]) -> f64 {
        match self {
            Self::None => x * x + y * y,
            Self::X => y * y,
        }
    }
}

/// The judgement of a run.
#[derive(Debug)]
pub struct Watch {
    unobservable: Unobservable,
    ticks: u32,
    last_time: f64,
    /// Sums over the ticks of the squared position error in the observable directions and of its bound, m².
    squares: f64,
    bound_squares: f64,
    /// Seconds at a wrong pose with the verdict `Tracking`.
    wrong_tracking: f64,
    /// Seconds since the error is above [`FAR`] without the verdict `Lost`; the longest such time.
    unnoticed: f64,
    longest_unnoticed: f64,
    worst: f64,
    untracked: u32,
    verdict: Verdict,
    /// Whether the last tick has an error as of a lost robot.
    is_astray: bool,
    range_scale_deviation: f64,
    mismatches: MismatchTimes,
}

impl Watch {
    /// Before the first tick.
    pub fn new(unobservable: Unobservable) -> Self {
        Self {
            unobservable,
            ticks: 0,
            last_time: 0.0,
            squares: 0.0,
            bound_squares: 0.0,
            wrong_tracking: 0.0,
            unnoticed: 0.0,
            longest_unnoticed: 0.0,
            worst: 0.0,
            untracked: 0,
            verdict: Verdict::Tracking,
            is_astray: false,
            range_scale_deviation: f64::INFINITY,
            mismatches: MismatchTimes::default(),
        }
    }

    /// Mean square of the position error in the observable directions, m².
    pub fn mean_square(&self) -> f64 {
        self.squares / f64::from(self.ticks.max(1))
    }

    /// Mean square of the bound on it, m².
    pub fn mean_bound(&self) -> f64 {
        self.bound_squares / f64::from(self.ticks.max(1))
    }

    /// Seconds with an error above 10 cm in an observable direction, or 0.1 rad, and the verdict `Tracking`.
    pub fn wrong_tracking(&self) -> f64 {
        self.wrong_tracking
    }

    /// Whether an error was above 20 cm in an observable direction.
    pub fn went_far(&self) -> bool {
        self.worst > FAR
    }

    /// The longest time of such an error until it ended or the verdict became `Lost`, seconds.
    pub fn longest_unnoticed(&self) -> f64 {
        self.longest_unnoticed
    }

    /// Share of the time with another verdict than `Tracking`.
    pub fn share_untracked(&self) -> f64 {
        f64::from(self.untracked) / f64::from(self.ticks.max(1))
    }

    /// Whether the run ended with the verdict `Lost`, or an error above 0.5 m in an observable direction or 15°.
    pub fn is_lost(&self) -> bool {
        self.verdict == Verdict::Lost || self.is_astray
    }

    /// Standard deviation of the range scale at the end.
    pub fn range_scale_deviation(&self) -> f64 {
        self.range_scale_deviation
    }

    /// Whether each mismatch of the robot file was named for ten seconds, in the order of [`MismatchTimes::all`].
    pub fn has_named(&self) -> [bool; 3] {
        self.mismatches.all().map(|(_, seconds)| seconds > NAMED)
    }

    fn judge(&mut self, tick: &Tick, truth: Pose) {
        let (estimate, verdict) = (tick.estimate.pose, tick.estimate.verdict);
        let seconds = tick.time - self.last_time;
        let error = [estimate.x - truth.x, estimate.y - truth.y];
        let square = self.unobservable.observable(error);
        let off = square.sqrt();
        let turned = angle::wrap(estimate.heading - truth.heading).abs();
        let [x, y, ..] = tick.bound.unwrap_or_default();
        self.squares += square;
        self.bound_squares += self.unobservable.observable([x, y]);
        if verdict == Verdict::Tracking && (off > WRONG || turned > WRONG_HEADING) {
            self.wrong_tracking += seconds;
        }
        let is_unnoticed = off > FAR && verdict != Verdict::Lost;
        self.unnoticed = if is_unnoticed { self.unnoticed + seconds } else { 0.0 };
        self.longest_unnoticed = self.longest_unnoticed.max(self.unnoticed);
        self.worst = self.worst.max(off);
        self.untracked += u32::from(verdict != Verdict::Tracking);
        self.is_astray = off > LOST || turned > LOST_HEADING;
        let [.., range_scale] = tick.estimate.deviation;
        self.range_scale_deviation = range_scale;
        self.mismatches.add(seconds, tick.estimate.mismatch);
        (self.last_time, self.verdict) = (tick.time, verdict);
        self.ticks += 1;
    }
}

impl Recorder for Watch {
    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let tick = make();
        if let Some(truth) = tick.truth {
            self.judge(&tick, truth.pose);
        }
    }

    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_sim::trace::{Estimate, Truth};

    fn watched(unobservable: Unobservable, steps: &[([f64; 2], Verdict)]) -> Watch {
        let mut watch = Watch::new(unobservable);
        for (time, &([x, y], verdict)) in (1_u32..).zip(steps) {
            let truth = Truth { pose: Pose::default(), calibration: None, gyro_bias: None };
            let estimate =
                Estimate { pose: Pose { x, y, heading: 0.0 }, verdict, ..Estimate::default() };
            let (bound, odometry) = (Some([0.01; 7]), Pose::default());
            let time = f64::from(time);
            watch.tick(|| Tick { time, truth: Some(truth), estimate, bound, odometry });
        }
        watch
    }

    #[test]
    fn an_error_along_an_unobservable_direction_is_none() {
        use Verdict::Tracking;
        let steps = [([0.6, 0.01], Tracking), ([0.6, 0.15], Tracking)];
        let all = watched(Unobservable::None, &steps);
        assert!(all.went_far() && all.is_lost() && all.wrong_tracking() > 1.9);
        let across = watched(Unobservable::X, &steps);
        assert!(!across.went_far() && !across.is_lost());
        assert!((across.wrong_tracking() - 1.0).abs() < 1e-12);
        assert!((across.mean_square() - 0.5 * (1e-4 + 0.0225)).abs() < 1e-12);
        assert!((across.mean_bound() - 1e-4).abs() < 1e-12);
    }

    #[test]
    fn an_error_is_unnoticed_until_it_ends_or_the_verdict_is_lost() {
        use Verdict::{Degraded, Lost, Tracking};
        let far = [0.3, 0.0];
        let watch = watched(
            Unobservable::None,
            &[(far, Tracking), ([0.0; 2], Tracking), (far, Tracking), (far, Degraded), (far, Lost)],
        );
        assert!((watch.longest_unnoticed() - 2.0).abs() < 1e-12);
        assert!((watch.share_untracked() - 0.4).abs() < 1e-12 && watch.is_lost());
    }
}
