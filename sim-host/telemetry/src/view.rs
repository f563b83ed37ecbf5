//! The latest telemetry as text.

use sonarfix::geometry::units::Instant;
use sonarfix::health::{LOST_AT, Verdict};
use sonarfix::localizer::{AbsoluteFix, Fix, GyroStatus, TurnUse};
use sonarfix::map::WallId;
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_hal::robot::{AbsoluteResult, Faults};
use sonarfix_link::message::{
    GyroState, ImageStatus, LoopStatus, RankedHypothesis, ResetCause, SearchAnswer, SearchStatus,
};
use sonarfix_link::{Estimate, Hello, Ping};
use sonarfix_search::navigator::Mode;
use sonarfix_sim::text::wrapped;

use crate::Monitor;
use crate::hints::hints;

/// Columns of a subject's name.
const INDENT: usize = 8;

/// Lines of the telemetry about one subject.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Subject {
    /// How much it matters, from 0, the most: a small screen leaves out the others first.
    pub rank: u8,
    /// Its text, one or more lines.
    pub text: String,
}

/// All telemetry, in the order of a page. `walls` has the names of the map's walls; without them walls have numbers.
#[must_use]
pub fn subjects(monitor: &Monitor, walls: &[String]) -> Vec<Subject> {
    let subject = |rank, text| Subject { rank, text };
    let mut all =
        vec![subject(2, monitor.hello.as_ref().map_or("robot   none yet".to_owned(), hello))];
    match &monitor.estimate {
        None => all.push(subject(0, "pose    none yet".to_owned())),
        Some(estimate) => {
            let [pose, wheels, sonar, health, cycles] = estimated(estimate);
            for (rank, text) in [(0, pose), (3, wheels), (4, sonar), (0, health), (4, cycles)] {
                all.push(subject(rank, text));
            }
        }
    }
    match &monitor.ping {
        None => all.push(subject(0, "ping    none yet".to_owned())),
        Some(last) => {
            all.extend([subject(0, ping(last, walls)), subject(2, pings(monitor))]);
        }
    }
    all.push(subject(1, monitor.state.as_ref().map_or("loop    none yet".to_owned(), state)));
    all.push(subject(2, link(monitor)));
    all.extend(monitor.gyro.as_ref().map(|it| subject(3, gyro(it))));
    all.extend(monitor.absolute.as_ref().map(|it| subject(3, absolute(it))));
    if monitor.mode != Mode::Tracking {
        all.extend(monitor.search.as_ref().map(|status| subject(0, search(status, walls))));
        let hypotheses = (0..).zip(&monitor.hypotheses);
        all.extend(hypotheses.map(|(place, it)| subject(place, hypothesis(it))));
    }
    let hints = (0..).zip(hints(monitor));
    all.extend(hints.map(|(place, hint)| subject(place.min(1), format!("check   {hint}"))));
    all
}

/// All telemetry, one line per subject, of at most 100 characters.
#[must_use]
pub fn page(monitor: &Monitor, walls: &[String]) -> String {
    let lines: Vec<_> = subjects(monitor, walls).into_iter().map(|it| it.text).collect();
    lines.join("\n")
}

/// The telemetry on a screen of this size: lines are wrapped, and what matters least is left out if not all fits.
#[must_use]
pub fn fitted(monitor: &Monitor, walls: &[String], width: usize, height: usize) -> Vec<String> {
    let wrap = |it: Subject| (it.rank, wrapped(&it.text, width, INDENT));
    let all: Vec<_> = subjects(monitor, walls).into_iter().map(wrap).collect();
    let rows = |of: &[usize]| -> usize {
        of.iter().filter_map(|&index| all.get(index)).map(|(_, lines)| lines.len()).sum()
    };
    let mut order: Vec<usize> = (0..all.len()).collect();
    let is_whole = rows(&order) <= height;
    order.sort_by_key(|&index| all.get(index).map(|(rank, _)| *rank));
    let mut kept = Vec::new();
    for index in order {
        kept.push(index);
        // One row states that something is left out.
        if rows(&kept) > height.saturating_sub(usize::from(!is_whole)) {
            kept.pop();
        }
    }
    kept.sort_unstable();
    let left_out = all.len() - kept.len();
    let mut shown: Vec<String> = kept
        .iter()
        .filter_map(|&index| all.get(index))
        .flat_map(|(_, lines)| lines.clone())
        .collect();
    if left_out > 0 {
        shown.push(format!("        {left_out} more lines on a larger terminal"));
    }
    shown
}

/// The estimate in one line.
#[must_use]
pub fn line(monitor: &Monitor, walls: &[String]) -> String {
    let lost = monitor.gaps.lost();
    let link = format!("{} frames, {lost} lost", monitor.counters().frames);
    match &monitor.estimate {
        None => format!("no estimate yet; {link}"),
        Some(e) if monitor.mode == Mode::Searching => {
            let answer =
                monitor.search.as_ref().map_or(String::new(), |status| search(status, walls));
            format!("{:.1} s: pose unknown; {answer}; {link}", seconds(e.at))
        }
        Some(e) => {
            let (s, verdict) = (&e.state, verdict(e.health.verdict));
            let heading = s.heading.to_degrees();
            format!(
                "{:.1} s: x {:.3} m, y {:.3} m, heading {heading:.1}°, {verdict}; {link}",
                seconds(e.at),
                s.x.0,
                s.y.0
            )
        }
    }
}

/// A wall by its name; by its number if that is unknown.
fn wall(id: WallId, walls: &[String]) -> String {
    let name = usize::try_from(id.0).ok().and_then(|index| walls.get(index));
    name.map_or_else(|| format!("wall {}", id.0), |name| format!("wall {name}"))
}

/// The progress of the search.
#[must_use]
pub fn search(status: &SearchStatus, walls: &[String]) -> String {
    let mode = match status.mode {
        Mode::Tracking => "tracking",
        Mode::Searching => "searching",
        Mode::Provisional => "pose provisional",
    };
    let answer = match status.answer {
        SearchAnswer::Searching => "no answer yet".to_owned(),
        SearchAnswer::Several(count) => format!("{count} poses fit"),
        SearchAnswer::Along(id) => format!("somewhere along {}", wall(id, walls)),
        SearchAnswer::Nowhere => "no pose fits".to_owned(),
        SearchAnswer::Unique => "one pose fits".to_owned(),
    };
    format!("search  {mode}: {answer}; {} pings, {} cycles", status.pings, status.cycles)
}

fn hypothesis(hypothesis: &RankedHypothesis) -> String {
    let (pose, fit) = (&hypothesis.pose, hypothesis.fit);
    format!(
        "   {}    x {:.2} m, y {:.2} m ± {:.2} m, heading {:.0}° ± {:.0}°, fit {fit:.2}, {:.0} % explained",
        hypothesis.rank + 1,
        pose.x.0,
        pose.y.0,
        hypothesis.position_deviation.0,
        pose.heading.radians().to_degrees(),
        hypothesis.heading_deviation.to_degrees(),
        100.0 * hypothesis.explained,
    )
}

/// Firmware version, cause of the reset and images in flash.
#[must_use]
pub fn hello(hello: &Hello) -> String {
    let [major, minor, patch] = hello.firmware;
    let reset = reset(hello.reset);
    let (map, configuration) = (flashed(hello.map), flashed(hello.configuration));
    format!(
        "robot   {major}.{minor}.{patch}, started by {reset}; map {map}, configuration {configuration}"
    )
}

/// The cause of a reset.
#[must_use]
pub fn reset(cause: ResetCause) -> &'static str {
    match cause {
        ResetCause::PowerOn => "power on",
        ResetCause::BrownOut => "a brown-out",
        ResetCause::Pin => "the reset pin",
        ResetCause::Watchdog => "the watchdog",
        ResetCause::Software => "the firmware",
        ResetCause::Unknown => "a reset of unknown cause",
    }
}

/// The status of an image in flash.
#[must_use]
pub fn flashed(flashed: ImageStatus) -> String {
    match flashed {
        ImageStatus::Valid(checksum) => format!("{checksum:08x}"),
        ImageStatus::Missing => "missing".to_owned(),
        ImageStatus::Corrupt => "corrupt".to_owned(),
        ImageStatus::Version(found) => {
            format!("of unsupported version {found}")
        }
    }
}

/// Pose, wheels, range scale, health and cycles.
fn estimated(e: &Estimate) -> [String; 5] {
    let (s, d, h) = (&e.state, &e.deviation, &e.health);
    let mm = |metres: f32| 1e3 * metres;
    let percent = |fraction: f32| 100.0 * fraction;
    [
        format!(
            "pose    x {:.3} m ± {:.1} mm, y {:.3} m ± {:.1} mm, heading {:.2}° ± {:.2}°, at {:.1} s",
            s.x.0,
            mm(d.x.0),
            s.y.0,
            mm(d.y.0),
            s.heading.to_degrees(),
            d.heading.to_degrees(),
            seconds(e.at),
        ),
        format!(
            "wheels  S_R {:+.3} ± {:.3} %, S_L {:+.3} ± {:.3} %, track width {:+.2} ± {:.2} mm",
            percent(s.scale_right),
            percent(d.scale_right),
            percent(s.scale_left),
            percent(d.scale_left),
            mm(s.track_width_error.0),
            mm(d.track_width_error.0),
        ),
        format!(
            "sonar   range scale {:+.3} ± {:.3} %",
            percent(s.range_scale),
            percent(d.range_scale)
        ),
        format!(
            "health  {}: evidence {:.1} of {LOST_AT}, NIS {:.1}; last accepted range {:.1} m and {:.1} s ago",
            verdict(h.verdict),
            h.evidence,
            h.nis,
            h.rolled_since_fix.0,
            seconds(Instant::from_ticks(h.time_since_fix.ticks())),
        ),
        format!(
            "cycles  in a row {} accepted, {} gated, {} silent; {} inflations",
            h.accepted_in_a_row, h.gated_in_a_row, h.silent_in_a_row, h.inflations,
        ),
    ]
}

fn ping(ping: &Ping, walls: &[String]) -> String {
    let range = match ping.outcome {
        Ok(echo) => format!("{:.3} m", echo.range.0),
        Err(reason) => reason.to_string(),
    };
    let fix = match ping.fix {
        Fix::Accepted(i) => format!("accepted, innovation {:+.1} mm", 1e3 * i.value.0),
        Fix::Downweighted(i) => format!("downweighted, innovation {:+.1} mm", 1e3 * i.value.0),
        Fix::Gated(i) => format!("gated, innovation {:+.1} mm", 1e3 * i.value.0),
        Fix::Refused(reason) => format!("refused, {reason}"),
        other => format!("{other:?}"),
    };
    let (wall, bearing) = (wall(ping.aim.wall, walls), ping.aim.bearing.0.to_degrees());
    format!("ping    {wall} at {bearing:.1}°: {range}; {fix}")
}

fn pings(monitor: &Monitor) -> String {
    let f = &monitor.fixes;
    format!("pings   {} accepted, {} gated, {} refused", f.accepted, f.gated, f.refused)
}

fn state(state: &LoopStatus) -> String {
    let running = if state.running { "running" } else { "waiting" };
    let f = &state.faults;
    let flash = match state.flash.failures {
        0 => String::new(),
        failures => format!("; flash: {failures} writes failed, what changes is lost at power off"),
    };
    format!(
        "loop    {running}, {} deadlines missed, longest poll {} µs; faults: {}{flash}",
        f.deadlines,
        state.worst_poll.to_micros(),
        faults(f),
    )
}

fn gyro(gyro: &GyroState) -> String {
    let GyroStatus { bias, deviation, latest, slips, conflicts, .. } = gyro.status;
    let latest = match latest {
        TurnUse::Missing => "no turn: wheels alone",
        TurnUse::Refused(_) => "turn refused: wheels alone",
        TurnUse::Standing => "standing",
        TurnUse::Combined => "combined with the wheels",
        TurnUse::WheelSlip => "a wheel slips",
        _ => "",
    };
    format!(
        "gyro    bias {:.3}°/s ± {:.3}°/s, {latest}; {slips} slips, {conflicts} conflicts with the wheels",
        bias.to_degrees(),
        deviation.to_degrees(),
    )
}

/// A heading, position or pose from outside, and what the localizer did with it.
#[must_use]
pub fn absolute(result: &AbsoluteResult) -> String {
    let age = seconds(result.at) - seconds(result.measured_at);
    let value = match result.measurement {
        AbsoluteMeasurement::Heading { angle, .. } => format!("heading {:.1}°", angle.to_degrees()),
        AbsoluteMeasurement::Position { point, .. } => {
            format!("x {:.3} m, y {:.3} m", point.x.0, point.y.0)
        }
        AbsoluteMeasurement::Pose { pose, .. } => {
            let heading = pose.heading.radians().to_degrees();
            format!("x {:.3} m, y {:.3} m, heading {heading:.1}°", pose.x.0, pose.y.0)
        }
    };
    let outcome = match result.fix {
        AbsoluteFix::Accepted(_) => "accepted".to_owned(),
        AbsoluteFix::Downweighted(_) => "downweighted".to_owned(),
        AbsoluteFix::Gated(_) => "gated".to_owned(),
        AbsoluteFix::Refused(reason) => format!("refused: {reason}"),
        _ => String::new(),
    };
    format!("outside {value}, measured {age:.3} s before, {outcome}")
}

fn faults(f: &Faults) -> String {
    let counts = [
        ("right encoder", f.right.errors.saturating_add(f.right.illegal)),
        ("left encoder", f.left.errors.saturating_add(f.left.illegal)),
        ("servo", f.servo),
        ("ranger", f.ranger),
        ("travel", f.travel),
        ("clock", f.clock),
        ("gyro", f.gyro),
    ];
    let nonzero: Vec<_> = counts
        .into_iter()
        .filter(|(_, count)| *count > 0)
        .map(|(name, count)| format!("{name} {count}"))
        .collect();
    if nonzero.is_empty() { "none".to_owned() } else { nonzero.join(", ") }
}

fn link(monitor: &Monitor) -> String {
    let (c, gaps) = (monitor.counters(), monitor.gaps);
    format!(
        "link    {} frames, {} lost, {} restarts; skipped: {} corrupt, {} too long, {} foreign, {} undecodable",
        c.frames,
        gaps.lost(),
        gaps.restarts(),
        c.corrupt,
        c.too_long,
        c.foreign,
        c.undecodable,
    )
}

/// The health verdict in a word.
#[must_use]
pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Tracking => "tracking",
        Verdict::Degraded => "degraded",
        Verdict::Lost => "lost",
    }
}

#[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs, 285 years")]
fn seconds(at: Instant) -> f64 {
    at.ticks() as f64 * 1e-6
}
