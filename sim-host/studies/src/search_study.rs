//! Global localization in simulation: a robot that was set down anywhere on its path drives on, sweeps
//! with its sonar and searches for its pose.
//!
//! World, sonar and wheels are those of the simulator. The measurement timing is simplified: a ping
//! each [`PERIOD`] at exactly the requested bearing ± 1°, and the range belongs to its instant.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::{Map, MapError};
use sonarfix_hal::robot::EVALUATIONS_PER_MILLISECOND;
use sonarfix_map::{
    BakeError, FileError, Floor, Follow, NamedWall, PathError, Scenario, Symmetry, symmetries,
};
use sonarfix_search::search::{Answer, Hypothesis, Search, SearchParameters};
use sonarfix_sim::angle;
use sonarfix_sim::plant::Plant;
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::Ping;

use crate::floor_plan::{FloorPlan, Kind};

/// Time of one ping of an HC-SR04 on an SG90 with steps of 20°, seconds: a frame of the servo, the
/// turn, settling and the cycle of the sonar.
pub const PERIOD: f64 = 0.12;
/// Evaluations between two pings, which are 120 ms apart.
const EVALUATIONS: u16 = 120 * EVALUATIONS_PER_MILLISECOND;
/// Pings with which a search begins.
const LEAST_PINGS: usize = 12;
/// The largest systematic error of a wheel.
const WHEEL_ERROR: f64 = 0.01;
/// The largest deviation of the servo from the bearing, radians.
const SERVO_ERROR: f64 = 0.02;
/// A pose within these errors is right, metres and radians.
const RIGHT: (f64, f64) = (0.3, 0.175);

/// Why a trial cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum SearchStudyError {
    /// The floor plan cannot be read.
    #[error(transparent)]
    Plan(#[from] FileError),
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

/// Simulates one trial of at most `seconds`: the seed chooses the wheel errors and the place on the
/// path.
///
/// # Errors
/// [`SearchStudyError`], if the map cannot be used.
pub fn trial(scenario: Scenario, seed: u64, seconds: f64) -> Result<Trial, SearchStudyError> {
    let mut rng = stream(seed, 0);
    let errors = wheel_errors(&mut rng);
    let spare = scenario.path.duration() - seconds;
    let start = if spare > 1.0 { rng.random_range(0.0..spare) } else { 0.0 };
    drive(scenario, seed, errors, start, seconds)
}

/// As [`trial`], from a given time of the path on.
///
/// # Errors
/// As of [`trial`].
pub fn trial_from(
    scenario: Scenario,
    seed: u64,
    start: f64,
    seconds: f64,
) -> Result<Trial, SearchStudyError> {
    let errors = wheel_errors(&mut stream(seed, 0));
    drive(scenario, seed, errors, start, seconds)
}

/// Errors of the right and of the left wheel.
fn wheel_errors(rng: &mut ChaCha8Rng) -> [f64; 2] {
    [(); 2].map(|()| rng.random_range(-WHEEL_ERROR..WHEEL_ERROR))
}

fn drive(
    mut scenario: Scenario,
    seed: u64,
    errors: [f64; 2],
    start: f64,
    seconds: f64,
) -> Result<Trial, SearchStudyError> {
    [scenario.truth.scale_right, scenario.truth.scale_left] = errors;
    // There is no estimate to follow.
    scenario.follow = Follow::Truth;
    let simulation = Simulation::new(scenario);
    let image = simulation.baked_map()?;
    let config = simulation.config();
    let mut drive = Drive {
        search: Search::new(&config.sonar, Map::read(&image)?, SearchParameters::of(&config)),
        plant: Plant::new(&simulation.scenario, simulation.range_scale()),
        track_width: config.drive.track_width.0.into(),
        simulation: &simulation,
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
    while time < end && unique.is_none() {
        drive.ping(time);
        if let Answer::Unique(hypothesis) = drive.search.answer() {
            unique = Some((time - start, hypothesis));
        }
        drive.note_twins(&symmetries);
        time += PERIOD;
    }
    Ok(drive.result(seed, unique))
}

struct Drive<'a> {
    simulation: &'a Simulation,
    search: Search<'a>,
    plant: Plant<'a>,
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

impl Drive<'_> {
    /// Drives on to a time, pings and searches.
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    fn ping(&mut self, time: f64) {
        let [right, left] = self.plant.drive_to(time, &mut self.wheels, &mut self.slips).measured;
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
        let shortest = self.simulation.config().sonar.min_range;
        _ = self.search.ping(bearing, range.filter(|range| *range >= shortest));
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
    let (position, heading) = errors(hypothesis, truth);
    position < RIGHT.0 && heading < RIGHT.1
}

fn errors(hypothesis: &Hypothesis, truth: &Pose) -> (f64, f64) {
    let found = hypothesis.pose;
    let position = (f64::from(found.x.0) - truth.x).hypot(f64::from(found.y.0) - truth.y);
    (position, angle::wrap(f64::from(found.heading.radians().0) - truth.heading).abs())
}

/// Which floor plans.
#[derive(Debug, Clone, Copy)]
pub struct Plans {
    /// The seed of the first; the others count up from it.
    pub first: u64,
    /// How many.
    pub trials: u32,
    /// Of one kind alone.
    pub kind: Option<Kind>,
    /// Walls of each map: those of other plans stand far beside a plan, and a plan with more is left out.
    pub walls: Option<usize>,
}

impl Plans {
    /// Each with its scenario.
    fn scenarios(&self) -> Result<Vec<(u64, Scenario)>, SearchStudyError> {
        let seeds = (0..u64::MAX).map(|n| self.first.wrapping_add(n));
        let plans = seeds.map(FloorPlan::new);
        let plans = plans.filter(|plan| self.kind.is_none_or(|kind| plan.kind == kind));
        let scenarios = plans.map(|plan| Ok((plan.seed, plan.scenario()?)));
        let Some(walls) = self.walls else {
            return scenarios.take(self.trials as usize).collect();
        };
        let fits = |plan: &Result<(u64, Scenario), SearchStudyError>| {
            plan.as_ref().map_or(true, |(_, of)| of.floor.named_walls().len() <= walls)
        };
        let filled = scenarios.filter(fits).map(|plan| {
            let (seed, mut scenario) = plan?;
            scenario.floor = filled(&scenario.floor, seed, walls)?;
            Ok((seed, scenario))
        });
        filled.take(self.trials as usize).collect()
    }
}

/// Distance between two plans in one map, metres: more than the largest plan and the longest range.
const APART: f64 = 60.0;
/// Seeds of the plans beside a plan, from its own.
const BESIDE: u64 = 1_000_000;

/// A floor with walls of other plans beside it, as many as make it `count`.
fn filled(floor: &Floor, seed: u64, count: usize) -> Result<Floor, SearchStudyError> {
    let mut walls = floor.named_walls().to_vec();
    let mut east = 0.0;
    for n in 0..u64::MAX {
        if walls.len() >= count {
            break;
        }
        east += APART;
        let other = FloorPlan::new(seed.wrapping_add(BESIDE + n)).scenario()?;
        let shifted = other.floor.named_walls().iter().filter_map(|wall| {
            let [from, to] = [wall.from(), wall.to()].map(|[x, y]| [x + east, y]);
            NamedWall::new(format!("{} of {n}", wall.name()), from, to).ok()
        });
        walls.extend(shifted.take(count - walls.len()));
    }
    Ok(Floor::new(walls))
}

/// Trials in floor plans: the plan, the wheels and the place on the path of each come from its seed.
///
/// # Errors
/// [`SearchStudyError`] of the first plan that cannot be used.
pub fn floor_plans(
    plans: &Plans,
    seconds: f64,
    progress: &impl Progress,
) -> Result<Vec<Trial>, SearchStudyError> {
    let one = |(seed, scenario)| {
        let trial = trial(scenario, seed, seconds);
        progress.finished();
        trial
    };
    let scenarios = plans.scenarios()?.into_par_iter();
    scenarios.filter(|_| !progress.is_interrupted()).map(one).collect()
}

/// Trials in one scenario.
///
/// # Errors
/// [`SearchStudyError`], if its map cannot be used.
pub fn scenario(
    scenario: &Scenario,
    first: u64,
    trials: u32,
    seconds: f64,
    progress: &impl Progress,
) -> Result<Vec<Trial>, SearchStudyError> {
    let seeds = (0..u64::from(trials)).into_par_iter().map(|n| first.wrapping_add(n));
    let one = |seed| {
        let trial = trial(scenario.clone(), seed, seconds);
        progress.finished();
        trial
    };
    seeds.filter(|_| !progress.is_interrupted()).map(one).collect()
}

/// Shares and errors over many trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Summary {
    /// Trials.
    pub trials: usize,
    /// Share with a unique and right answer.
    pub unique_and_right: f64,
    /// The same within 45 seconds.
    pub right_within_45: f64,
    /// Share with a unique and wrong answer.
    pub unique_and_wrong: f64,
    /// Share with the true pose in the bank at the end.
    pub in_bank: f64,
    /// Share with the true pose as the best hypothesis at the end.
    pub best_is_right: f64,
    /// Share with the true pose and all its images among the last answers, of the trials in a
    /// map with symmetry; `None` without such trials.
    pub with_all_twins: Option<f64>,
    /// Mean evaluations of a cycle.
    pub cycle: f64,
    /// The same by the walls of its map.
    pub cycle_a_wall: f64,
    /// Evaluations of the longest cycle of a trial, on average.
    pub longest_cycle: f64,
    /// The same by the walls of the map.
    pub longest_cycle_a_wall: f64,
    /// Mean time to a unique answer, seconds.
    pub mean_seconds: f64,
    /// 95th percentile of the position error of right unique answers, metres.
    pub position_error_95: f64,
    /// 95th percentile of their heading error, radians.
    pub heading_error_95: f64,
}

impl Summary {
    /// The summary of some trials.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 trials")]
    pub fn new(trials: &[Trial]) -> Self {
        let count = |is: &dyn Fn(&Trial) -> bool| trials.iter().filter(|t| is(t)).count() as f64;
        let share = |is: &dyn Fn(&Trial) -> bool| count(is) / trials.len() as f64;
        let is_unique = |trial: &Trial| trial.unique_after.is_some();
        let mean =
            |of: &dyn Fn(&Trial) -> f64| trials.iter().map(of).sum::<f64>() / trials.len() as f64;
        let evaluations = trials.iter().map(|trial| trial.evaluations as f64).sum::<f64>();
        let right = || trials.iter().filter(|trial| trial.is_right);
        Self {
            trials: trials.len(),
            unique_and_right: share(&|trial| trial.is_right),
            right_within_45: share(&|trial| {
                trial.is_right && trial.unique_after.is_some_and(|after| after <= 45.0)
            }),
            unique_and_wrong: share(&|trial| is_unique(trial) && !trial.is_right),
            in_bank: share(&|trial| trial.rank.is_some()),
            best_is_right: share(&|trial| trial.rank == Some(0)),
            with_all_twins: trials.iter().any(|trial| trial.has_all_twins.is_some()).then(|| {
                count(&|trial| trial.has_all_twins == Some(true))
                    / count(&|trial| trial.has_all_twins.is_some())
            }),
            cycle: evaluations / trials.iter().map(|t| f64::from(t.cycles)).sum::<f64>(),
            cycle_a_wall: evaluations
                / trials.iter().map(|t| f64::from(t.cycles) * t.walls as f64).sum::<f64>(),
            longest_cycle: mean(&|trial| trial.longest_cycle as f64),
            longest_cycle_a_wall: mean(&|trial| trial.longest_cycle as f64 / trial.walls as f64),
            mean_seconds: trials.iter().filter_map(|trial| trial.unique_after).sum::<f64>()
                / count(&is_unique),
            position_error_95: percentile_95(right().map(|trial| trial.position_error).collect()),
            heading_error_95: percentile_95(right().map(|trial| trial.heading_error).collect()),
        }
    }
}

fn percentile_95(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() * 95 / 100).copied().unwrap_or(0.0)
}

fn stream(seed: u64, number: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Apart from the streams of a run and of a floor plan.
    rng.set_stream(100 + number);
    rng
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plan keeps its walls, and those of other plans stand out of the sonar's range.
    #[test]
    fn a_map_is_filled_with_other_plans_beside_the_plan() -> Result<(), SearchStudyError> {
        let plans = Plans { first: 43_000, trials: 3, kind: None, walls: Some(200) };
        for (seed, scenario) in plans.scenarios()? {
            let own = FloorPlan::new(seed).scenario()?.floor;
            let (own, all) = (own.named_walls(), scenario.floor.named_walls());
            assert_eq!((all.len(), all.get(..own.len())), (200, Some(own)));
            let right = own.iter().flat_map(|wall| [wall.from()[0], wall.to()[0]]);
            let right = right.fold(f64::NEG_INFINITY, f64::max);
            for wall in all.iter().skip(own.len()) {
                assert!(wall.from()[0] > right + 4.0 && wall.to()[0] > right + 4.0, "{wall:?}");
            }
        }
        Ok(())
    }

    #[test]
    fn plans_with_more_walls_are_left_out() -> Result<(), SearchStudyError> {
        let plans = Plans { first: 43_000, trials: 3, kind: None, walls: Some(30) };
        for (seed, scenario) in plans.scenarios()? {
            assert!(FloorPlan::new(seed).scenario()?.floor.named_walls().len() <= 30);
            assert_eq!(scenario.floor.named_walls().len(), 30);
        }
        Ok(())
    }

    /// No cycle is longer than all together, and none begins before there are twelve pings, of which each takes 4,800 evaluations.
    #[test]
    fn the_longest_cycle_is_one_of_all() -> Result<(), SearchStudyError> {
        let plans = Plans { first: 43_000, trials: 2, kind: None, walls: None };
        for trial in floor_plans(&plans, 10.0, &|| ())? {
            assert!(trial.cycles > 1 && trial.longest_cycle > 0, "{trial:?}");
            assert!(trial.longest_cycle < trial.evaluations, "{trial:?}");
            assert!(
                trial.longest_cycle * u64::from(trial.cycles) >= trial.evaluations,
                "{trial:?}"
            );
            assert!(trial.evaluations <= 4_800 * (83 - 11), "{trial:?}");
        }
        Ok(())
    }
}
