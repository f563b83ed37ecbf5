//! Diagnostics and calibration as messages.

use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::units::Metres;
use sonarfix::health::{Health, Mismatch, Verdict};
use sonarfix::localizer::{Fix, Mode};
use sonarfix_ros_messages::messages::{DiagnosticArray, DiagnosticStatus, KeyValue};

use crate::problem::{Nanoseconds, Problem, Problems};
use crate::timeline::Heard;
use crate::view::header;

/// Everything is as it should be.
pub const OK: u8 = 0;
/// `diagnostic_msgs/DiagnosticStatus`'s further levels.
const WARN: u8 = 1;
const ERROR: u8 = 2;
/// How long a problem raises the level, nanoseconds.
const RECENT: Nanoseconds = 5_000_000_000;

/// Time without a range that is reported, seconds.
const SILENCE: f64 = 5.0;

/// The outcomes of the pings of one ranger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Outcomes {
    accepted: u64,
    downweighted: u64,
    gated: u64,
    refused: u64,
    without_wall: u64,
}

impl Outcomes {
    /// Counts an outcome.
    pub fn add(&mut self, heard: &Heard) {
        *match heard.fix {
            Some(Fix::Accepted(_)) => &mut self.accepted,
            Some(Fix::Downweighted(_)) => &mut self.downweighted,
            Some(Fix::Gated(_)) => &mut self.gated,
            Some(_) => &mut self.refused,
            None => &mut self.without_wall,
        } += 1;
    }

    /// Ranges that have corrected the estimate.
    #[must_use]
    pub fn used(&self) -> u64 {
        self.accepted + self.downweighted
    }

    fn values(&self) -> Vec<KeyValue> {
        [
            ("accepted", self.accepted),
            ("downweighted", self.downweighted),
            ("gated", self.gated),
            ("refused", self.refused),
            ("without_wall", self.without_wall),
        ]
        .map(|(key, count)| value(key, count))
        .into()
    }
}

/// A key with its value.
pub fn value(key: &str, value: impl std::fmt::Display) -> KeyValue {
    KeyValue { key: key.to_owned(), value: value.to_string() }
}

/// The name of a verdict.
#[must_use]
pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Tracking => "tracking",
        Verdict::Degraded => "degraded",
        Verdict::Lost => "lost",
    }
}

/// The name of a mode.
#[must_use]
pub fn mode(mode: Mode) -> &'static str {
    match mode {
        Mode::Tracking => "tracking",
        Mode::Searching => "searching",
        Mode::Provisional => "provisional",
    }
}

/// A status.
#[must_use]
pub fn status(level: u8, name: &str, message: &str, values: Vec<KeyValue>) -> DiagnosticStatus {
    let hardware_id = "sonarfix".to_owned();
    DiagnosticStatus {
        level,
        name: format!("sonarfix: {name}"),
        message: message.to_owned(),
        hardware_id,
        values,
    }
}

/// The status of the estimate; without one, what it waits for.
#[must_use]
pub fn localization(
    found: Option<(Health, Mode, Option<Mismatch>)>,
    waits_for: &str,
) -> DiagnosticStatus {
    let Some((health, of, mismatch)) = found else {
        return status(
            ERROR,
            "localization",
            &format!("no pose: waits for {waits_for}"),
            Vec::new(),
        );
    };
    let level = match health.verdict {
        Verdict::Tracking if mismatch.is_none() => OK,
        Verdict::Tracking | Verdict::Degraded => WARN,
        Verdict::Lost => ERROR,
    };
    let values = vec![
        value("mode", mode(of)),
        value("evidence against the pose", health.evidence),
        value("mean NIS", health.nis),
        value("gated in a row", health.gated_in_a_row),
        value("silent in a row", health.silent_in_a_row),
        value("distance since the last used range, m", health.rolled_since_fix.0),
        value("deviation of the position, m", health.position_deviation.0),
        value("deviation of the heading, rad", health.heading_deviation.0),
    ];
    let verdict = verdict(health.verdict);
    let message = mismatch.map(|mismatch| format!("{verdict}; robot file: {mismatch}"));
    status(level, "localization", &message.unwrap_or_else(|| verdict.to_owned()), values)
}

/// The status of the inputs.
#[must_use]
pub fn inputs(problems: &Problems, now: Nanoseconds) -> DiagnosticStatus {
    let recent: Vec<&str> = problems.recent(now, RECENT).map(Problem::name).collect();
    let (level, message) =
        if recent.is_empty() { (OK, "no problem".to_owned()) } else { (WARN, recent.join(", ")) };
    status(level, "inputs", &message, problems.values())
}

/// The status of a ranger of which nothing was heard for so many seconds; `None`: never anything.
#[must_use]
pub fn ranger(number: usize, outcomes: &Outcomes, silent_for: Option<f64>) -> DiagnosticStatus {
    let name = format!("ranger {number}");
    let message = format!("{} ranges used", outcomes.used());
    match silent_for {
        Some(seconds) if seconds < SILENCE => status(OK, &name, &message, outcomes.values()),
        Some(seconds) => {
            let message = format!("no range for {seconds:.0} s: check its topic; {message}");
            status(WARN, &name, &message, outcomes.values())
        }
        None => status(WARN, &name, "no range yet: check range_topics", outcomes.values()),
    }
}

/// The statuses as a message.
#[must_use]
pub fn array(at: Nanoseconds, status: Vec<DiagnosticStatus>) -> DiagnosticArray {
    DiagnosticArray { header: header(at, ""), status }
}

/// The calibration of a robot with this nominal track width, with its standard deviations.
#[must_use]
pub fn calibration(
    nominal: Metres,
    state: &StateEstimate,
    deviation: &StandardDeviations,
    at: Nanoseconds,
) -> DiagnosticArray {
    let width = nominal + state.track_width_error;
    let values = vec![
        value("scale_right", state.scale_right),
        value("scale_right_deviation", deviation.scale_right),
        value("scale_left", state.scale_left),
        value("scale_left_deviation", deviation.scale_left),
        value("track_width_m", width.0),
        value("track_width_deviation_m", deviation.track_width_error.0),
        value("range_scale", state.range_scale),
        value("range_scale_deviation", deviation.range_scale),
    ];
    array(at, vec![status(OK, "calibration", "estimated while driving", values)])
}
