//! The figure of the spread over runs.

use sonarfix_sim::spread::Spread;

use super::super::chart::{Chart, HAIRLINE, LINE};
use super::super::palette::Role;
use super::super::points::Point;
use super::values::{Data, MM_PER_M, chart_over_time, line, magnitude, over_time};

/// The position error of many runs over time, and of the run shown; none without many runs.
pub(super) fn chart(Data { trace, spread }: Data<'_>, width: u16) -> Option<Chart<'static>> {
    let spread = spread.filter(|spread| spread.runs > 1)?;
    let points = |values: &[f64]| -> Vec<Point> {
        spread.times.iter().copied().zip(values.iter().map(|value| value * MM_PER_M)).collect()
    };
    let (median, most) = (points(&spread.median), points(&spread.most));
    let shown = over_time(trace, |tick| {
        let (truth, pose) = (tick.truth?.pose, tick.estimate.pose);
        Some((pose.x - truth.x).hypot(pose.y - truth.y) * MM_PER_M)
    });
    let y = magnitude("position error (mm)", &median, &most);
    let layers = vec![
        line("this run", Role::Error, HAIRLINE, shown),
        line("median", Role::Estimate, LINE, median),
        line("95 % of runs", Role::Encoders, LINE, most),
    ];
    Some(chart_over_time(trace, width, "Spread over runs".into(), y, layers))
}

pub(super) fn caption(spread: &Spread) -> String {
    format!(
        "Distance between estimated and true position in {} runs (seeds {} to {}): the median, and the value that \
         95 % of the runs do not exceed. The other figures and the player show the run with seed {}.",
        spread.runs,
        spread.seed,
        spread.seed.wrapping_add(spread.runs.saturating_sub(1).into()),
        spread.seed
    )
}
