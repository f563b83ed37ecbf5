//! How exactly `calibrate` finds the noise of a simulated robot's wheels.

use std::fmt::Write as _;

use sonarfix_batch::calibrate::CalibrateError;
use sonarfix_batch::wheel_noise::{Estimated, Noisy};
use sonarfix_sim::progress::Progress;

use crate::floor_plan::compare::quantile;

use super::{CalibrationStudyError, Errors, From, Simulated, Variant, each_seed};

/// Largest relative error of a good estimate.
const LIMIT: f64 = 0.25;

/// The drives with one noise.
#[derive(Debug, Clone)]
pub struct Row {
    /// Distance driven, metres.
    pub metres: f64,
    /// True noise of each wheel, m/√m.
    pub truth: f64,
    /// The estimate of each drive, or the error.
    pub outcomes: Vec<Result<Estimated, CalibrateError>>,
}

/// Runs trials of robots that drive this far, metres, with wheels of this noise, m/√m; after an interruption those that have begun.
///
/// # Errors
/// [`CalibrationStudyError`].
pub fn trials(
    first: u64,
    count: u32,
    metres: f64,
    truth: f64,
    progress: &impl Progress,
) -> Result<Row, CalibrationStudyError> {
    let variant = Variant { wheel_noise: Some(truth), ..Variant::default() };
    let outcomes = each_seed(first, count, progress, |seed| {
        let robot = Simulated::new(seed, metres, Errors::BUILDER, variant)?;
        Ok(robot.calibrated(From::Start).map(|found| found.wheel_noise))
    })?;
    Ok(Row { metres, truth, outcomes })
}

/// The page's table: for each noise the median estimate, and the share of the drives within the limit and inside the intervals.
#[must_use]
pub fn page(rows: &[Row]) -> String {
    let mut page = String::from(
        "| driven | true noise | median estimate | within 25 % | inside its 95 % interval | of the distance | of the turns | \
         refused |\n|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let found: Vec<&Estimated> =
            row.outcomes.iter().filter_map(|of| of.as_ref().ok()).collect();
        let truth = row.truth;
        let of_wheels: Vec<f64> = found.iter().map(|found| found.wheel.value).collect();
        let within = share(&of_wheels, |value| (value / truth - 1.0).abs() <= LIMIT);
        let inside = |of: fn(&Estimated) -> Noisy| {
            share(&found, |found| {
                let [least, most] = of(found).interval();
                (least..=most).contains(&truth)
            })
        };
        let _ = writeln!(
            page,
            "| {:.0} m | {:.1} mm/√m | {:.2} mm/√m | {within:.1} % | {:.1} % | {:.1} % | {:.1} % | {} of {} |",
            row.metres,
            1e3 * truth,
            1e3 * quantile(of_wheels, 0.5),
            inside(|found| found.wheel),
            inside(|found| found.distance),
            inside(|found| found.turn),
            row.outcomes.len() - found.len(),
            row.outcomes.len(),
        );
    }
    page
}

/// Share of the values with a property, per cent.
fn share<T>(values: &[T], has: impl Fn(&T) -> bool) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "numbers of robots")]
    let (part, all) =
        (values.iter().filter(|value| has(value)).count() as f64, values.len().max(1) as f64);
    100.0 * part / all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_count_estimates_and_refusals_apart() {
        let noisy = |value: f64| Noisy { value, deviation: 0.1 };
        let found = |value: f64| {
            Ok(Estimated { wheel: noisy(value), distance: noisy(value), turn: noisy(2.0 * value) })
        };
        let outcomes =
            vec![found(0.006), found(0.0067), found(0.009), Err(CalibrateError::NothingMeasured)];
        let page = page(&[Row { metres: 60.0, truth: 0.006, outcomes }]);
        let row = "| 60 m | 6.0 mm/√m | 6.70 mm/√m | 66.7 % | 66.7 % | 66.7 % | 0.0 % | 1 of 4 |";
        assert_eq!(page.lines().nth(2), Some(row));
    }

    /// 20 m determine the noise to about a tenth.
    #[test]
    fn the_noise_of_simulated_wheels_is_found() {
        for truth in [0.002, 0.02] {
            let row = trials(360_100, 1, 20.0, truth, &|| ()).unwrap();
            for outcome in row.outcomes {
                let found = outcome.unwrap().wheel;
                assert!((found.value / truth - 1.0).abs() < 0.4, "{truth}: {found:?}");
            }
        }
    }
}
