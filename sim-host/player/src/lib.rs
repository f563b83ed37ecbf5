//! The data of the player: a run as columns of rounded numbers, as JSON.
//!
//! The pages of a report and of the playground draw it. This package compiles for `wasm32-unknown-unknown`.

use serde::Serialize;

use sonarfix::health::Verdict;
use sonarfix_map::Oscillation;
use sonarfix_sim::trace::{
    AbsoluteRecord, FixRecord, GyroEstimate, Hypothesis, Outcome, Pose, SearchRecord, Tick, Trace,
};
use sonarfix_sim::world::obstacle::Outline;
use sonarfix_sim::world::reflector::Source;

/// Maximum number of ticks for the player, which interpolates between them: one every 0.3 s in a
/// run of 20 minutes, in which a robot at 0.4 m/s moves 0.12 m.
const MOST_TICKS: usize = 6_000;

/// Maximum number of records of the search.
const MOST_SEARCHES: usize = 400;

/// Decimals of metres and seconds (0.1 mm), of angles (0.006°) and of dimensionless fractions.
const LENGTH: i32 = 4;
const TIME: i32 = 3;
const ANGLE: i32 = 4;
const FRACTION: i32 = 3;
/// Decimals of deviations, which the player may magnify (1 µm, 0.0006°).
const DEVIATION: i32 = 6;

/// Index of the deviation of the heading in [`sonarfix_sim::STATES`].
const HEADING: usize = 2;

/// A rounded number; `null` if it is not finite.
type Number = Option<f64>;

#[derive(Serialize)]
struct Player<'a> {
    /// Half of the sonar's cone, radians.
    cone: Number,
    /// Track width of the robot, metres.
    track: Number,
    walls: Vec<Wall<'a>>,
    obstacles: Vec<Obstacle>,
    ticks: Ticks,
    fixes: Fixes<'a>,
    gyro: Gyro,
    absolutes: Absolutes<'a>,
    searches: Vec<Search>,
}

/// The gyro; empty for a robot without one.
#[derive(Serialize, Default)]
struct Gyro {
    time: Vec<Number>,
    /// Bias and its deviation, radians per second.
    bias: Vec<Number>,
    sigma: Vec<Number>,
    slips: Vec<u32>,
}

/// Headings, positions and poses from outside.
#[derive(Serialize, Default)]
struct Absolutes<'a> {
    time: Vec<Number>,
    x: Vec<Number>,
    y: Vec<Number>,
    heading: Vec<Number>,
    /// 0 accepted, 1 gated, 2 refused.
    outcome: Vec<u8>,
    reason: Vec<&'a str>,
    /// The root of its NIS over the number of dimensions.
    sigmas: Vec<Number>,
}

/// The search at one instant.
#[derive(Serialize)]
struct Search {
    time: Number,
    provisional: bool,
    /// x, y, heading and weight of each hypothesis.
    hypotheses: Vec<[Number; 4]>,
    /// x and y of the sonar, and of the echo; `null` without one.
    pings: Vec<[Number; 4]>,
    /// x and y of both ends.
    lines: Vec<[Number; 4]>,
}

#[derive(Serialize)]
struct Wall<'a> {
    name: &'a str,
    ends: [Number; 4],
}

/// An unmapped obstacle: a circle or a face.
#[derive(Serialize)]
struct Obstacle {
    /// x, y and radius.
    circle: Option<[Number; 3]>,
    /// x and y of both ends.
    face: Option<[Number; 4]>,
    /// Displacement in x and y to the turning point of its walk, and the seconds in one direction.
    walk: Option<[Number; 3]>,
}

#[derive(Serialize, Default)]
struct Ticks {
    time: Vec<Number>,
    truth: Poses,
    estimate: Poses,
    encoders: Poses,
    sigma_x: Vec<Number>,
    sigma_y: Vec<Number>,
    sigma_heading: Vec<Number>,
    correlation: Vec<Number>,
    /// 0 tracking, 1 degraded, 2 lost.
    verdict: Vec<u8>,
}

#[derive(Serialize, Default)]
struct Poses {
    x: Vec<Number>,
    y: Vec<Number>,
    heading: Vec<Number>,
}

#[derive(Serialize, Default)]
struct Fixes<'a> {
    time: Vec<Number>,
    wall: Vec<Option<usize>>,
    x: Vec<Number>,
    y: Vec<Number>,
    direction: Vec<Number>,
    range: Vec<Number>,
    /// The source of the echo; `null` without an echo or where it is unknown.
    source: Vec<Option<&'static str>>,
    /// 0 accepted, 1 gated, 2 refused.
    outcome: Vec<u8>,
    reason: Vec<&'a str>,
    innovation: Vec<Number>,
    /// Standard deviation of the innovation, metres.
    spread: Vec<Number>,
}

/// One record in the columns of the player, for a page to which records arrive one by one.
pub mod columns {
    use serde::Serialize;
    use sonarfix_sim::trace::{AbsoluteRecord, FixRecord, GyroEstimate, SearchRecord, Tick};
    use sonarfix_sim::world::obstacle::Obstacle;

    use super::{Absolutes, Fixes, Gyro, Ticks};

    /// The unmapped obstacles.
    #[must_use]
    pub fn obstacles(obstacles: &[Obstacle]) -> impl Serialize {
        obstacles.iter().map(super::obstacle).collect::<Vec<_>>()
    }

    /// An encoder tick.
    #[must_use]
    pub fn tick(tick: &Tick) -> impl Serialize {
        let mut columns = Ticks::default();
        columns.push(tick);
        columns
    }

    /// A measurement cycle.
    #[must_use]
    pub fn fix(fix: &FixRecord) -> impl Serialize {
        let mut columns = Fixes::default();
        columns.push(fix);
        columns
    }

    /// A gyro at a time, seconds.
    #[must_use]
    pub fn gyro(time: f64, gyro: &GyroEstimate) -> impl Serialize {
        let mut columns = Gyro::default();
        columns.push(time, gyro);
        columns
    }

    /// A heading, position or pose from outside.
    #[must_use]
    pub fn absolute(absolute: &AbsoluteRecord) -> impl Serialize {
        let mut columns = Absolutes::default();
        columns.push(absolute);
        columns
    }

    /// The state of the search.
    #[must_use]
    pub fn search(record: &SearchRecord) -> impl Serialize {
        [super::search(record)]
    }
}

/// The data of the player as JSON, not yet escaped for HTML.
///
/// # Errors
/// Those of the serializer.
pub fn json(trace: &Trace) -> Result<String, serde_json::Error> {
    let walls = trace.walls.iter().map(|wall| {
        let [[x0, y0], [x1, y1]] = [wall.from, wall.to];
        Wall { name: &wall.name, ends: [x0, y0, x1, y1].map(|end| rounded(end, LENGTH)) }
    });
    let track = trace.ticks.first().map(|tick| tick.estimate.calibration.track_width);
    serde_json::to_string(&Player {
        cone: rounded(trace.cone, ANGLE),
        track: track.and_then(|track| rounded(track, LENGTH)),
        walls: walls.collect(),
        obstacles: trace.obstacles.iter().map(obstacle).collect(),
        ticks: ticks(trace),
        fixes: fixes(trace),
        gyro: gyro(trace),
        absolutes: absolutes(trace),
        searches: searches(trace),
    })
}

fn obstacle(of: &sonarfix_sim::world::obstacle::Obstacle) -> Obstacle {
    let (circle, face) = match of.outline {
        Outline::Circle { centre: [x, y], radius } => (Some([x, y, radius]), None),
        Outline::Face(face) => {
            let [[x0, y0], [x1, y1]] = face.ends();
            (None, Some([x0, y0, x1, y1]))
        }
    };
    Obstacle {
        circle: circle.map(|numbers| numbers.map(|number| rounded(number, LENGTH))),
        face: face.map(|numbers| numbers.map(|number| rounded(number, LENGTH))),
        walk: of.walk.map(|Oscillation { by: [x, y], takes }| {
            [x, y, takes].map(|number| rounded(number, LENGTH))
        }),
    }
}

/// Every n-th record of the search, and those at which a pose is handed over.
fn searches(trace: &Trace) -> Vec<Search> {
    let step = trace.searches.len().div_ceil(MOST_SEARCHES).max(1);
    let mut was_provisional = false;
    let mut kept = Vec::new();
    for (index, record) in trace.searches.iter().enumerate() {
        let is_decision = record.is_provisional && !was_provisional;
        was_provisional = record.is_provisional;
        if index % step == 0 || is_decision {
            kept.push(search(record));
        }
    }
    kept
}

fn search(record: &SearchRecord) -> Search {
    let four = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a, b, c, d].map(|v| rounded(v, LENGTH));
    let hypothesis = |found: &Hypothesis| {
        let Pose { x, y, heading } = found.pose;
        let (x, y) = (rounded(x, LENGTH), rounded(y, LENGTH));
        [x, y, rounded(heading, ANGLE), rounded(found.weight, FRACTION)]
    };
    let ping = |(at, echo): &([f64; 2], Option<[f64; 2]>)| four(*at, echo.unwrap_or([f64::NAN; 2]));
    Search {
        time: rounded(record.time, TIME),
        provisional: record.is_provisional,
        hypotheses: record.hypotheses.iter().map(hypothesis).collect(),
        pings: record.pings.iter().map(ping).collect(),
        lines: record.lines.iter().map(|[from, to]| four(*from, *to)).collect(),
    }
}

/// Every n-th tick, and the last.
fn thinned(trace: &Trace) -> impl Iterator<Item = &Tick> {
    let step = trace.ticks.len().div_ceil(MOST_TICKS).max(1);
    let last = trace.ticks.len().saturating_sub(1);
    let ticks = trace.ticks.iter().enumerate();
    ticks.filter(move |(index, _)| index % step == 0 || *index == last).map(|(_, tick)| tick)
}

fn ticks(trace: &Trace) -> Ticks {
    let mut columns = Ticks::default();
    thinned(trace).for_each(|tick| columns.push(tick));
    columns
}

fn gyro(trace: &Trace) -> Gyro {
    let mut columns = Gyro::default();
    for tick in thinned(trace) {
        if let Some(gyro) = &tick.estimate.gyro {
            columns.push(tick.time, gyro);
        }
    }
    columns
}

impl Gyro {
    fn push(&mut self, time: f64, gyro: &GyroEstimate) {
        self.time.push(rounded(time, TIME));
        self.bias.push(rounded(gyro.bias, DEVIATION));
        self.sigma.push(rounded(gyro.deviation, DEVIATION));
        self.slips.push(gyro.slips);
    }
}

fn absolutes(trace: &Trace) -> Absolutes<'_> {
    let mut columns = Absolutes::default();
    for absolute in &trace.absolutes {
        columns.push(absolute);
    }
    columns
}

impl<'a> Absolutes<'a> {
    fn push(&mut self, of: &'a AbsoluteRecord) {
        let [x, y] = of.position.unwrap_or([f64::NAN; 2]);
        self.time.push(rounded(of.time, TIME));
        self.x.push(rounded(x, LENGTH));
        self.y.push(rounded(y, LENGTH));
        self.heading.push(of.heading.and_then(|heading| rounded(heading, ANGLE)));
        self.outcome.push(outcome(of.outcome));
        self.reason.push(reason(of.outcome, &of.reason));
        self.sigmas.push(of.nis.and_then(|nis| rounded(nis.sqrt(), FRACTION)));
    }
}

/// 0 tracking, 1 degraded, 2 lost.
fn verdict(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::Tracking => 0,
        Verdict::Degraded => 1,
        Verdict::Lost => 2,
    }
}

/// 0 accepted, 1 gated, 2 refused.
fn outcome(outcome: Outcome) -> u8 {
    match outcome {
        Outcome::Accepted | Outcome::Downweighted => 0,
        Outcome::Gated => 1,
        Outcome::Refused => 2,
    }
}

fn reason(outcome: Outcome, refusal: &str) -> &str {
    match outcome {
        Outcome::Downweighted => "with a lower weight",
        _ => refusal,
    }
}

impl Ticks {
    fn push(&mut self, tick: &Tick) {
        let [sigma_x, sigma_y, ..] = tick.estimate.deviation;
        let sigma_heading = tick.estimate.deviation.get(HEADING).copied().unwrap_or(f64::NAN);
        self.time.push(rounded(tick.time, TIME));
        self.truth.push(tick.truth.map(|truth| truth.pose));
        self.estimate.push(Some(tick.estimate.pose));
        self.encoders.push(Some(tick.odometry));
        self.sigma_x.push(rounded(sigma_x, DEVIATION));
        self.sigma_y.push(rounded(sigma_y, DEVIATION));
        self.sigma_heading.push(rounded(sigma_heading, DEVIATION));
        let correlation = tick.estimate.covariance_xy / (sigma_x * sigma_y);
        self.correlation.push(rounded(correlation, FRACTION));
        self.verdict.push(verdict(tick.estimate.verdict));
    }
}

impl Poses {
    fn push(&mut self, pose: Option<Pose>) {
        self.x.push(pose.and_then(|pose| rounded(pose.x, LENGTH)));
        self.y.push(pose.and_then(|pose| rounded(pose.y, LENGTH)));
        self.heading.push(pose.and_then(|pose| rounded(pose.heading, ANGLE)));
    }
}

fn fixes(trace: &Trace) -> Fixes<'_> {
    let mut columns = Fixes::default();
    for fix in &trace.fixes {
        columns.push(fix);
    }
    columns
}

impl<'a> Fixes<'a> {
    fn push(&mut self, fix: &'a FixRecord) {
        let [x, y] = fix.sonar;
        self.time.push(rounded(fix.time, TIME));
        self.wall.push(fix.wall);
        self.x.push(rounded(x, LENGTH));
        self.y.push(rounded(y, LENGTH));
        self.direction.push(rounded(fix.direction, ANGLE));
        self.range.push(fix.range.and_then(|range| rounded(range, LENGTH)));
        self.source.push(fix.source.map(name));
        self.outcome.push(outcome(fix.outcome));
        self.reason.push(reason(fix.outcome, &fix.reason));
        self.innovation.push(fix.innovation.and_then(|length| rounded(length, LENGTH)));
        let spread = fix.innovation_variance.map(f64::sqrt);
        self.spread.push(spread.and_then(|length| rounded(length, LENGTH)));
    }
}

fn name(source: Source) -> &'static str {
    match source {
        Source::Wall(_) => "wall",
        Source::Corner => "corner",
        Source::Edge => "edge",
        Source::Obstacle => "obstacle",
        Source::DoubleBounce => "double bounce",
        Source::Outlier => "outlier",
    }
}

fn rounded(value: f64, decimals: i32) -> Number {
    let scale = 10.0_f64.powi(decimals);
    // Adding zero turns −0 into 0.
    let rounded = (value * scale).round() / scale + 0.0;
    rounded.is_finite().then_some(rounded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_and_what_is_not_a_number_is_null() {
        let values = [0.123_456, -0.000_01, f64::NAN, f64::INFINITY].map(|v| rounded(v, LENGTH));
        assert_eq!(serde_json::to_string(&values).unwrap(), "[0.1235,0.0,null,null]");
    }

    #[test]
    fn a_long_run_is_thinned_and_keeps_both_ends() {
        let tick = |n: u32| Tick {
            time: f64::from(n) * 0.1,
            truth: None,
            estimate: sonarfix_sim::trace::Estimate::default(),
            odometry: Pose::default(),
            bound: None,
        };
        let trace = Trace { ticks: (0..12_480).map(tick).collect(), ..Trace::default() };
        let columns = ticks(&trace);
        assert!(columns.time.len() <= MOST_TICKS, "{}", columns.time.len());
        assert_eq!(columns.time.first(), Some(&Some(0.0)));
        assert_eq!(columns.time.last(), Some(&Some(1247.9)));
        assert_eq!(columns.truth.x.first(), Some(&None));
        assert_eq!(columns.truth.x.len(), columns.time.len());
    }
}
