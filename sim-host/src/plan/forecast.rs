//! Runs on the truth, and what they say of each place of the path.

use rayon::prelude::*;
use sonarfix_map::{Fidelity, Follow, Leg, Movement, Scenario, Surroundings, Upsets};

use crate::angle;
use crate::simulate::{Simulation, SimulationError};
use crate::trace::{Estimate, Outcome, Tick, Trace};

/// From sample to sample, seconds.
const STEP: f64 = 0.1;
/// A robot is blind when for so long, in seconds, no range has lowered the largest part of its
/// doubt.
pub const BLIND_AFTER: f64 = 5.0;
/// A look sees the largest part of the doubt if it is no farther off its direction: cos² 60°.
const SEES: f64 = 0.25;

/// What is to be expected at one instant.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Sample {
    /// Seconds from the start.
    pub time: f64,
    /// Where the robot is, metres.
    pub at: [f64; 2],
    /// Bounds on the deviations of x and y, metres.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// Of the heading, radians.
    pub heading: f64,
    /// Whether the robot is blind here, in more than half of the runs.
    pub blind: bool,
}

impl Sample {
    /// The bound on the position's deviation, metres.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.x.hypot(self.y)
    }
}

/// A bound over a stretch: its root mean square and its worst.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Root mean square.
    pub rms: f64,
    /// The worst.
    pub worst: f64,
}

impl Spread {
    fn of(samples: &[Sample], value: impl Fn(&Sample) -> f64) -> Self {
        let squares: f64 = samples.iter().map(|sample| value(sample).powi(2)).sum();
        let worst = samples.iter().map(value).fold(0.0, f64::max);
        Self { rms: (squares / as_f64(samples.len())).sqrt(), worst }
    }
}

/// A stretch in which the robot is blind.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Blind {
    /// Where it begins, metres.
    pub from: [f64; 2],
    /// Where it ends.
    pub to: [f64; 2],
    /// How long it takes, seconds.
    pub seconds: f64,
}

/// What is to be expected on a leg, with the turn before it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct LegForecast {
    /// Where it begins, metres.
    pub from: [f64; 2],
    /// Where it ends.
    pub to: [f64; 2],
    /// Bound on x, metres.
    pub x: Spread,
    /// On y, metres.
    pub y: Spread,
    /// On the heading, radians.
    pub heading: Spread,
    /// Seconds of it in which the robot is blind.
    pub blind: f64,
}

/// What is to be expected along a path.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Forecast {
    /// Of the position, metres.
    pub position: Spread,
    /// Of the heading, radians.
    pub heading: Spread,
    /// Where the position is known worst.
    pub worst_at: [f64; 2],
    /// Ranges accepted a second.
    pub ranges_per_second: f64,
    /// Every blind stretch, the longest first.
    pub blind: Vec<Blind>,
    /// Share of the time in which the robot is blind.
    pub blind_share: f64,
    /// Each leg, in order.
    pub legs: Vec<LegForecast>,
    /// Every instant, in order.
    #[serde(skip)]
    pub samples: Vec<Sample>,
}

impl Forecast {
    /// Drives the path of a scenario so many times, with everything as its filter is told.
    ///
    /// # Errors
    /// [`SimulationError`], if the robot cannot start.
    pub fn new(scenario: &Scenario, runs: u32) -> Result<Self, SimulationError> {
        let simulation = Simulation::new(as_told(scenario)).undistorted();
        let runs = (0..u64::from(runs)).into_par_iter().map(|seed| {
            let mut trace = simulation.empty_trace();
            simulation.run(seed, &mut trace)?;
            Ok(trace)
        });
        let traces = runs.collect::<Result<Vec<_>, SimulationError>>()?;
        let samples = samples(&simulation.scenario, &traces);
        let duration = simulation.scenario.path.duration();
        let accepted = traces.iter().flat_map(|trace| &trace.fixes);
        let accepted = accepted.filter(|fix| fix.outcome == Outcome::Accepted).count();
        let worst = samples.iter().max_by(|a, b| a.position().total_cmp(&b.position()));
        Ok(Self {
            position: Spread::of(&samples, Sample::position),
            heading: Spread::of(&samples, |sample| sample.heading),
            worst_at: worst.map_or([0.0; 2], |sample| sample.at),
            ranges_per_second: as_f64(accepted) / (duration * as_f64(traces.len())),
            blind: blind(&samples),
            blind_share: share(&samples, |sample| sample.blind),
            legs: legs(simulation.scenario.path.legs(), &samples),
            samples,
        })
    }
}

/// The scenario in which everything is as the filter is told, and nothing is there but the map.
fn as_told(scenario: &Scenario) -> Scenario {
    let mut told = scenario.clone();
    let drive = &told.robot.config.drive;
    told.truth.track_width = drive.track_width.0.into();
    told.truth.scale_right = 0.0;
    told.truth.scale_left = 0.0;
    told.truth.range_scale = 0.0;
    told.truth.wheel_noise = 0.0;
    told.truth.scale_walk = 0.0;
    told.truth.track_width_walk = 0.0;
    told.truth.cone = told.robot.config.sonar.cone.0.into();
    told.upsets = Upsets::default();
    told.surroundings =
        Surroundings { temperature: told.hardware.set_temperature, obstacles: Vec::new() };
    told.faults = Vec::new();
    told.start.drawn = false;
    told.follow = Follow::Truth;
    told.fidelity = Fidelity::Pins;
    told
}

/// The samples of a path, each the root mean square over the runs.
fn samples(scenario: &Scenario, traces: &[Trace]) -> Vec<Sample> {
    let blinds: Vec<Vec<bool>> = traces.iter().map(blindness).collect();
    let mut next = vec![0; traces.len()];
    let mut samples = Vec::new();
    let mut step = 1.0;
    while step * STEP <= scenario.path.duration() {
        let time = step * STEP;
        step += 1.0;
        let (mut squares, mut blind, mut count) = ([0.0; 3], 0, 0);
        for ((trace, blinds), next) in traces.iter().zip(&blinds).zip(&mut next) {
            // The ticks are held back by pings now and then: the last that there was.
            while trace.ticks.get(*next + 1).is_some_and(|tick| tick.time <= time) {
                *next += 1;
            }
            let Some(bound) = trace.ticks.get(*next).and_then(|tick| tick.bound) else {
                continue;
            };
            for (sum, deviation) in squares.iter_mut().zip(bound) {
                *sum += deviation * deviation;
            }
            blind += usize::from(blinds.get(*next).copied().unwrap_or_default());
            count += 1;
        }
        let [x, y, heading] = squares.map(|sum: f64| (sum / as_f64(count)).sqrt());
        let pose = scenario.path.pose_at(time);
        samples.push(Sample {
            time,
            at: [pose.x, pose.y],
            x,
            y,
            heading,
            blind: 2 * blind > count,
        });
    }
    samples
}

/// For each tick of a run, whether the robot is blind there.
fn blindness(trace: &Trace) -> Vec<bool> {
    let mut fixes = trace.fixes.iter().filter(|fix| fix.outcome == Outcome::Accepted).peekable();
    let mut seen = 0.0;
    // When a look last saw the largest part of the doubt, for each tick.
    let mut last_seen = Vec::with_capacity(trace.ticks.len());
    for Tick { time, estimate, .. } in &trace.ticks {
        while let Some(fix) = fixes.next_if(|fix| fix.time <= *time) {
            let off = angle::wrap(fix.direction - direction_of_doubt(estimate));
            if off.cos().powi(2) >= SEES {
                seen = fix.time;
            }
        }
        last_seen.push((*time, seen));
    }
    let unseen = last_seen.chunk_by(|(_, one), (_, other)| one.total_cmp(other).is_eq());
    let is_long = |stretch: &[(f64, f64)]| {
        stretch.last().is_some_and(|(time, seen)| time - seen > BLIND_AFTER)
    };
    unseen.flat_map(|stretch| std::iter::repeat_n(is_long(stretch), stretch.len())).collect()
}

/// Direction of the longer axis of the position's ellipse, radians.
fn direction_of_doubt(estimate: &Estimate) -> f64 {
    let [x, y, ..] = estimate.deviation;
    0.5 * (2.0 * estimate.covariance_xy).atan2(x * x - y * y)
}

fn blind(samples: &[Sample]) -> Vec<Blind> {
    let stretches = samples.chunk_by(|a, b| a.blind == b.blind);
    let blind = stretches.filter_map(|stretch| match stretch {
        [first, .., last] if first.blind => {
            Some(Blind { from: first.at, to: last.at, seconds: last.time - first.time })
        }
        _ => None,
    });
    let mut blind: Vec<Blind> = blind.collect();
    blind.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    blind
}

fn legs(legs: &[Leg], samples: &[Sample]) -> Vec<LegForecast> {
    let mut rest = samples;
    let straight = legs.iter().filter(|leg| matches!(leg.movement, Movement::Straight(_)));
    let forecast = straight.map(|leg| {
        let (here, after) = rest.split_at(rest.partition_point(|s| s.time <= leg.end_time()));
        rest = after;
        LegForecast {
            from: [leg.from.x, leg.from.y],
            to: [leg.to.x, leg.to.y],
            x: Spread::of(here, |sample| sample.x),
            y: Spread::of(here, |sample| sample.y),
            heading: Spread::of(here, |sample| sample.heading),
            blind: STEP * as_f64(here.iter().filter(|sample| sample.blind).count()),
        }
    });
    forecast.collect()
}

fn share(samples: &[Sample], is: impl Fn(&Sample) -> bool) -> f64 {
    as_f64(samples.iter().filter(|sample| is(sample)).count()) / as_f64(samples.len())
}

#[expect(clippy::cast_precision_loss, reason = "some thousand")]
fn as_f64(count: usize) -> f64 {
    count as f64
}
