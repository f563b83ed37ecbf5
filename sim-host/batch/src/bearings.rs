//! Estimates the line from commanded to true bearings. The data are the pings that a wall answered, and those that it did not.
//!
//! A wall answers at its perpendicular, whatever the bearing: the range has no information on the bearing. Whether it
//! answers has: with probability `share / (1 + exp((|α| − half) / blur))` at the angle α off the axis, symmetric about
//! zero. The likelihood of all answers and missing answers determines offset and scale of the bearing, the lag of the
//! servo behind its command, and the cone. Fisher scoring; the inverse of the information is the covariance.

#![expect(clippy::indexing_slicing, reason = "arrays of the model's fixed size")]

use nalgebra::{SMatrix, SVector};

/// Number of parameters.
const COUNT: usize = 7;
type Vector = SVector<f64, COUNT>;

/// A ping towards a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallPing {
    /// Commanded bearing, radians.
    pub commanded: f64,
    /// Bearing of the wall's perpendicular in the robot's frame, radians.
    pub perpendicular: f64,
    /// Distance of the wall, metres.
    pub distance: f64,
    /// Sign of the servo's last motion.
    pub moved: f64,
    /// Whether the wall answered.
    pub answered: bool,
}

/// The estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bearings {
    /// True bearing of a command of zero, radians.
    pub offset: f64,
    /// Growth of the true bearing with the command.
    pub scale: f64,
    /// Half of the cone in which walls answer, at [`MIDDLE`], radians.
    pub half_cone: f64,
    /// Standard deviation of the offset, radians.
    pub offset_deviation: f64,
    /// Standard deviation of the scale.
    pub scale_deviation: f64,
    /// Standard deviation of the half-angle, radians.
    pub cone_deviation: f64,
}

/// Distance to which the cone refers, metres.
pub const MIDDLE: f64 = 1.5;
/// Fewest answers, and fewest missing ones, from which the bearings are estimated.
const ENOUGH: usize = 40;

/// Assumed scatter, in standard deviations, where a half alone has no solution.
const UNKNOWN_SCATTER: f64 = 3.0;

/// Estimates the bearings; `None` if the pings do not determine them.
///
/// Pings at one wall from one place share what the model does not contain, for example an object that is not in the map. The
/// deviations are therefore widened by the scatter between the halves of the recording.
#[must_use]
pub fn fit(pings: &[WallPing]) -> Option<Bearings> {
    let mut whole = maximum(pings)?;
    let (first, second) = pings.split_at(pings.len() / 2);
    let halves = maximum(first).zip(maximum(second));
    let scatter = |value: fn(&Bearings) -> (f64, f64)| {
        halves.as_ref().map_or(UNKNOWN_SCATTER, |(first, second)| {
            let ((a, deviation_a), (b, deviation_b)) = (value(first), value(second));
            ((a - b).abs() / deviation_a.hypot(deviation_b)).max(1.0)
        })
    };
    whole.offset_deviation *= scatter(|half| (half.offset, half.offset_deviation));
    whole.scale_deviation *= scatter(|half| (half.scale, half.scale_deviation));
    whole.cone_deviation *= scatter(|half| (half.half_cone, half.cone_deviation));
    Some(whole)
}

/// The maximum of the likelihood, with the deviations of independent pings.
fn maximum(pings: &[WallPing]) -> Option<Bearings> {
    let answers = pings.iter().filter(|ping| ping.answered).count();
    if answers < ENOUGH || pings.len() - answers < ENOUGH {
        return None;
    }
    let mut at = coarse(pings);
    let mut damping = 1e-3;
    let mut likelihood = log_likelihood(pings, &at);
    for _ in 0..60 {
        let (information, gradient) = score(pings, &at);
        let mut raised = information;
        for k in 0..COUNT {
            raised[(k, k)] *= 1.0 + damping;
        }
        let Some(factor) = raised.cholesky() else {
            damping *= 10.0;
            continue;
        };
        let next = at + factor.solve(&gradient);
        let higher = log_likelihood(pings, &next);
        if higher >= likelihood {
            let has_converged = higher - likelihood < 1e-7;
            (at, likelihood) = (next, higher);
            damping = (damping * 0.1).max(1e-9);
            if has_converged {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e9 {
                break;
            }
        }
    }
    let covariance = score(pings, &at).0.try_inverse()?;
    let deviation = |k: usize| Some(covariance[(k, k)]).filter(|v| *v > 0.0).map(f64::sqrt);
    let fitted = Bearings {
        offset: at[0],
        scale: 1.0 + at[1],
        half_cone: at[3],
        offset_deviation: deviation(0)?,
        scale_deviation: deviation(1)?,
        cone_deviation: deviation(3)?,
    };
    let is_plausible = fitted.half_cone > 0.0 && fitted.scale > 0.5 && fitted.scale < 2.0;
    is_plausible.then_some(fitted)
}

/// Offset, scale − 1, lag, half cone, its growth per metre, logarithm of the blur, logit of the share.
fn start(offset: f64, scale: f64, half: f64) -> Vector {
    Vector::from([offset, scale, 0.0, half, 0.0, 3_f64.to_radians().ln(), 2.5])
}

/// The best point of a grid, so that the iteration begins near the right maximum.
fn coarse(pings: &[WallPing]) -> Vector {
    let mut best = (start(0.0, 0.0, 0.25), f64::NEG_INFINITY);
    for offset in -8..=8 {
        for scale in -4..=4 {
            for half in [12_f64, 20.0, 30.0] {
                let (offset, scale) = (f64::from(2 * offset).to_radians(), 0.03 * f64::from(scale));
                let at = start(offset, scale, half.to_radians());
                let likelihood = log_likelihood(pings, &at);
                if likelihood > best.1 {
                    best = (at, likelihood);
                }
            }
        }
    }
    best.0
}

/// Probability of an answer, and its derivatives.
fn probability(ping: &WallPing, at: &Vector) -> (f64, Vector) {
    let angle = at[0] + (1.0 + at[1]) * ping.commanded - at[2] * ping.moved - ping.perpendicular;
    let sign = angle.signum();
    let (away, blur) = (ping.distance - MIDDLE, at[5].exp());
    let rim = ((angle.abs() - at[3] - at[4] * away) / blur).clamp(-40.0, 40.0);
    let share = 1.0 / (1.0 + (-at[6]).exp());
    let inside = 1.0 / (1.0 + rim.exp());
    let by_rim = -share * inside * (1.0 - inside);
    let by_angle = by_rim * sign / blur;
    let derivatives = Vector::from([
        by_angle,
        by_angle * ping.commanded,
        -by_angle * ping.moved,
        -by_rim / blur,
        -by_rim * away / blur,
        -by_rim * rim,
        inside * share * (1.0 - share),
    ]);
    ((share * inside).clamp(1e-4, 1.0 - 1e-4), derivatives)
}

/// Weak priors keep what the pings do not determine: lag, growth, blur and share.
const PRIOR: [(f64, f64); COUNT] =
    [(0.0, 0.5), (0.0, 0.3), (0.0, 0.02), (0.3, 0.3), (0.0, 0.05), (-3.0, 1.0), (2.5, 2.0)];

fn log_likelihood(pings: &[WallPing], at: &Vector) -> f64 {
    let of = |ping: &WallPing| {
        let (p, _) = probability(ping, at);
        if ping.answered { p.ln() } else { (1.0 - p).ln() }
    };
    let priors = PRIOR.iter().zip(at.iter());
    let prior: f64 = priors.map(|((mean, sigma), value)| ((value - mean) / sigma).powi(2)).sum();
    pings.iter().map(of).sum::<f64>() - 0.5 * prior
}

fn score(pings: &[WallPing], at: &Vector) -> (SMatrix<f64, COUNT, COUNT>, Vector) {
    let mut information = SMatrix::<f64, COUNT, COUNT>::zeros();
    let mut gradient = Vector::zeros();
    for ping in pings {
        let (p, by) = probability(ping, at);
        let answered = f64::from(u8::from(ping.answered));
        let weight = 1.0 / (p * (1.0 - p));
        information += by * by.transpose() * weight;
        gradient += by * (weight * (answered - p));
    }
    for (k, (mean, sigma)) in PRIOR.iter().enumerate() {
        information[(k, k)] += sigma.powi(-2);
        gradient[k] -= (at[k] - mean) * sigma.powi(-2);
    }
    (information, gradient)
}
