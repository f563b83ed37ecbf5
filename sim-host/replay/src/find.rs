//! The search for the pose on a recording: no start pose, only odometry, ranges and the map.

use std::io::BufRead;

use serde::Serialize;
use sonarfix::config::{RangerId, RangerParameters};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::{Map, Wall};
use sonarfix_hal::config::RobotConfig;
use sonarfix_search::search::{Answer, Hypothesis, Search, SearchParameters};
use sonarfix_sim::time::micros;
use sonarfix_sim::trace::Pose;

use crate::estimators::ComputingTime;
use crate::fault::{ReplayError, Source};
use crate::lines::Lines;
use crate::log::{self, Record};
use crate::reference;
use crate::scan::{Cone, Scan, Sweep};
use crate::wheels::Reading;

/// Cycles that the search makes after the end of the log.
const CYCLES_AT_END: u32 = 6;
/// The search on a log.
pub struct Find<'a> {
    /// The robot that was recorded.
    pub robot: &'a RobotConfig,
    /// The map.
    pub walls: &'a [Wall],
}

/// A pose that fits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Candidate {
    /// The robot's pose at the end of the log.
    pub pose: Pose,
    /// Standard deviation of the position, metres.
    pub position_deviation: f64,
    /// Standard deviation of the heading, radians.
    pub heading_deviation: f64,
    /// Mean weighted log-likelihood per ping, relative to a place without walls.
    pub fit: f64,
    /// The share of the echoes that the map explains.
    pub explained: f64,
}

impl From<Hypothesis> for Candidate {
    fn from(hypothesis: Hypothesis) -> Self {
        let pose = hypothesis.pose;
        Self {
            pose: Pose {
                x: pose.x.0.into(),
                y: pose.y.0.into(),
                heading: pose.heading.radians().0.into(),
            },
            position_deviation: hypothesis.position_deviation.0.into(),
            heading_deviation: hypothesis.heading_deviation.0.into(),
            fit: hypothesis.fit.into(),
            explained: hypothesis.explained.into(),
        }
    }
}

/// The result of a search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// The answer at the end: `searching`, `several`, `along`, `nowhere` or `unique`.
    pub answer: &'static str,
    /// Seconds from the first encoder record to the first unique answer.
    pub unique_after: Option<f64>,
    /// How many of the hypotheses are answers.
    pub answers: usize,
    /// The bank, best hypothesis first.
    pub hypotheses: Vec<Candidate>,
    /// Pings of the log.
    pub pings: u64,
    /// Complete cycles of the search.
    pub cycles: u32,
    /// Lines that were skipped.
    pub lines_skipped: u64,
}

/// What the log holds of one or more pings.
enum Heard {
    Range { bearing: f64, range: Option<f64> },
    Scan(Scan),
}

/// A search in progress.
struct Run<'a> {
    search: Search<'a>,
    track_width: f64,
    travel_per_tick: [f64; 2],
    first: Option<i64>,
    last: Option<Reading>,
    waiting: Vec<(i64, Heard)>,
    sweep: Sweep,
    computing: ComputingTime,
    sonar: RangerParameters,
    unique_after: Option<f64>,
    pings: u64,
}

impl Find<'_> {
    /// Searches through a whole log; malformed lines are skipped.
    ///
    /// # Errors
    /// [`ReplayError`], if the log cannot be read.
    pub fn run(&self, log: impl BufRead) -> Result<Found, ReplayError> {
        let mut run = Run::new(self.robot, self.walls);
        let mut lines = Lines::of(log);
        reference::expect_header(&mut lines, Source::Log, log::HEADER)?;
        let mut skipped = 0;
        while let Some(line) =
            lines.next().map_err(|error| ReplayError::Read(Source::Log, error))?
        {
            match line.and_then(log::parse) {
                Ok(None) => {}
                Ok(Some(record)) => run.take(&record),
                Err(_) => skipped += 1,
            }
        }
        Ok(run.end(skipped))
    }

    /// Searches through some records.
    #[must_use]
    pub fn run_records<'r>(&self, records: impl Iterator<Item = &'r Record>) -> Found {
        let mut run = Run::new(self.robot, self.walls);
        records.for_each(|record| run.take(record));
        run.end(0)
    }
}

impl<'a> Run<'a> {
    fn new(robot: &RobotConfig, walls: &'a [Wall]) -> Self {
        let sonar = &robot.localizer.rangers.first;
        let signed = [robot.right_wheel.signed_travel(), robot.left_wheel.signed_travel()];
        Self {
            search: Search::new(sonar, Map::new(walls), SearchParameters::of(&robot.localizer)),
            track_width: robot.localizer.drive.track_width.0.into(),
            travel_per_tick: signed.map(|travel| travel.0.into()),
            first: None,
            last: None,
            waiting: Vec::new(),
            sweep: Sweep::default(),
            computing: ComputingTime::default(),
            sonar: *sonar,
            unique_after: None,
            pings: 0,
        }
    }

    fn take(&mut self, record: &Record) {
        match *record {
            Record::Ticks { time, right, left } => {
                let [by_right, by_left] = self.travel_per_tick;
                #[expect(clippy::cast_precision_loss, reason = "exact below 2^53 ticks")]
                let wheels = [by_right * right as f64, by_left * left as f64];
                self.roll(log_micros(time), wheels);
            }
            Record::Wheels { time, right, left } => self.roll(log_micros(time), [right, left]),
            Record::Range { time, bearing, range, ranger: RangerId::FIRST, .. } => {
                self.waiting.push((log_micros(time), Heard::Range { bearing, range }));
            }
            Record::Scan { time, ref scan } => self.scan(log_micros(time), scan),
            Record::Skip { .. }
            | Record::Turn { .. }
            | Record::Range { .. }
            | Record::Absolute { .. }
            | Record::Start { .. }
            | Record::Pose { .. }
            | Record::Mode { .. }
            | Record::Resume { .. } => {}
        }
    }

    /// Takes the ranges that a rotating sonar would measure in a scan: as many as it has time for since the scan before, in
    /// the directions of its sweep, as the replay of a robot that searches does.
    fn scan(&mut self, time: i64, scan: &Scan) {
        for _ in 0..self.sweep.pings_until(time) {
            self.waiting.push((time, Heard::Scan(scan.clone())));
        }
    }

    /// Drives to a reading of the encoders, through the pings since the last one.
    fn roll(&mut self, time: i64, wheels: [f64; 2]) {
        let reading = Reading { time, wheels };
        self.first.get_or_insert(time);
        for (at, heard) in std::mem::take(&mut self.waiting) {
            let Some(last) = self.last.filter(|last| last.time <= at && at <= time) else {
                continue;
            };
            self.drive_to(last.between(reading, at));
            self.hear(&heard);
        }
        if self.last.is_none_or(|last| last.time < time) {
            self.drive_to(reading);
        }
    }

    fn drive_to(&mut self, reading: Reading) {
        let Some(last) = self.last.replace(reading) else { return };
        let right = reading.wheels[0] - last.wheels[0];
        let left = reading.wheels[1] - last.wheels[1];
        let turn = (right - left) / self.track_width;
        // A jump of the encoders that is not finite is refused; the next reading counts again.
        _ = self.search.odometry(metres(f64::midpoint(right, left)), radians(turn));
        self.search.poll(self.computing.evaluations(reading.time - last.time));
        if self.unique_after.is_none() && matches!(self.search.answer(), Answer::Unique(_)) {
            #[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs")]
            let after = self.first.map(|first| (reading.time - first) as f64 * 1e-6);
            self.unique_after = after;
        }
    }

    fn hear(&mut self, heard: &Heard) {
        match heard {
            Heard::Range { bearing, range } => self.ping(*bearing, *range),
            Heard::Scan(scan) => {
                let bearing = self.search.aim();
                let range = scan.specular(&Cone::of(&self.sonar, bearing));
                self.ping(bearing.0.into(), range);
            }
        }
    }

    fn ping(&mut self, bearing: f64, range: Option<f64>) {
        self.pings += 1;
        // The parser refuses what is not finite.
        _ = self.search.ping(radians(bearing), range.map(metres));
    }

    fn end(mut self, lines_skipped: u64) -> Found {
        let cycles = self.search.cycles() + CYCLES_AT_END;
        let mut polls = 0_u16;
        while self.search.cycles() < cycles && polls < 10_000 {
            self.search.poll(10_000);
            polls += 1;
        }
        let (answer, answers) = match self.search.answer() {
            Answer::Several(count) => ("several", count),
            Answer::Along { .. } => ("along", 1),
            Answer::Nowhere => ("nowhere", 0),
            Answer::Unique(_) => ("unique", 1),
            Answer::Searching => ("searching", 0),
        };
        Found {
            answer,
            unique_after: self.unique_after,
            answers,
            hypotheses: self.search.hypotheses().map(Candidate::from).collect(),
            pings: self.pings,
            cycles: self.search.cycles(),
            lines_skipped,
        }
    }
}

#[expect(clippy::cast_possible_wrap, reason = "times are checked to be below 300 years")]
fn log_micros(time: f64) -> i64 {
    if time < 0.0 { -(micros(-time) as i64) } else { micros(time) as i64 }
}

#[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
fn metres(value: f64) -> Metres {
    Metres(value as f32)
}

#[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
fn radians(value: f64) -> Radians {
    Radians(value as f32)
}
