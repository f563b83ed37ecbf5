//! Runs without parameter errors, and the forecast at each point of the path.

use rayon::prelude::*;
use sonarfix_map::{
    AbsoluteSensors, Fidelity, Follow, GyroTruth, Leg, Movement, Scenario, Surroundings, Upsets,
};

use sonarfix_sim::angle;
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::{Simulation, SimulationError};
use sonarfix_sim::trace::{Estimate, Tick, Trace};

/// Sample period, seconds.
const STEP: f64 = 0.1;
/// A robot is blind when no range has reduced the largest axis of its position uncertainty for this
/// time, seconds.
pub const BLIND_AFTER: f64 = 5.0;
/// A range reduces the largest axis if its direction is within 60° of it: cos² 60°.
const SEES: f64 = 0.25;

/// The forecast at one instant.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Sample {
    /// Seconds from the start.
    pub time: f64,
    /// Position of the robot, metres.
    pub at: [f64; 2],
    /// Bound on the deviation of x, metres.
    pub x: f64,
    /// Bound on the deviation of y, metres.
    pub y: f64,
    /// Bound on the deviation of the heading, radians.
    pub heading: f64,
    /// Whether the robot is blind here, in more than half of the runs.
    pub blind: bool,
}

impl Sample {
    /// The bound on the position error, metres.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.x.hypot(self.y)
    }
}

/// A bound over a stretch: root mean square and maximum.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Root mean square.
    pub rms: f64,
    /// Maximum.
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
    /// Start, metres.
    pub from: [f64; 2],
    /// End, metres.
    pub to: [f64; 2],
    /// Duration, seconds.
    pub seconds: f64,
}

/// The forecast of a leg, including the turn before it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct LegForecast {
    /// Start, metres.
    pub from: [f64; 2],
    /// End, metres.
    pub to: [f64; 2],
    /// Bound on x, metres.
    pub x: Spread,
    /// Bound on y, metres.
    pub y: Spread,
    /// Bound on the heading, radians.
    pub heading: Spread,
    /// Time in which the robot is blind, seconds.
    pub blind: f64,
}

/// The forecast along a path.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Forecast {
    /// Bound on the position, metres.
    pub position: Spread,
    /// Bound on the deviation of the heading, radians.
    pub heading: Spread,
    /// The point with the largest bound on the position, metres.
    pub worst_at: [f64; 2],
    /// Accepted ranges per second.
    pub ranges_per_second: f64,
    /// All blind stretches, the longest first.
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
    /// Drives the path of a scenario a number of times without parameter errors. None if it was interrupted before the first
    /// run was finished.
    ///
    /// # Errors
    /// [`SimulationError`], if the robot cannot start.
    pub fn new(
        scenario: &Scenario,
        runs: u32,
        progress: &impl Progress,
    ) -> Result<Option<Self>, SimulationError> {
        // The drive has no noise, so that its bound is that of the noise which the filter assumes.
        let simulation = Simulation::new(as_told(scenario)).undistorted().bound_of_filter();
        let runs = (0..u64::from(runs)).into_par_iter().map(|seed| {
            if progress.is_interrupted() {
                return Ok(None);
            }
            let mut trace = simulation.empty_trace();
            simulation.run(seed, &mut trace)?;
            progress.finished();
            Ok(Some(trace))
        });
        let finished = runs.filter_map(Result::transpose);
        let traces = finished.collect::<Result<Vec<Trace>, SimulationError>>()?;
        if traces.is_empty() {
            return Ok(None);
        }
        let samples = samples(&simulation.scenario, &traces);
        let duration = simulation.scenario.path.duration();
        let accepted = traces.iter().flat_map(|trace| &trace.fixes);
        let accepted = accepted.filter(|fix| fix.outcome.is_used()).count();
        let worst = samples.iter().max_by(|a, b| a.position().total_cmp(&b.position()));
        Ok(Some(Self {
            position: Spread::of(&samples, Sample::position),
            heading: Spread::of(&samples, |sample| sample.heading),
            worst_at: worst.map_or([0.0; 2], |sample| sample.at),
            ranges_per_second: as_f64(accepted) / (duration * as_f64(traces.len())),
            blind: blind(&samples),
            blind_share: share(&samples, |sample| sample.blind),
            legs: legs(simulation.scenario.path.legs(), &samples),
            samples,
        }))
    }
}

/// The scenario without parameter errors and without unmapped obstacles.
fn as_told(scenario: &Scenario) -> Scenario {
    let mut error_free = scenario.clone();
    let drive = &error_free.robot.localizer.drive;
    error_free.truth.track_width = drive.track_width.0.into();
    error_free.truth.scale_right = 0.0;
    error_free.truth.scale_left = 0.0;
    error_free.truth.mount = [None; 2];
    error_free.truth.servo_pulses = None;
    error_free.truth.servo_zero = 0.0;
    error_free.truth.servo_scale = 0.0;
    error_free.truth.range_scale = 0.0;
    error_free.truth.range_offset = 0.0;
    error_free.truth.wheel_noise = 0.0;
    error_free.truth.scale_walk = 0.0;
    error_free.truth.track_width_walk = 0.0;
    error_free.truth.cone = error_free.robot.localizer.rangers.first.cone.0.into();
    // The noise of a gyro remains: one without noise would count as stuck.
    error_free.truth.gyro = GyroTruth { bias: Some(0.0), scale: 0.0 };
    let AbsoluteSensors { heading, position } = &mut error_free.absolute;
    let of_heading = heading.iter_mut().map(|sensor| &mut sensor.sampling);
    let of_position = position.iter_mut().map(|sensor| &mut sensor.sampling);
    of_heading.chain(of_position).for_each(|sampling| sampling.outliers = 0.0);
    error_free.upsets = Upsets::default();
    error_free.surroundings = Surroundings {
        temperature: error_free.robot.rangers.first.temperature.0.into(),
        obstacles: Vec::new(),
    };
    error_free.faults = Vec::new();
    error_free.start.drawn = false;
    error_free.follow = Follow::Truth;
    error_free.fidelity = Fidelity::Pins;
    error_free
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
            // A ping may delay a tick: the last available one.
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
    let mut fixes = trace.fixes.iter().filter(|fix| fix.outcome.is_used()).peekable();
    let mut seen = 0.0;
    // For each tick, when a range last reduced the largest axis.
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
