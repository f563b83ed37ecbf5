//! The ranges of all rangers.

use sonarfix_hal::config::RobotConfig;

use crate::diagnosis::finding::Finding;
use crate::median::Median;

/// Records that show a constant value.
const CONSTANT: u64 = 20;
/// Differences of ranges by this share of all their spread are noise.
const NOISE: f64 = 0.12;

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

    /// Between the shortest and the longest range, metres.
    pub fn spread(&self) -> f64 {
        self.most.unwrap_or(0.0) - self.least.unwrap_or(0.0)
    }

    /// Ranges that have nothing to do with each other, which are noise.
    pub fn noise(&self) -> Option<Finding> {
        let difference = self.differences.value()?;
        let is_noise = self.compared > CONSTANT && difference > NOISE * self.spread();
        is_noise.then(|| {
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
                "echoes_end",
                format!(
                    "the last {} pings, from {:.1} s on, have no echo",
                    silence.pings, silence.from
                ),
                "the ranger or its cable failed there: check its supply".to_owned(),
            ));
        }
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
