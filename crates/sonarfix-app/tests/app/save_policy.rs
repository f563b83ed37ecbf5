//! When a running robot writes its calibration.

use sonarfix::config::Config;
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::units::Instant;
use sonarfix::localizer::Localizer;
use sonarfix::map::Map;
use sonarfix_app::store::{Resumed, SavePolicy};

use crate::rig::config;

/// A localizer whose track width has this ratio of its deviation to the written one.
fn localizer(config: &Config, share: f32) -> (Localizer<'static>, StandardDeviations) {
    let written = Resumed::afresh(config).deviation;
    let track_width_error = written.track_width_error * share;
    let better = StandardDeviations { track_width_error, ..written };
    let start = Instant::from_ticks(0);
    let localizer =
        Localizer::resume(*config, Map::new(&[]), StateEstimate::default(), better, start);
    (localizer.unwrap(), written)
}

fn at(seconds: u64) -> Instant {
    Instant::from_ticks(seconds * 1_000_000)
}

#[test]
fn an_improvement_by_a_fifth_is_written_in_a_pause_after_a_minute() {
    let (localizer, written) = localizer(&config().localizer, 0.7);
    let mut save_policy = SavePolicy::new(at(0), written);
    assert!(!save_policy.is_due(at(59), &localizer), "the last record is less than a minute old");
    assert!(save_policy.is_due(at(60), &localizer));
    save_policy.rolled(at(60));
    assert!(!save_policy.is_due(at(61), &localizer), "the wheels have just rolled");
    assert!(save_policy.is_due(at(62), &localizer));
    save_policy.wrote(at(62), localizer.filter().standard_deviations());
    assert!(!save_policy.is_due(at(1_000), &localizer), "the calibration has not improved");
}

#[test]
fn a_small_improvement_is_not_written() {
    let (localizer, written) = localizer(&config().localizer, 0.9);
    assert!(!SavePolicy::new(at(0), written).is_due(at(1_000), &localizer));
}

#[test]
fn a_robot_that_does_not_track_writes_nothing() {
    let (mut localizer, written) = localizer(&config().localizer, 0.5);
    for _ in 0..10 {
        localizer.skip();
    }
    assert!(!SavePolicy::new(at(0), written).is_due(at(1_000), &localizer));
}
