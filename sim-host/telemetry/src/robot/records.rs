//! The telemetry of a robot as the records of a trace.
//!
//! What is not sent is absent: the truth, the covariance of x and y (the ellipse is parallel to the axes), the probability that an
//! echo was the wall's, and the window of the search.

use sonarfix::geometry::units::Instant;
use sonarfix::localizer::Fix;
use sonarfix_hal::ranger;
use sonarfix_link::message::{Odometry, RankedHypothesis, SearchStatus, SkippedPing, Sweep};
use sonarfix_link::{Estimate, Ping};
use sonarfix_search::navigator::Mode;
use sonarfix_sim::trace::{
    self, Calibration, FixRecord, Hypothesis, Outcome, Pose, SearchRecord, Tick,
};

/// The robot and where it is.
#[derive(Debug, Clone, Copy, Default)]
pub struct Geometry {
    /// Position of the sonar in the robot frame, metres.
    pub mount: [f64; 2],
    /// Nominal track width, metres; 0 if it is unknown.
    pub track: f64,
    /// The last estimated pose.
    pub pose: Pose,
}

/// The time on the robot's clock, seconds.
#[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs, 285 years")]
pub fn seconds(at: Instant) -> f64 {
    at.ticks() as f64 * 1e-6
}

fn pose(estimate: &Estimate) -> Pose {
    let state = &estimate.state;
    Pose { x: state.x.0.into(), y: state.y.0.into(), heading: state.heading.0.into() }
}

/// An estimate, beside the pose by the encoders alone.
pub fn tick(estimate: &Estimate, track: f64, odometry: Option<Pose>) -> Tick {
    let (state, health) = (&estimate.state, &estimate.health);
    let nowhere = Pose { x: f64::NAN, y: f64::NAN, heading: f64::NAN };
    Tick {
        time: seconds(estimate.at),
        truth: None,
        estimate: trace::Estimate {
            pose: pose(estimate),
            calibration: Calibration {
                scale_right: state.scale_right.into(),
                scale_left: state.scale_left.into(),
                track_width: track + f64::from(state.track_width_error.0),
                range_scale: state.range_scale.into(),
            },
            deviation: estimate.deviation.to_array().map(f64::from),
            covariance_xy: 0.0,
            gyro: None,
            verdict: health.verdict,
            mismatch: None,
            inflations: health.inflations,
        },
        bound: None,
        odometry: odometry.unwrap_or(nowhere),
    }
}

/// A cycle without outcome, at the last pose.
fn cycle(at: Instant, bearing: f64, geometry: &Geometry) -> FixRecord {
    let Geometry { mount: [ahead, left], pose: Pose { x, y, heading }, .. } = *geometry;
    let (sin, cos) = heading.sin_cos();
    FixRecord {
        ranger: 0,
        time: seconds(at),
        wall: None,
        sonar: [x + ahead * cos - left * sin, y + ahead * sin + left * cos],
        direction: heading + bearing,
        bearing,
        range: None,
        source: None,
        why: None,
        outcome: Outcome::Refused,
        association: None,
        reason: String::new(),
        innovation: None,
        innovation_variance: None,
    }
}

fn range(outcome: &ranger::Outcome) -> Option<f64> {
    outcome.as_ref().ok().map(|echo| echo.range.0.into())
}

/// A ping at a wall.
pub fn ping(ping: &Ping, geometry: &Geometry) -> FixRecord {
    let (outcome, innovation, reason) = match ping.fix {
        Fix::Accepted(innovation) => (Outcome::Accepted, Some(innovation), String::new()),
        Fix::Downweighted(innovation) => (Outcome::Downweighted, Some(innovation), String::new()),
        Fix::Gated(innovation) => (Outcome::Gated, Some(innovation), String::new()),
        Fix::Refused(refusal) => (Outcome::Refused, None, refusal.to_string()),
        other => (Outcome::Refused, None, format!("{other:?}")),
    };
    FixRecord {
        wall: usize::try_from(ping.aim.wall.0).ok(),
        ranger: ping.aim.ranger.0,
        range: range(&ping.outcome),
        outcome,
        reason,
        innovation: innovation.map(|innovation| innovation.value.0.into()),
        innovation_variance: innovation.map(|innovation| innovation.variance.0.into()),
        ..cycle(ping.at, ping.aim.bearing.0.into(), geometry)
    }
}

/// A ping of the search, which no wall was chosen for.
pub fn sweep(sweep: &Sweep, geometry: &Geometry) -> FixRecord {
    let reason = "a ping of the search".to_owned();
    FixRecord {
        range: range(&sweep.outcome),
        reason,
        ..cycle(sweep.at, sweep.bearing.0.into(), geometry)
    }
}

/// A ping that was due when no wall could be measured.
pub fn skip(skip: SkippedPing, geometry: &Geometry) -> FixRecord {
    FixRecord { reason: skip.reason.to_string(), ..cycle(skip.at, 0.0, geometry) }
}

/// The progress of the search with its hypotheses.
pub fn search(status: &SearchStatus, hypotheses: &[RankedHypothesis]) -> SearchRecord {
    let best = hypotheses.first().map_or(0.0, |best| f64::from(best.fit));
    let pings = f64::from(status.pings);
    let hypothesis = |found: &RankedHypothesis| Hypothesis {
        pose: Pose {
            x: found.pose.x.0.into(),
            y: found.pose.y.0.into(),
            heading: found.pose.heading.radians().0.into(),
        },
        weight: (pings * (f64::from(found.fit) - best)).exp(),
    };
    SearchRecord {
        time: seconds(status.at),
        is_provisional: status.mode == Mode::Provisional,
        hypotheses: hypotheses.iter().map(hypothesis).collect(),
        pings: Vec::new(),
        lines: Vec::new(),
    }
}

/// The pose by the encoders alone, from a pose that the robot has reported.
#[derive(Debug, Clone, Copy, Default)]
pub struct DeadReckoning {
    pose: Option<Pose>,
    last: Option<Odometry>,
}

impl DeadReckoning {
    /// Begins at an estimate.
    pub fn place(&mut self, estimate: &Estimate) {
        self.pose = Some(pose(estimate));
    }

    /// Adds the travel of both wheels, with the nominal track width in metres; 0 if it is unknown.
    pub fn take(&mut self, step: &Odometry, track: f64) {
        let before = self.last.replace(*step).filter(|before| before.at <= step.at);
        let (Some(pose), true) = (&mut self.pose, track > 0.0) else {
            return;
        };
        // The totals are counted from the robot's start.
        let (right, left) = before.map_or((0.0, 0.0), |of| (of.right_metres, of.left_metres));
        let (right, left) = (step.right_metres - right, step.left_metres - left);
        let (travel, turn) = (0.5 * (right + left), (right - left) / track);
        let (sin, cos) = (pose.heading + 0.5 * turn).sin_cos();
        pose.x += travel * cos;
        pose.y += travel * sin;
        pose.heading += turn;
    }

    /// The pose; `None` before the robot's start.
    pub fn pose(&self) -> Option<Pose> {
        self.pose
    }
}
