//! A robot without a start pose in simulation: set down anywhere on its path, it drives on, sweeps with its sonar and searches for
//! its pose.
//!
//! World, sonar and wheels are those of the simulator. The measurement timing is simplified: a ping
//! each [`PERIOD`] at exactly the requested bearing ± 1°, and the range belongs to its instant.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::{Map, MapError};
use sonarfix_hal::robot::EVALUATIONS_PER_MILLISECOND;
use sonarfix_map::{
    BakeError, FileError, Floor, Follow, PathError, Scenario, Symmetry, symmetries,
};
use sonarfix_search::search::{Answer, Hypothesis, Search, SearchParameters};
use sonarfix_sim::angle;
use sonarfix_sim::plant::Plant;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::Ping;

/// Time of one ping of an HC-SR04 on an SG90 with steps of 10°, seconds: the cycle of the sonar, in which the servo turns, and
/// polls of the loop. A test of the studies compares it with the simulated loop.
pub const PERIOD: f64 = 0.066;
/// Evaluations between two pings, which are 66 ms apart.
const EVALUATIONS: u16 = 66 * EVALUATIONS_PER_MILLISECOND;
/// Pings with which a search begins.
const LEAST_PINGS: usize = 12;
/// The largest systematic error of a wheel; that of each is uniform.
pub const WHEEL_ERROR: f64 = 0.01;
/// The largest deviation of the servo from the bearing, radians.
const SERVO_ERROR: f64 = 0.02;
/// A pose within these errors is right, metres and radians.
const RIGHT: (f64, f64) = (0.3, 0.175);

/// Why a trial cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// The scenario cannot be read.
    #[error(transparent)]
    Scenario(#[from] FileError),
    /// The map cannot be baked.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// The baked map is refused.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The path cannot be driven back.
    #[error(transparent)]
    Path(#[from] PathError),
}

/// The outcome of one trial.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Trial {
    /// Seed of the trial.
    pub seed: u64,
    /// Walls of the map.
    pub walls: usize,
    /// Seconds until the first unique answer, if there was one; the trial ends with it.
    pub unique_after: Option<f64>,
    /// Distance driven until then, or until the end, metres.
    pub metres: f64,
    /// Whether the unique answer was right.
    pub is_right: bool,
    /// Position error of the unique answer, metres.
    pub position_error: f64,
    /// Heading error of the unique answer, radians.
    pub heading_error: f64,
    /// The place of the true pose in the bank at the end, from 0.
    pub rank: Option<usize>,
    /// How many hypotheses were answers at the end.
    pub answers: usize,
    /// Whether the true pose and its images under the symmetries of the map were among the answers when
    /// there last were several; `None` of a map without symmetry.
    pub has_all_twins: Option<bool>,
    /// Complete cycles of the search.
    pub cycles: u32,
    /// Evaluations of all of them, in steps of a millisecond.
    pub evaluations: u64,
    /// Those of the longest.
    pub longest_cycle: u64,
}

/// One ping of a trial, and where the robot truly was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heard {
    /// Seconds since the start of the trial.
    pub time: f64,
    /// The true pose of the robot, map frame.
    pub pose: Pose,
    /// What the encoders have counted since the last ping: metres along the mean heading, and radians.
    pub travel: [f64; 2],
    /// The bearing that the search asked for, radians, robot frame.
    pub bearing: f64,
    /// The measured range, metres; `None` without an echo.
    pub range: Option<f64>,
}

/// Where a robot without a pose is set down, and what it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SetDown {
    /// Anywhere on its path; it drives on.
    Anywhere,
    /// Where its path is at this time, seconds; it drives on.
    At(f64),
    /// Anywhere on its path, where it stands.
    Standing,
}

/// Simulates one trial of at most `seconds`: the seed chooses the wheel errors and, unless it is given, the place on the
/// path.
///
/// # Errors
/// [`TrialError`], if the map cannot be used.
pub fn trial(
    scenario: Scenario,
    seed: u64,
    set_down: SetDown,
    seconds: f64,
) -> Result<Trial, TrialError> {
    observed_trial(scenario, seed, set_down, seconds, |_, _| false)
}

/// The same, and every ping goes to an observer, with the search that has taken it. The trial goes on after a unique answer, which the result contains, as long as the
/// observer returns `true`.
///
/// # Errors
/// As of [`trial`].
pub fn observed_trial(
    scenario: Scenario,
    seed: u64,
    set_down: SetDown,
    seconds: f64,
    observer: impl FnMut(Heard, &Search<'_>) -> bool,
) -> Result<Trial, TrialError> {
    let mut rng = stream(seed, 0);
    let errors = wheel_errors(&mut rng);
    let start = match set_down {
        SetDown::At(time) => time,
        SetDown::Anywhere | SetDown::Standing => random_start(&scenario, seconds, &mut rng),
    };
    let until = if set_down == SetDown::Standing { start } else { f64::INFINITY };
    drive(&Simulation::new(searching(scenario, errors)), seed, (start, until), seconds, observer)
}

/// As [`trial`], of a robot that is set down anywhere. It has this map, and its wheels have `wheels` times the errors of other trials.
///
/// # Errors
/// As of [`trial`].
pub fn mistaken_trial(
    scenario: Scenario,
    map: &Floor,
    wheels: f64,
    seed: u64,
    seconds: f64,
) -> Result<Trial, TrialError> {
    let mut rng = stream(seed, 0);
    let errors = wheel_errors(&mut rng).map(|error| wheels * error);
    let start = random_start(&scenario, seconds, &mut rng);
    let robot = scenario.robot;
    let simulation = Simulation::new(searching(scenario, errors)).believing(robot, map.walls());
    drive(&simulation, seed, (start, f64::INFINITY), seconds, |_, _| false)
}

/// A random time of the path with so many seconds left.
fn random_start(scenario: &Scenario, seconds: f64, rng: &mut ChaCha8Rng) -> f64 {
    let spare = scenario.path.duration() - seconds;
    if spare > 1.0 { rng.random_range(0.0..spare) } else { 0.0 }
}

/// The scenario of a robot that searches, with these wheel errors. There is no estimate to follow.
fn searching(mut scenario: Scenario, errors: [f64; 2]) -> Scenario {
    [scenario.truth.scale_right, scenario.truth.scale_left] = errors;
    scenario.follow = Follow::Truth;
    scenario
}

/// Errors of the right and of the left wheel.
fn wheel_errors(rng: &mut ChaCha8Rng) -> [f64; 2] {
    [(); 2].map(|()| rng.random_range(-WHEEL_ERROR..WHEEL_ERROR))
}

/// Drives from one time of the path until another, and searches for so many seconds.
fn drive(
    simulation: &Simulation,
    seed: u64,
    (start, until): (f64, f64),
    seconds: f64,
    mut observer: impl FnMut(Heard, &Search<'_>) -> bool,
) -> Result<Trial, TrialError> {
    let image = simulation.baked_map()?;
    let config = simulation.config();
    let mut drive = Drive {
        search: Search::new(
            &config.rangers.first,
            Map::read(&image)?,
            SearchParameters::of(&config),
        ),
        plant: Plant::new(&simulation.scenario, simulation.range_scale()),
        track_width: config.drive.track_width.0.into(),
        until,
        simulation,
        wheels: stream(seed, 1),
        slips: stream(seed, 4),
        noise: stream(seed, 2),
        luck: stream(seed, 3),
        has_all_twins: None,
        metres: 0.0,
        cycle: 0,
        evaluations: 0,
        longest_cycle: 0,
    };
    let symmetries = symmetries(&simulation.scenario.floor)?;
    drive.plant.drive_to(start, &mut drive.wheels, &mut drive.slips);
    let end = simulation.scenario.path.duration().min(start + seconds);
    let mut time = start + PERIOD;
    let mut unique = None;
    let mut is_observed = true;
    while time < end && (unique.is_none() || is_observed) {
        let Measured { travel, bearing, range } = drive.ping(time);
        if unique.is_none() {
            drive.note_twins(&symmetries);
            if let Answer::Unique(hypothesis) = drive.search.answer() {
                unique = Some(drive.result(seed, Some((time - start, hypothesis))));
            }
        }
        let pose = drive.plant.pose();
        let heard = Heard { time: time - start, pose, travel, bearing, range };
        is_observed = observer(heard, &drive.search);
        time += PERIOD;
    }
    Ok(unique.unwrap_or_else(|| drive.result(seed, None)))
}

struct Drive<'a> {
    simulation: &'a Simulation,
    search: Search<'a>,
    plant: Plant<'a>,
    /// The time of the path at which the robot stops, seconds.
    until: f64,
    track_width: f64,
    wheels: ChaCha8Rng,
    slips: ChaCha8Rng,
    noise: ChaCha8Rng,
    luck: ChaCha8Rng,
    has_all_twins: Option<bool>,
    /// Driven since the start.
    metres: f64,
    /// Evaluations of the present cycle, of all that are complete, and of the longest.
    cycle: u64,
    evaluations: u64,
    longest_cycle: u64,
}

/// What the robot has measured at a ping: as in [`Heard`].
struct Measured {
    travel: [f64; 2],
    bearing: f64,
    range: Option<f64>,
}

impl Drive<'_> {
    /// Drives on to a time, pings and searches.
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    fn ping(&mut self, time: f64) -> Measured {
        let driven = time.min(self.until);
        let [right, left] = self.plant.drive_to(driven, &mut self.wheels, &mut self.slips).measured;
        let turn = (right - left) / self.track_width;
        let advance = f64::midpoint(right, left);
        self.metres += advance.abs();
        // Simulated wheels are finite, and so are ranges.
        _ = self.search.odometry(Metres(advance as f32), Radians(turn as f32));
        let bearing = self.search.aim();
        let pose = self.plant.pose();
        let at = self.simulation.sonar_at(&pose);
        let servo = self.noise.random_range(-SERVO_ERROR..SERVO_ERROR);
        let direction = angle::wrap(pose.heading + f64::from(bearing.0) + servo);
        let ping = Ping { time, sonar_after: &|_| at, direction };
        let (world, sensor) = (self.simulation.world(), self.simulation.sensor());
        let echo = world.echo(&ping, sensor, &mut self.noise, &mut self.luck);
        let stretch = 1.0 + self.simulation.range_scale();
        let range = echo.map(|echo| Metres((echo.range * stretch) as f32));
        let shortest = self.simulation.config().rangers.first.min_range;
        let range = range.filter(|range| *range >= shortest);
        _ = self.search.ping(bearing, range);
        let has_begun = self.search.pings() >= LEAST_PINGS;
        for _ in 0..EVALUATIONS / EVALUATIONS_PER_MILLISECOND {
            let cycles = self.search.cycles();
            self.search.poll(EVALUATIONS_PER_MILLISECOND);
            self.cycle += u64::from(has_begun) * u64::from(EVALUATIONS_PER_MILLISECOND);
            if self.search.cycles() != cycles {
                self.evaluations += self.cycle;
                self.longest_cycle = self.longest_cycle.max(self.cycle);
                self.cycle = 0;
            }
        }
        Measured {
            travel: [advance, turn],
            bearing: bearing.0.into(),
            range: range.map(|range| range.0.into()),
        }
    }

    /// Notes whether the true pose and its images under every motion are among several answers.
    fn note_twins(&mut self, symmetries: &[Symmetry]) {
        let whole = || symmetries.iter().filter(|symmetry| symmetry.is_whole());
        if whole().next().is_none() {
            return;
        }
        let found = self.has_all_twins.get_or_insert(false);
        let Answer::Several(count) = self.search.answer() else { return };
        let truth = self.plant.pose();
        let answers: Vec<Hypothesis> = self.search.hypotheses().take(count).collect();
        let pose = [truth.x, truth.y, truth.heading];
        let images = whole().flat_map(|symmetry| symmetry.motion.images(pose));
        let mut wanted = images.chain([pose]).map(|[x, y, heading]| Pose { x, y, heading });
        *found = wanted.all(|twin| answers.iter().any(|answer| is_right(answer, &twin)));
    }

    fn result(&self, seed: u64, unique: Option<(f64, Hypothesis)>) -> Trial {
        let truth = self.plant.pose();
        let errors = |hypothesis: &Hypothesis| errors(hypothesis, &truth);
        let is_right = |hypothesis: &Hypothesis| is_right(hypothesis, &truth);
        let (position_error, heading_error) =
            unique.as_ref().map_or((0.0, 0.0), |(_, found)| errors(found));
        Trial {
            seed,
            walls: self.simulation.scenario.floor.named_walls().len(),
            unique_after: unique.as_ref().map(|(after, _)| *after),
            metres: self.metres,
            is_right: unique.as_ref().is_some_and(|(_, found)| is_right(found)),
            position_error,
            heading_error,
            rank: self.search.hypotheses().position(|hypothesis| is_right(&hypothesis)),
            answers: match self.search.answer() {
                Answer::Several(count) => count,
                Answer::Unique(_) => 1,
                Answer::Searching | Answer::Nowhere | Answer::Along { .. } => 0,
            },
            has_all_twins: self.has_all_twins,
            cycles: self.search.cycles(),
            evaluations: self.evaluations,
            longest_cycle: self.longest_cycle,
        }
    }
}

fn is_right(hypothesis: &Hypothesis, truth: &Pose) -> bool {
    are_one(&pose_of(hypothesis), truth)
}

/// Whether a pose is within the errors of a right answer of another.
#[must_use]
pub fn are_one(found: &Pose, other: &Pose) -> bool {
    let (position, heading) = differences(found, other);
    position < RIGHT.0 && heading < RIGHT.1
}

fn errors(hypothesis: &Hypothesis, truth: &Pose) -> (f64, f64) {
    differences(&pose_of(hypothesis), truth)
}

/// The pose of a hypothesis.
#[must_use]
pub fn pose_of(hypothesis: &Hypothesis) -> Pose {
    let found = hypothesis.pose;
    Pose { x: found.x.0.into(), y: found.y.0.into(), heading: found.heading.radians().0.into() }
}

fn differences(found: &Pose, other: &Pose) -> (f64, f64) {
    let position = (found.x - other.x).hypot(found.y - other.y);
    (position, angle::wrap(found.heading - other.heading).abs())
}

pub(crate) fn stream(seed: u64, number: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Apart from the streams of a run and of a floor plan.
    rng.set_stream(100 + number);
    rng
}
