//! The figures of the systematic errors.

use sonarfix_sim::trace::{Calibration, Tick, Trace};

use super::super::axis::Axis;
use super::super::chart::{Chart, LINE, Layer, Shape};
use super::super::palette::Role;
use super::values::{MM_PER_M, band, chart_over_time, legible, line, over_time};

/// The caption of the first of them.
pub(super) const CAPTION: &str = "The estimated scale error of the left wheel, one standard deviation on \
     either side and, where it is known, the true value. Initial values that would dwarf the rest are clipped.";

const PER_MILLE: f64 = 1_000.0;

/// A systematic error.
pub(super) struct Quantity {
    title: &'static str,
    /// With the unit.
    label: &'static str,
    /// Units per SI unit.
    per_si: f64,
    value: fn(&Calibration) -> f64,
    /// Index of its deviation in [`sonarfix_sim::STATES`].
    state: usize,
}

pub(super) const SCALE_RIGHT: Quantity = Quantity {
    title: "Scale error of the right wheel, S_R",
    label: "S_R (10⁻³)",
    per_si: PER_MILLE,
    value: |of| of.scale_right,
    state: 3,
};
pub(super) const SCALE_LEFT: Quantity = Quantity {
    title: "Scale error of the left wheel, S_L",
    label: "S_L (10⁻³)",
    value: |of| of.scale_left,
    state: 4,
    ..SCALE_RIGHT
};
pub(super) const TRACK_WIDTH: Quantity = Quantity {
    title: "Track width",
    label: "track width (mm)",
    per_si: MM_PER_M,
    value: |of| of.track_width,
    state: 5,
};
pub(super) const RANGE_SCALE: Quantity = Quantity {
    title: "Scale error of the ranges",
    label: "range scale (10⁻³)",
    value: |of| of.range_scale,
    state: 6,
    ..SCALE_RIGHT
};

/// The chart of a systematic error; none if the robot does not estimate it.
pub(super) fn chart(trace: &Trace, width: u16, of: &Quantity) -> Option<Chart<'static>> {
    let sigma = |tick: &Tick| tick.estimate.deviation.get(of.state).copied().unwrap_or(f64::NAN);
    if !trace.ticks.iter().any(|tick| sigma(tick) > 0.0) {
        return None;
    }
    let value = |calibration: &Calibration| (of.value)(calibration) * of.per_si;
    let beside = |sigmas: f64| {
        move |tick: &Tick| {
            Some(value(&tick.estimate.calibration) + sigmas * sigma(tick) * of.per_si)
        }
    };
    let estimate = over_time(trace, |tick| Some(value(&tick.estimate.calibration)));
    let (lower, upper) = (over_time(trace, beside(-1.0)), over_time(trace, beside(1.0)));
    let truth = over_time(trace, |tick| tick.truth?.calibration.as_ref().map(value));
    let y = legible(estimate.iter().chain(&lower).chain(&upper).chain(&truth));
    let mut layers = vec![band(lower, upper), line("estimated", Role::Estimate, LINE, estimate)];
    layers.extend((!truth.is_empty()).then_some(Layer {
        label: "true",
        role: Role::Truth,
        shape: Shape::Dotted(truth),
    }));
    Some(chart_over_time(trace, width, of.title.into(), Axis::linear(of.label, y), layers))
}
