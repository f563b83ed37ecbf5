//! Converts the state of the shipped localizer to the `f64` of traces and statistics.

#![expect(
    clippy::indexing_slicing,
    reason = "vectors and matrices of a fixed size, indexed by constants of the model"
)]

use nalgebra::{DMatrix, DVector, Matrix2};
use sonarfix::aim::{Aim, NoAim};
use sonarfix::filter::ekf::{Ekf, Innovation};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Instant;
use sonarfix::localizer::{AbsoluteFix, Agreement, Fix, GyroStatus, Localizer};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_search::search::Search;

use crate::angle;
use crate::dense::{Matrix, Vector};
use crate::time::seconds;
use crate::trace::{
    AbsoluteRecord, Calibration, Estimate, FixRecord, GyroEstimate, Hypothesis, Outcome, Pose,
    SearchRecord, Why,
};
use crate::world::reflector::Source;

/// The localizer's pose.
#[must_use]
pub fn pose(localizer: &Localizer) -> Pose {
    let state = localizer.filter().state();
    Pose { x: state.x.0.into(), y: state.y.0.into(), heading: state.heading.0.into() }
}

/// The localizer's estimate.
#[must_use]
pub fn estimate(localizer: &Localizer) -> Estimate {
    let ekf = localizer.filter();
    let state = ekf.state();
    let p = covariance(ekf);
    let nominal = f64::from(localizer.config().drive.track_width.0);
    Estimate {
        pose: pose(localizer),
        calibration: Calibration {
            scale_right: state.scale_right.into(),
            scale_left: state.scale_left.into(),
            track_width: nominal + f64::from(state.track_width_error.0),
            range_scale: state.range_scale.into(),
        },
        deviation: p.diagonal().map(f64::sqrt).into(),
        covariance_xy: p[(0, 1)],
        gyro: localizer.gyro().map(|status| gyro(&status)),
        verdict: localizer.health().verdict,
        mismatch: localizer.mismatch(),
        inflations: localizer.health().inflations,
    }
}

/// The estimate of a gyro.
#[must_use]
pub fn gyro(status: &GyroStatus) -> GyroEstimate {
    let GyroStatus { bias, deviation, slips, .. } = *status;
    GyroEstimate { bias: bias.0.into(), deviation: deviation.0.into(), slips }
}

/// The filter's state X̂.
#[must_use]
pub fn state(ekf: &Ekf) -> Vector {
    ekf.state_vector().map(f64::from)
}

/// The filter's covariance P.
#[must_use]
pub fn covariance(ekf: &Ekf) -> Matrix {
    ekf.covariance().map(f64::from)
}

/// The filter's covariance of x and y.
#[must_use]
pub fn position_covariance(ekf: &Ekf) -> Matrix2<f64> {
    ekf.covariance().fixed_view::<2, 2>(0, 0).map(f64::from)
}

/// The error of the filter's state, its heading wrapped.
#[must_use]
pub fn error(ekf: &Ekf, truth: &Vector) -> Vector {
    let mut error = state(ekf) - truth;
    error[2] = angle::wrap(error[2]);
    error
}

/// Normalized estimation error squared (NEES), εᵀ P⁻¹ ε, over the estimated states (those with a
/// nonzero variance), and their number. `None` if P is not positive definite.
#[must_use]
pub fn nees(error: &Vector, p: &Matrix) -> Option<(f64, usize)> {
    let estimated: Vec<usize> = (0..7).filter(|&i| p[(i, i)] > 0.0).collect();
    let n = estimated.len();
    // Scaled to a correlation matrix first: variances differ by ten orders of magnitude.
    let deviation = DVector::from_fn(n, |i, _| p[(estimated[i], estimated[i])].sqrt());
    let correlation = DMatrix::from_fn(n, n, |i, j| {
        p[(estimated[i], estimated[j])] / (deviation[i] * deviation[j])
    });
    let scaled = DVector::from_fn(n, |i, _| error[estimated[i]] / deviation[i]);
    let solved = correlation.cholesky()?.solve(&scaled);
    Some((scaled.dot(&solved), n))
}

/// The measurement of one cycle, without its outcome in the filter.
#[derive(Debug, Clone, Copy)]
pub struct Measurement {
    /// Seconds since the run began.
    pub time: f64,
    /// Position of the sonar, metres.
    pub sonar: [f64; 2],
    /// The heading that the bearing is relative to, radians.
    pub heading: f64,
    /// The measured range, metres.
    pub range: Option<f64>,
    /// The source of the echo, where it is known.
    pub source: Option<Source>,
}

/// The record of a measurement of a wall, with its outcome, immediately after the localizer received it.
#[must_use]
pub fn fix_record(
    measurement: Measurement,
    aim: &Aim,
    fix: &Fix,
    localizer: &Localizer,
) -> FixRecord {
    let (outcome, innovation, reason) = match fix {
        Fix::Accepted(innovation) => (Outcome::Accepted, Some(innovation), String::new()),
        Fix::Downweighted(innovation) => (Outcome::Downweighted, Some(innovation), String::new()),
        Fix::Gated(innovation) => (Outcome::Gated, Some(innovation), String::new()),
        Fix::Refused(refusal) => (Outcome::Refused, None, refusal.to_string()),
        other => (Outcome::Refused, None, format!("{other:?}")),
    };
    let bearing = f64::from(aim.bearing.0);
    FixRecord {
        time: measurement.time,
        wall: usize::try_from(aim.wall.0).ok(),
        ranger: aim.ranger.0,
        sonar: measurement.sonar,
        direction: angle::wrap(measurement.heading + bearing),
        bearing,
        range: measurement.range,
        source: measurement.source,
        why: Some(why(aim)),
        outcome,
        association: innovation.map(|_| localizer.association().into()),
        reason,
        innovation: innovation.map(|i: &Innovation| i.value.0.into()),
        innovation_variance: innovation.map(|i| i.variance.0.into()),
    }
}

fn why(aim: &Aim) -> Why {
    #[expect(clippy::cast_precision_loss, reason = "some seconds")]
    let micros = aim.why.time.to_micros() as f64;
    Why {
        gain: aim.why.gain.0.into(),
        success: aim.why.success.into(),
        seconds: micros * 1e-6,
        candidates: aim.why.candidates,
    }
}

/// The record of a cycle without a measurable wall.
#[must_use]
pub fn no_aim_record(measurement: Measurement, no_aim: NoAim) -> FixRecord {
    FixRecord {
        time: measurement.time,
        wall: None,
        ranger: 0,
        sonar: measurement.sonar,
        direction: measurement.heading,
        bearing: 0.0,
        range: measurement.range,
        source: None,
        why: None,
        outcome: Outcome::Refused,
        association: None,
        reason: no_aim.to_string(),
        innovation: None,
        innovation_variance: None,
    }
}

/// The record of a heading, position or pose from outside, with its outcome.
#[must_use]
pub fn absolute_record(
    measured_at: Instant,
    measurement: &AbsoluteMeasurement,
    fix: &AbsoluteFix,
) -> AbsoluteRecord {
    let (outcome, agreement, reason) = match fix {
        AbsoluteFix::Accepted(agreement) => (Outcome::Accepted, Some(agreement), String::new()),
        AbsoluteFix::Downweighted(agreement) => {
            (Outcome::Downweighted, Some(agreement), String::new())
        }
        AbsoluteFix::Gated(agreement) => (Outcome::Gated, Some(agreement), String::new()),
        AbsoluteFix::Refused(refusal) => (Outcome::Refused, None, refusal.to_string()),
        other => (Outcome::Refused, None, format!("{other:?}")),
    };
    let at = |point: &Point| Some([point.x.0.into(), point.y.0.into()]);
    let (position, heading) = match measurement {
        AbsoluteMeasurement::Heading { angle, .. } => (None, Some(angle.0.into())),
        AbsoluteMeasurement::Position { point, .. } => (at(point), None),
        AbsoluteMeasurement::Pose { pose, .. } => {
            (at(&pose.position()), Some(pose.heading.radians().0.into()))
        }
    };
    let nis = |of: &Agreement| f64::from(of.nis) / f64::from(of.dimensions.max(1));
    AbsoluteRecord {
        time: seconds(measured_at.ticks()),
        position,
        heading,
        outcome,
        reason,
        nis: agreement.map(nis),
    }
}

/// The state of a search.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "a window of pings")]
pub fn search_record(time: f64, is_provisional: bool, search: &Search) -> SearchRecord {
    let best = search.ranked(0).map_or(0.0, |best| f64::from(best.fit));
    let pings = search.pings() as f64;
    let point = |point: Point| [point.x.0.into(), point.y.0.into()];
    let hypotheses = search.hypotheses().map(|found| Hypothesis {
        pose: Pose {
            x: found.pose.x.0.into(),
            y: found.pose.y.0.into(),
            heading: found.pose.heading.radians().0.into(),
        },
        weight: libm::exp(pings * (f64::from(found.fit) - best)),
    });
    SearchRecord {
        time,
        is_provisional,
        hypotheses: hypotheses.collect(),
        pings: search.placed_pings().map(|(at, echo)| (point(at), echo.map(point))).collect(),
        lines: search.placed_lines().map(|ends| ends.map(point)).collect(),
    }
}
