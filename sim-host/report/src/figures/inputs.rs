//! The figures of the inputs beside wheels and sonar: the gyro, and what was measured from outside.

use sonarfix_sim::trace::{Outcome, Tick, Trace};

use super::super::axis::Axis;
use super::super::chart::{Chart, LINE, Layer, Shape};
use super::super::palette::Role;
use super::super::points::Point;
use super::values::{band, chart_over_time, legible, line, over_time};

/// The vertical axis of the normalized innovations ends here, standard deviations.
const REACH: f64 = 6.0;

/// The bias of the gyro, and the slips of the wheels; none without a gyro.
pub(super) fn gyro_bias(trace: &Trace, width: u16) -> Option<Chart<'static>> {
    let beside = |sigmas: f64| {
        over_time(trace, |tick| {
            let gyro = tick.estimate.gyro?;
            Some((gyro.bias + sigmas * gyro.deviation).to_degrees())
        })
    };
    let (lower, estimate, upper) = (beside(-1.0), beside(0.0), beside(1.0));
    if estimate.is_empty() {
        return None;
    }
    let truth = over_time(trace, |tick| Some(tick.truth?.gyro_bias?.to_degrees()));
    let y = legible(estimate.iter().chain(&lower).chain(&upper).chain(&truth));
    let slips = slips(trace);
    let mut layers = vec![band(lower, upper), line("estimated", Role::Estimate, LINE, estimate)];
    let layer = |label, role, shape| Layer { label, role, shape };
    layers.extend((!truth.is_empty()).then(|| layer("true", Role::Truth, Shape::Dotted(truth))));
    layers.extend(
        (!slips.is_empty()).then(|| layer("slip of a wheel", Role::Gated, Shape::Dots(slips))),
    );
    let y = Axis::linear("bias (°/s)", y);
    Some(chart_over_time(trace, width, "Bias of the gyro".into(), y, layers))
}

/// The estimated bias at each slip.
fn slips(trace: &Trace) -> Vec<Point> {
    let slips = |tick: &Tick| tick.estimate.gyro.map_or(0, |gyro| gyro.slips);
    let pairs = trace.ticks.iter().zip(trace.ticks.iter().skip(1));
    let begun = pairs.filter(|(before, after)| slips(after) > slips(before));
    begun.filter_map(|(_, tick)| Some((tick.time, tick.estimate.gyro?.bias.to_degrees()))).collect()
}

/// The normalized innovations of what was measured from outside; none without a measurement.
pub(super) fn absolute(trace: &Trace, width: u16) -> Option<Chart<'static>> {
    if trace.absolutes.is_empty() {
        return None;
    }
    let dots = |label, role, outcome| {
        let of = trace.absolutes.iter().filter(|absolute| absolute.outcome == outcome);
        let points = of.map(|absolute| {
            let sigmas = absolute.nis.map_or(0.0, f64::sqrt);
            // A dot beyond the axis is at its edge.
            (absolute.time, if sigmas.is_finite() { sigmas.min(REACH) } else { REACH })
        });
        Layer { label, role, shape: Shape::Dots(points.collect()) }
    };
    let layers = vec![
        dots("refused", Role::Refused, Outcome::Refused),
        dots("gated", Role::Gated, Outcome::Gated),
        dots("lower weight", Role::Error, Outcome::Downweighted),
        dots("accepted", Role::Accepted, Outcome::Accepted),
    ];
    let y = Axis::linear("innovation (σ)", 0.0..REACH);
    Some(chart_over_time(trace, width, "Measurements from outside".into(), y, layers))
}
