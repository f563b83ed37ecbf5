//! The ranges of all rangers.

use sonarfix_hal::config::RobotConfig;

use crate::diagnosis::finding::Finding;
use crate::median::Median;

/// Records that show a constant value.
const CONSTANT: u64 = 20;
/// Differences of ranges by this share of all their spread are noise.
const NOISE: f64 = 0.12;
const CERTAIN_NOISE: f64 = 0.2;
/// The name of a ranger that fails, and what to do.
const ECHOES_END: &str = "echoes_end";
const RANGER_FAILED: &str = "the ranger or its cable failed there: check its supply";

/// What their records show.
#[derive(Debug, Default)]
pub struct Ranges {
    pings: u64,
    echoes: u64,
    least: Option<f64>,
    most: Option<f64>,
    /// The run of one value, and how far the robot has driven since.
    run: Option<Run>,
    longest: Option<Run>,
    /// The run of pings without an echo.
    silence: Option<Run>,
    /// The last echo, and the differences of echoes in nearly the same direction from nearly the same place.
    last: Option<Echo>,
    differences: Median,
    compared: u64,
    /// The last ping or cycle without one, and how long the pause before a ping usually is.
    heard: Option<f64>,
    longest_pause: f64,
    /// The encoder record after it, and the travel of both wheels then and now.
    pause: Option<Pause>,
}

/// Encoder records without a ping.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pause {
    line: u64,
    from: f64,
    until: f64,
    began: f64,
    moved: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Echo {
    time: f64,
    direction: f64,
    range: f64,
    moved: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Run {
    line: u64,
    from: f64,
    value: f64,
    direction: f64,
    pings: u64,
    /// The travel of both wheels when it began, and in it.
    began: f64,
    moved: f64,
    /// The largest turn of the beam since it began, radians.
    turned: f64,
}

impl Run {
    fn begin(line: u64, from: f64, value: f64, direction: f64, began: f64) -> Self {
        Self { line, from, value, direction, pings: 1, began, moved: 0.0, turned: 0.0 }
    }
}

impl Ranges {
    /// Takes a ping: its direction against that of the start, radians, and the travel of both wheels before it, metres.
    pub fn add(&mut self, line: u64, time: f64, direction: f64, range: Option<f64>, moved: f64) {
        self.pings += 1;
        self.alive(time);
        let Some(range) = range else {
            let silence = self.silence.get_or_insert(Run::begin(line, time, 0.0, direction, moved));
            silence.pings += 1;
            silence.moved = moved - silence.began;
            return;
        };
        self.silence = None;
        let echo = Echo { time, direction, range, moved };
        if let Some(last) = self.last.replace(echo)
            && (direction - last.direction).abs() < 0.1
            && moved - last.moved < 0.2
            && (0.0..1.0).contains(&(time - last.time))
        {
            self.differences.add((range - last.range).abs());
            self.compared += 1;
        }
        self.echoes += 1;
        self.least = Some(self.least.map_or(range, |least| least.min(range)));
        self.most = Some(self.most.map_or(range, |most| most.max(range)));
        match &mut self.run {
            #[expect(clippy::float_cmp, reason = "a ranger that is stuck repeats the same number")]
            Some(run) if run.value == range => {
                run.pings += 1;
                run.moved = moved - run.began;
                run.turned = run.turned.max((direction - run.direction).abs());
                let is_longer = |old: &Run| run.moved > old.moved;
                if self.longest.as_ref().is_none_or(is_longer) {
                    self.longest = Some(*run);
                }
            }
            run => *run = Some(Run::begin(line, time, range, direction, moved)),
        }
    }

    /// Notes that the ranger pings, or that the robot found no wall to measure.
    pub fn alive(&mut self, time: f64) {
        if let Some(heard) = self.heard.replace(time) {
            self.longest_pause = self.longest_pause.max(time - heard);
        }
        self.pause = None;
    }

    /// Notes the travel of both wheels at an encoder record.
    pub fn drive(&mut self, line: u64, time: f64, moved: f64) {
        let new = Pause { line, from: time, until: time, began: moved, moved };
        let pause = self.pause.get_or_insert(new);
        (pause.until, pause.moved) = (time, moved);
    }

    /// A log that goes on without pings for longer than any pause before.
    fn end_of_pings(&self) -> Option<Finding> {
        let pause = self.pause?;
        let seconds = pause.until - pause.from;
        let is_long = seconds > 3.0 * self.longest_pause.max(1.0);
        let is_end = is_long && self.pings >= CONSTANT && pause.moved - pause.began > 1.0;
        is_end.then(|| {
            Finding::at(
                pause.line,
                ECHOES_END,
                format!("the log has no range from {:.1} s on, but encoder records for another {seconds:.1} s", pause.from),
                RANGER_FAILED.to_owned(),
            )
        })
    }

    /// Between the shortest and the longest range, metres.
    pub fn spread(&self) -> f64 {
        self.most.unwrap_or(0.0) - self.least.unwrap_or(0.0)
    }

    /// Whether ranges in nearly the same direction differ by this share of the spread of all of them in the median.
    fn differ_by(&self, share: f64) -> bool {
        let is_more = |difference| difference > share * self.spread();
        self.compared > CONSTANT && self.differences.value().is_some_and(is_more)
    }

    /// Whether they differ nearly as much as random numbers, whose differences have a median of 0.29 of their spread.
    pub fn is_noise(&self) -> bool {
        self.differ_by(CERTAIN_NOISE)
    }

    /// Ranges that have nothing to do with each other, which are noise.
    pub fn noise(&self) -> Option<Finding> {
        let difference = self.differences.value()?;
        self.differ_by(NOISE).then(|| {
            Finding::new(
                "range_noise",
                format!("successive ranges in nearly the same direction differ by {difference:.2} m in the median: they are noise"),
                "check the ranger's supply, echo line and time-out, and keep its cable away from those of the motors".to_owned(),
            )
        })
    }

    pub fn findings(&self, robot: &RobotConfig, travelled: f64, findings: &mut Vec<Finding>) {
        if self.pings == 0 {
            return;
        }
        let max_range = f64::from(robot.localizer.rangers.first.max_range.0);
        if self.echoes == 0 {
            findings.push(Finding::new(
                "no_echoes",
                format!("none of the {} pings has an echo", self.pings),
                "check the echo line and the supply of the ranger, or the column of the range"
                    .to_owned(),
            ));
        } else if let Some(silence) = self.silence
            && silence.pings >= CONSTANT
            && silence.moved > 1.0
        {
            findings.push(Finding::at(
                silence.line,
                ECHOES_END,
                format!(
                    "the last {} pings, from {:.1} s on, have no echo",
                    silence.pings, silence.from
                ),
                RANGER_FAILED.to_owned(),
            ));
        }
        findings.extend(self.end_of_pings());
        if let Some(run) = self.longest.filter(|run| run.is_stuck(max_range, travelled)) {
            findings.push(Finding::at(
                run.line,
                "range_stuck",
                format!(
                    "{} ranges in a row, from {:.1} s on, are {:.3} m, while the robot drives {:.1} m",
                    run.pings,
                    run.from,
                    run.value,
                    0.5 * run.moved
                ),
                "the ranger repeats an old value: check that a new measurement is awaited, and its echo line".to_owned(),
            ));
        }
    }
}

impl Run {
    /// Whether no room returns such a run: the robot drives along a wall for long at most at one bearing.
    fn is_stuck(&self, max_range: f64, travelled: f64) -> bool {
        let is_long = self.pings >= CONSTANT && self.moved > 1.0;
        let has_turned = self.turned > 0.7;
        let is_most = self.moved > 0.6 * travelled;
        is_long && (has_turned || is_most || self.moved > 4.0 * max_range)
    }
}
