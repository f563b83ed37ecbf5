//! The simulated NXT sonar against the recorded one.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use sonarfix_map::devices::NXT_ECHO;
use sonarfix_sim::world::sensor::SensorModel;
use sonarfix_studies::sonar_model::echo_fit::EchoFit;
use sonarfix_studies::sonar_model::{Comparison, compare, page};

use crate::skipped;

fn nxt() -> Option<Comparison> {
    skipped::unless_recorded("nxt_rotating_sonar")
        .map(|folder| compare(&folder, &SensorModel::nxt()).unwrap())
}

#[test]
fn the_nxt_model_matches_the_sensor() {
    let Some(comparison) = nxt() else {
        return;
    };
    // The fit reached 0.039 (docs/sonar-model.md).
    let apart = page::mean_difference(&comparison);
    assert!(apart < 0.045, "{apart}");
    // The cells relevant for a localizer, which aims within 15° of the normal.
    let rows = comparison.measured.rows().iter().zip(comparison.simulated.rows()).take(3);
    for (measured, simulated) in rows {
        for (real, ours) in measured.iter().zip(simulated) {
            let (real, ours) = (real.shares().unwrap(), ours.shares().unwrap());
            let perpendicular = (real[0] - ours[0]).abs();
            assert!(perpendicular < 0.1, "{real:?} {ours:?}");
        }
    }
}

/// The preset is the fit, rounded to 0.01 and to a millimetre.
#[test]
fn the_echo_parameters_of_the_nxt_are_fitted() {
    let Some(comparison) = nxt() else {
        return;
    };
    let fit = EchoFit::of(&comparison.measured);
    let preset = [NXT_ECHO.missed, NXT_ECHO.short, NXT_ECHO.long].map(f64::from);
    for (fit, preset) in fit.far.into_iter().zip(preset) {
        assert!((fit - preset).abs() <= 0.0051, "{fit} {preset}");
    }
    let [near, ..] = fit.systematic;
    assert!((near - f64::from(NXT_ECHO.map_accuracy.0)).abs() <= 0.000_51, "{near}");
}

#[test]
fn an_ideal_sonar_differs_from_the_real_one() {
    let Some(folder) = skipped::unless_recorded("nxt_rotating_sonar") else {
        return;
    };
    let scenario = sonarfix_map::Scenario::paper().unwrap();
    let ideal = compare(&folder, &SensorModel::ideal(&scenario)).unwrap();
    let apart = page::mean_difference(&ideal);
    assert!(apart > 0.1, "the comparison finds no difference: {apart}");
}

#[test]
fn the_committed_page_is_current() {
    let Some(comparison) = nxt() else {
        return;
    };
    let committed = include_str!("../../../docs/sonar-model.md");
    assert_eq!(page::markdown(&comparison), committed, "run `sonarfix-studies sonar-model` again");
}
