//! The figures of the measurement cycles: innovations, and the verdict that they lead to.

use sonarfix::health::Verdict;
use sonarfix_sim::trace::{FixRecord, Outcome, Trace};

use super::super::axis::Axis;
use super::super::chart::{Chart, LINE, Layer, Shape};
use super::super::palette::Role;
use super::super::points::Point;
use super::values::{MM_PER_M, chart_over_time, over_time, path};

/// Half width of the band of innovations, standard deviations.
const SIGMAS: f64 = 3.0;
/// The vertical axis reaches this many times the usual half width of the band: an echo of furniture may be metres off.
const REACH: f64 = 3.0;

/// Innovations and their band; none without an innovation.
pub(super) fn innovations(trace: &Trace, width: u16) -> Option<Chart<'static>> {
    let half_width = |fix: &FixRecord| Some(SIGMAS * fix.innovation_variance?.sqrt() * MM_PER_M);
    let band = |side: f64| -> Vec<Point> {
        let points = trace.fixes.iter().filter_map(|fix| Some((fix.time, side * half_width(fix)?)));
        points.filter(|(time, value)| time.is_finite() && value.is_finite()).collect()
    };
    let (lower, upper) = (band(-1.0), band(1.0));
    let mut widths: Vec<f64> = upper.iter().map(|point| point.1).collect();
    widths.sort_by(f64::total_cmp);
    let usual = widths.get(widths.len() / 2).copied().filter(|width| *width > 0.0)?;
    let shown = REACH * usual;
    let dots = |label, role, outcome| {
        let of = trace.fixes.iter().filter(|fix| fix.outcome == outcome);
        let points = of.filter_map(|fix| Some((fix.time, fix.innovation? * MM_PER_M)));
        // A dot beyond the axis is at its edge.
        let points = points.map(|(time, value)| (time, value.clamp(-shown, shown))).collect();
        Layer { label, role, shape: Shape::Dots(points) }
    };
    let layers = vec![
        Layer { label: "±3σ", role: Role::Band, shape: Shape::Band(lower, upper) },
        dots("gated", Role::Gated, Outcome::Gated),
        dots("lower weight", Role::Error, Outcome::Downweighted),
        dots("accepted", Role::Accepted, Outcome::Accepted),
    ];
    let y = Axis::linear("innovation (mm)", -shown..shown);
    Some(chart_over_time(trace, width, "Innovations".into(), y, layers))
}

/// The verdict, as steps.
pub(super) fn verdict(trace: &Trace, width: u16) -> Chart<'static> {
    let height = |verdict| match verdict {
        Verdict::Lost => 0.0,
        Verdict::Degraded => 1.0,
        Verdict::Tracking => 2.0,
    };
    let values = over_time(trace, |tick| Some(height(tick.estimate.verdict)));
    let mut steps: Vec<Point> = Vec::new();
    for (time, value) in values {
        match steps.last() {
            Some((_, last)) if (last - value).abs() < 0.5 => {}
            Some(&(_, last)) => steps.extend([(time, last), (time, value)]),
            None => steps.push((time, value)),
        }
    }
    let end = trace.ticks.last().map(|tick| tick.time).zip(steps.last().copied());
    steps.extend(end.map(|(time, (_, value))| (time, value)));
    let y = Axis::named("", &["Lost", "Degraded", "Tracking"]);
    let layers = vec![path("verdict", Role::Estimate, 2 * LINE, steps)];
    chart_over_time(trace, width, "Health verdict".into(), y, layers)
}
