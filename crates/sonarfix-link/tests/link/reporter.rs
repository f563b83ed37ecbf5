//! What of a poll's report becomes telemetry.

use sonarfix::aim::NoAim;
use sonarfix::config::Config;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Mode, Start};
use sonarfix::map::Map;
use sonarfix_hal::robot::{Report, Tick};
use sonarfix_link::{Reporter, Telemetry};

/// A report without messages need not be sent, and no message is lost by that, also if a mode changes while a wall is chosen.
#[test]
fn a_report_has_messages_if_and_only_if_it_says_so() {
    let start = Start {
        pose: Pose::new(1.0, 1.0, Radians(0.0)),
        position_deviation: Metres(0.1),
        heading_deviation: Radians(0.1),
    };
    let config = Config::for_track_width(Metres(0.16));
    let now = Instant::from_ticks(0);
    let localizer = Localizer::new(config, Map::new(&[]), start, now).unwrap();
    let none = Report::default();
    let mode = Some(Mode::Provisional);
    let lateness = Duration::from_ticks(0);
    let tick = Some(Tick { step: None, lateness, held: false, skipped: 0 });
    let cases = [
        (none, 0),
        (Report { is_choosing: true, ..none }, 0),
        (Report { is_choosing: true, mode, ..none }, 1),
        (Report { mode, ..none }, 1),
        (Report { tick, ..none }, 1),
        (Report { aimed: Some(Err(NoAim::NoWall)), ..none }, 1),
        (Report { tick, mode, ..none }, 2),
    ];
    for (report, expected) in cases {
        let (mut reporter, _) = Reporter::begin(&localizer);
        let mut count = 0;
        reporter.report(&report, &localizer, &mut |_: &Telemetry| count += 1);
        assert_eq!(
            (count, Reporter::has_messages(&report)),
            (expected, expected > 0),
            "{report:?}"
        );
    }
}
