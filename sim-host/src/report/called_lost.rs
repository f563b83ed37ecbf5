//! The figure of how long robots that were carried off take to say so.

use super::axis::Axis;
use super::chart::{BROAD, Chart, DrawError, LINE, Layer, Shape};
use super::palette::Role;
use super::points::Point;
use crate::kidnapped::Outcome;

/// Fixes shown: nearly all have said it by then.
const SHOWN: u32 = 40;
/// Height of the figure, pixels.
const HEIGHT: u16 = 350;
/// Within how many fixes how many per cent are to have said it.
const BAR: Point = (15.0, 95.0);

/// Draws how many, in per cent, have said that they are lost, over the fixes since.
///
/// # Errors
/// The drawing's own.
pub fn called_lost(trials: &[Outcome]) -> Result<String, DrawError> {
    let share = |fixes: u32| {
        let called = trials.iter().filter(|outcome| {
            outcome.called_after.and_then(|n| u32::try_from(n).ok()).is_some_and(|n| n <= fixes)
        });
        100.0 * count(called.count()) / count(trials.len().max(1))
    };
    // A step at each fix.
    let steps = (1..=SHOWN).flat_map(|fix| {
        let fix_f64 = f64::from(fix);
        [(fix_f64, share(fix - 1)), (fix_f64, share(fix))]
    });
    let chart = Chart {
        title: "Called lost after being carried off 1 m and 90°".into(),
        x: Axis::linear("fixes since", 0.0..f64::from(SHOWN)),
        y: Axis::linear("robots (%)", 0.0..104.0),
        height: HEIGHT,
        layers: vec![
            Layer {
                label: "to be reached",
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
