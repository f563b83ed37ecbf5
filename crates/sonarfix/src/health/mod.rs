//! Verdict on the estimate, from the measurement outcomes over time.
//!
//! The covariance is the filter's own uncertainty; it does not show that the filter is wrong. The
//! measurements do. The evidence of each ping is the logarithm of its likelihood at a wrong pose over
//! that at the estimated one, by the [echo model](crate::association::echo). A ping that agrees counts at most −1.2,
//! because a wrong pose that is displaced along a wall agrees as well (three of ten pings); it counts down to −4.6 if the last one that
//! agreed was in another direction, since both agree by chance with a wrong pose as seldom as the deviation of the range is small. One
//! that contradicts counts between 1 and 4, less or nothing if the wall is already known to be occluded: the occluding object returns its echo at
//! a wrong pose as well, so that such a ping is no evidence for the pose either. That knowledge fades with the distance
//! along the wall and with time, so that a wall that contradicts everywhere counts again.
//!
//! This is Page's cumulative sum test, eq. (23) of `docs/model.md`. The sum, never below 0, decides:
//!
//! ```text
//!              2.5, or 8 pings in a row without an    8.5, or 30 pings not
//!              accepted range, or mean NIS above 2,   accepted while uncertain,
//!              or too far without a fix, or uncertain less those accepted
//!   Tracking ────────────────────────────▶ Degraded ──────────────────────▶ Lost
//!      ▲                                    │   ▲                             │
//!      └── below 0.5, 3 accepted in a   ────┘   └── below 0.5, 3 accepted in a row
//!          row, none of the others,
//!          at most one inflation
//! ```
//!
//! - *Mean NIS*: mean of ν²/S over the accepted ranges, with a weight of 1/100 for the latest. 1 if the
//!   filter is consistent, less if its noise is set too large. Above 2 each range passes the gate, but
//!   together they are too far off ([`Mismatch::NoiseTooSmall`]).
//! - *Too far without a fix*: travelled farther than
//!   [`max_distance_without_fix`](GatingParameters::max_distance_without_fix) since the last range
//!   used. The uncertainty of a parked robot does not grow.
//! - *Uncertain*: the deviation of the position in its worst direction exceeds
//!   [`max_position_deviation`](GatingParameters::max_position_deviation), or that of the heading a
//!   quarter of the cone.
//! - *Uncertain* for `Lost`: a deviation of the position above 15 cm, or of the heading above half of the cone, at which no wall can be
//!   measured. Such an estimate accepts what fits by chance, and the evidence of its pings is small. What tells is how many of them are
//!   accepted.
//!
//! A path through a wall makes the verdict `Lost` (eq. 59).
//!
//! Whatever the outcomes, the verdict is not `Tracking` after [`DEGRADED_WITHOUT_FIX`] without a used
//! range or [`DEGRADED_WITHOUT_ODOMETRY`] without odometry, and `Lost` after
//! [`LOST_WITHOUT_ODOMETRY`].
//!
//! # Non-finite policy
//! The evidence consists of constants and stays between 0 and [`LOST_AT`]. The mean NIS consists of
//! finite values, each limited to [`MOST_NIS`]. Counts saturate.

mod mismatch;

use crate::association::outcome::{AbsoluteFix, Fix};
use crate::config::GatingParameters;
use crate::filter::ekf::PoseUncertainty;
use crate::geometry::numeric::{at_least, between};
use crate::geometry::units::{Duration, Metres, Radians};

pub use self::mismatch::Mismatch;

/// Verdict on the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Verdict {
    /// Ranges arrive and agree with the map.
    #[default]
    Tracking,
    /// Ranges are missing or begin to disagree: the estimate depends on the encoders.
    Degraded,
    /// Ranges keep disagreeing, too few agree with an uncertain pose, or the path has led through a wall: the pose is probably wrong.
    Lost,
}

/// Evidence at which the verdict is no longer [`Verdict::Tracking`]: two or three pings that contradict
/// the pose.
const DEGRADED_AT: f32 = 2.5;
/// The evidence at which the verdict is [`Verdict::Lost`], and the maximum. A compromise between kidnapped robots, which are to be
/// found out within few pings (`docs/health.md`), and right poses in generated rooms, which are not to be called lost
/// (`docs/rooms.md`); chosen on rooms with the seeds 1000 to 1059.
pub const LOST_AT: f32 = 8.5;
/// The evidence below which the verdict can improve.
const BETTER_BELOW: f32 = 0.5;

/// Inflations of the covariance up to which the verdict can become [`Verdict::Tracking`] again. After
/// more of them the filter may have converged to another place at which the ranges agree; only a new
/// start can confirm the pose.
const MAX_CONFIRMABLE_INFLATIONS: u16 = 1;
/// [`Health::unaided`] at which the verdict is [`Verdict::Lost`].
const LOST_AFTER_UNAIDED: u16 = 30;
/// Standard deviation of the position beyond which a ping that is not accepted counts: more than what furniture and a few missing walls
/// lead to. Chosen with the number above on one recording (freiburg-079) and generated rooms with the seeds 210000 to 210023.
const UNAIDED_BEYOND: Metres = Metres(0.15);

/// Pings in a row without an accepted range, for whatever reason: the estimate then depends on the encoders.
const DEGRADED_AFTER_UNUSED: u16 = 8;
/// Accepted ranges in a row that improve the verdict by one step.
const BETTER_AFTER: u16 = 3;

/// Weight of the latest range in the mean NIS, a memory of about a hundred ranges: its deviation is 0.1 if the filter is consistent.
const LATEST_NIS: f32 = 0.01;
/// The mean NIS above which the noise of the robot file is too small: in simulated rooms without objects right files stay below, and those
/// with a third of the noise of the wheels exceed it (`docs/rooms.md`). Chosen on rooms with the seeds 40000 to 40009.
pub const DEGRADED_NIS: f32 = 2.0;
/// Limit of one range in the mean NIS, so that a single one does not decide.
pub const MOST_NIS: f32 = 25.0;

/// Time without odometry after which the verdict is not [`Verdict::Tracking`].
pub const DEGRADED_WITHOUT_ODOMETRY: Duration = Duration::from_ticks(500_000);
/// Time without odometry after which it is [`Verdict::Lost`]: at 0.5 m/s the robot may be 1.5 m away.
pub const LOST_WITHOUT_ODOMETRY: Duration = Duration::from_ticks(3_000_000);
/// Time without a used range after which the verdict is not [`Verdict::Tracking`], whatever the reason.
pub const DEGRADED_WITHOUT_FIX: Duration = Duration::from_ticks(60_000_000);

/// The numbers behind the verdict.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Health {
    /// The verdict.
    pub verdict: Verdict,
    /// The evidence against the pose, from 0 to [`LOST_AT`].
    pub evidence: f32,
    /// Mean of ν²/S over the latest ranges used; 1 at the start.
    pub nis: f32,
    /// Ranges used since the last one that was not, or since the verdict improved.
    pub accepted_in_a_row: u16,
    /// Ranges gated or downweighted since the last one accepted; pings without a range do not interrupt
    /// the count, and the repeated echo of one object counts once (`docs/model.md`, eq. 26).
    pub gated_in_a_row: u16,
    /// Pings without a usable range since the last one used or gated.
    pub silent_in_a_row: u16,
    /// Pings that were not accepted while the pose was uncertain, less those that were accepted: from 0 to 30, at which the verdict is
    /// [`Verdict::Lost`]. Not part of a serialized health.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub unaided: u16,
    /// Inflations of the covariance of a lost robot ([`GatingParameters::inflation`]) since the verdict
    /// was last [`Verdict::Tracking`].
    pub inflations: u16,
    /// Distance travelled since the last range used.
    pub rolled_since_fix: Metres,
    /// Time since the last range used.
    pub time_since_fix: Duration,
    /// Standard deviation of the position in the direction in which it is largest, after the last
    /// ping.
    pub position_deviation: Metres,
    /// Standard deviation of the heading after the last ping.
    pub heading_deviation: Radians,
}

impl Default for Health {
    fn default() -> Self {
        Self {
            verdict: Verdict::Tracking,
            evidence: 0.0,
            nis: 1.0,
            accepted_in_a_row: 0,
            gated_in_a_row: 0,
            silent_in_a_row: 0,
            unaided: 0,
            inflations: 0,
            rolled_since_fix: Metres(0.0),
            time_since_fix: Duration::from_ticks(0),
            position_deviation: Metres(0.0),
            heading_deviation: Radians(0.0),
        }
    }
}

/// Limits beyond which the verdict is not [`Verdict::Tracking`], whatever the outcomes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    /// [`GatingParameters::max_distance_without_fix`].
    distance: Metres,
    /// [`GatingParameters::max_position_deviation`].
    position: Metres,
    /// Of the deviation of the heading.
    heading: Radians,
}

impl Limits {
    pub fn new(parameters: &GatingParameters, heading: Radians) -> Self {
        Self {
            distance: parameters.max_distance_without_fix,
            position: parameters.max_position_deviation,
            heading,
        }
    }
}

impl Health {
    /// The health of a localizer whose pose is unknown.
    pub(crate) fn lost(uncertainty: PoseUncertainty) -> Self {
        Self {
            verdict: Verdict::Lost,
            evidence: LOST_AT,
            position_deviation: uncertainty.position,
            heading_deviation: uncertainty.heading,
            ..Self::default()
        }
    }

    /// Records distance and time since the last call.
    pub(crate) fn record_travel(&mut self, distance: Metres, time: Duration, limits: &Limits) {
        self.rolled_since_fix = self.rolled_since_fix + distance;
        self.add_time(time);
        self.degrade(limits);
    }

    fn add_time(&mut self, time: Duration) {
        let ticks = self.time_since_fix.ticks().saturating_add(time.ticks());
        self.time_since_fix = Duration::from_ticks(ticks);
    }

    /// Records the outcome of a ping, its evidence against the pose, whether it repeats the echo of an object, and the
    /// uncertainty after it.
    pub(crate) fn record_fix(
        &mut self,
        fix: &Fix,
        evidence: f32,
        is_repeated: bool,
        uncertainty: PoseUncertainty,
        limits: &Limits,
    ) {
        self.record_uncertainty(uncertainty);
        self.add_evidence(evidence);
        match fix {
            Fix::Accepted(innovation) => self.accept(innovation.nis(), limits),
            Fix::Downweighted(_) | Fix::Gated(_) => self.count_gated(is_repeated, limits),
            Fix::Refused(_) => self.count_silent(limits),
        }
    }

    /// Records an absolute measurement: a position as a range, with its evidence against the pose. A heading confirms no
    /// position: it only counts in the mean NIS, and against the pose. One that was refused counts for nothing.
    pub(crate) fn record_absolute(
        &mut self,
        fix: &AbsoluteFix,
        has_position: bool,
        evidence: f32,
        is_repeated: bool,
        uncertainty: PoseUncertainty,
        limits: &Limits,
    ) {
        let (agreement, is_accepted) = match *fix {
            AbsoluteFix::Accepted(agreement) => (agreement, true),
            AbsoluteFix::Downweighted(agreement) | AbsoluteFix::Gated(agreement) => {
                (agreement, false)
            }
            AbsoluteFix::Refused(_) => return,
        };
        self.record_uncertainty(uncertainty);
        let nis = agreement.nis / f32::from(agreement.dimensions);
        if has_position {
            self.add_evidence(evidence);
            if is_accepted {
                self.accept(nis, limits);
            } else {
                self.count_gated(is_repeated, limits);
            }
            return;
        }
        self.add_evidence(at_least(evidence, 0.0));
        if is_accepted {
            self.average_nis(nis);
        }
        self.worsen(limits);
    }

    /// Records that the estimated path has led through a wall.
    pub(crate) fn record_passage(&mut self) {
        self.evidence = LOST_AT;
        self.verdict = Verdict::Lost;
    }

    fn accept(&mut self, nis: f32, limits: &Limits) {
        self.count_used(nis);
        if self.can_improve(limits) {
            self.improve();
        } else {
            self.degrade(limits);
        }
    }

    fn count_gated(&mut self, is_repeated: bool, limits: &Limits) {
        self.silent_in_a_row = 0;
        let news = u16::from(!is_repeated);
        self.gated_in_a_row = self.gated_in_a_row.saturating_add(news);
        self.count_unused(limits);
    }

    /// Records that there was no wall to measure.
    pub(crate) fn record_no_aim(&mut self, uncertainty: PoseUncertainty, limits: &Limits) {
        self.record_uncertainty(uncertainty);
        self.count_silent(limits);
    }

    /// Records that the wheels could not be observed: for `unseen` by now, of which `time` since the last call.
    ///
    /// The uncertainty has grown by the largest possible travel, which a short failure of an encoder does not confirm: a
    /// deviation beyond its limit counts from [`DEGRADED_WITHOUT_ODOMETRY`] on.
    pub(crate) fn record_unseen(
        &mut self,
        unseen: Duration,
        time: Duration,
        uncertainty: PoseUncertainty,
        limits: &Limits,
    ) {
        self.accepted_in_a_row = 0;
        self.add_time(time);
        self.record_uncertainty(uncertainty);
        if unseen > LOST_WITHOUT_ODOMETRY {
            self.verdict = Verdict::Lost;
        } else if unseen > DEGRADED_WITHOUT_ODOMETRY && self.verdict == Verdict::Tracking {
            self.verdict = Verdict::Degraded;
        }
        if self.time_since_fix > DEGRADED_WITHOUT_FIX {
            self.degrade(limits);
        }
    }

    /// Counts an inflation of the covariance.
    pub(crate) fn record_inflation(&mut self) {
        self.inflations = self.inflations.saturating_add(1);
    }

    pub(crate) fn record_uncertainty(&mut self, uncertainty: PoseUncertainty) {
        self.position_deviation = uncertainty.position;
        self.heading_deviation = uncertainty.heading;
    }

    fn count_used(&mut self, nis: f32) {
        self.gated_in_a_row = 0;
        self.silent_in_a_row = 0;
        self.accepted_in_a_row = self.accepted_in_a_row.saturating_add(1);
        self.unaided = self.unaided.saturating_sub(1);
        self.rolled_since_fix = Metres(0.0);
        self.time_since_fix = Duration::from_ticks(0);
        self.average_nis(nis);
    }

    fn average_nis(&mut self, nis: f32) {
        let nis = between(nis, 0.0, MOST_NIS);
        self.nis += LATEST_NIS * (nis - self.nis);
    }

    fn count_silent(&mut self, limits: &Limits) {
        self.silent_in_a_row = self.silent_in_a_row.saturating_add(1);
        self.count_unused(limits);
    }

    fn count_unused(&mut self, limits: &Limits) {
        self.accepted_in_a_row = 0;
        let is_uncertain = self.position_deviation > UNAIDED_BEYOND
            || self.heading_deviation > limits.heading * 2.0;
        if is_uncertain && self.unaided < LOST_AFTER_UNAIDED {
            self.unaided += 1;
        }
        self.worsen(limits);
    }

    // ===== Eq. (23): cumulative sum of the evidence =====
    fn add_evidence(&mut self, evidence: f32) {
        self.evidence = between(self.evidence + evidence, 0.0, LOST_AT);
    }

    /// Whether the estimate is beyond a limit that does not depend on contradictions.
    fn exceeds(&self, limits: &Limits) -> bool {
        self.nis > DEGRADED_NIS
            || self.rolled_since_fix > limits.distance
            || self.time_since_fix > DEGRADED_WITHOUT_FIX
            || self.is_uncertain(limits)
    }

    fn is_uncertain(&self, limits: &Limits) -> bool {
        self.position_deviation > limits.position || self.heading_deviation > limits.heading
    }

    fn can_improve(&self, limits: &Limits) -> bool {
        let agrees = self.evidence < BETTER_BELOW && self.accepted_in_a_row >= BETTER_AFTER;
        let is_confirmable = self.inflations <= MAX_CONFIRMABLE_INFLATIONS;
        agrees && (self.verdict == Verdict::Lost || (is_confirmable && !self.exceeds(limits)))
    }

    fn improve(&mut self) {
        match self.verdict {
            Verdict::Lost => {
                self.verdict = Verdict::Degraded;
                self.accepted_in_a_row = 0;
            }
            Verdict::Degraded => {
                self.verdict = Verdict::Tracking;
                self.inflations = 0;
            }
            Verdict::Tracking => {}
        }
    }

    fn degrade(&mut self, limits: &Limits) {
        if self.verdict == Verdict::Tracking && self.exceeds(limits) {
            self.verdict = Verdict::Degraded;
        }
    }

    fn worsen(&mut self, limits: &Limits) {
        let unused = self.silent_in_a_row.saturating_add(self.gated_in_a_row);
        if self.evidence >= LOST_AT || self.unaided >= LOST_AFTER_UNAIDED {
            self.verdict = Verdict::Lost;
        } else if unused >= DEGRADED_AFTER_UNUSED || self.evidence >= DEGRADED_AT {
            if self.verdict == Verdict::Tracking {
                self.verdict = Verdict::Degraded;
            }
        } else {
            self.degrade(limits);
        }
    }
}

#[cfg(test)]
mod tests;
