//! The figure of the time that kidnapped robots take to detect it.

use super::axis::Axis;
use super::chart::{BROAD, Chart, DrawError, LINE, Layer, Shape, WIDE};
use super::palette::Role;
use super::points::Point;

/// Range of the horizontal axis, measurement cycles: nearly all robots are detected by then.
const SHOWN: u32 = 40;
/// Height of the figure, pixels.
const HEIGHT: u16 = 350;
/// The requirement: cycles, and per cent of the robots.
const BAR: Point = (15.0, 95.0);

/// Draws the share of robots with the verdict `Lost` over the cycles since the kidnapping.
/// `called_after` has for each robot the cycle of its first verdict `Lost`.
///
/// # Errors
/// The error of the drawing.
pub fn called_lost(called_after: &[Option<usize>]) -> Result<String, DrawError> {
    let share = |fixes: u32| {
        let called = called_after
            .iter()
            .filter(|after| after.and_then(|n| u32::try_from(n).ok()).is_some_and(|n| n <= fixes));
        100.0 * count(called.count()) / count(called_after.len().max(1))
    };
    // A step at each cycle.
    let steps = (1..=SHOWN).flat_map(|fix| {
        let fix_f64 = f64::from(fix);
        [(fix_f64, share(fix - 1)), (fix_f64, share(fix))]
    });
    let chart = Chart {
        title: "Verdict Lost after a kidnapping by 1 m and 90°".into(),
        x: Axis::linear("measurement cycles since", 0.0..f64::from(SHOWN)),
        y: Axis::linear("robots (%)", 0.0..104.0),
        width: WIDE,
        height: HEIGHT,
        layers: vec![
            Layer {
                label: "required",
                role: Role::Truth,
                shape: Shape::Path(LINE, vec![(0.0, BAR.1), BAR, (BAR.0, 0.0)]),
            },
            Layer {
                label: "measured",
                role: Role::Estimate,
                shape: Shape::Path(BROAD, steps.collect()),
            },
        ],
    };
    chart.svg()
}

#[expect(clippy::cast_precision_loss, reason = "some thousand trials")]
fn count(n: usize) -> f64 {
    n as f64
}
