//! How soon a pose can be found at all: the posterior over all poses of the map, with the odometry known exactly, by the model of
//! the simulated sonar and the pings of a trial of the search.
//!
//! The posterior is on a grid of the pose at the first ping, which is refined as it narrows: cells far below the best are dropped, and
//! the others are divided as soon as they are few. A cell's likelihoods are those of its centre, with the noise of its size. What is
//! expected is that of `World::reflectors`; furniture is not in the map, and stands at random with the free path of the robot file.

use std::f64::consts::TAU;

use serde::Serialize;
use sonarfix_map::Scenario;
use sonarfix_plan::trial::{Heard, SetDown, Trial, TrialError, are_one, observed_trial};
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::reflector::Reflector;
use sonarfix_sim::world::segment::Segment;
use sonarfix_sim::world::sensor::{Curve, SensorModel, WAVELENGTH};
use sonarfix_sim::world::{Ping, World};

use crate::search_study::Plans;

/// Odds of the best pose against all others together at which it is found.
const ODDS: f64 = 1_000.0;
/// Cells of the first grid, metres and radians.
const FIRST_CELL: (f64, f64) = (0.2, TAU / 36.0);
/// How often a cell is halved at most: 12.5 mm and 0.6°.
const HALVINGS: u32 = 4;
/// So many cells at most after a division.
const CELLS: usize = 6_000;
/// A cell is dropped when its logarithm is by this below the best one's.
const DROPPED: f64 = 18.0;
/// Least density of a range, 1/m, and of no echo, of the finest cells: the grid is an approximation. Of larger ones it is larger.
const LEAST: f64 = 1e-4;

/// How soon one trial was found, and could have been.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bounded {
    /// The trial.
    pub trial: Trial,
    /// Seconds until the posterior odds of one pose exceed 1000.
    pub possible_after: Option<f64>,
    /// Whether that pose is the true one.
    pub is_right: bool,
}

/// Trials in floor plans, each with its bound.
///
/// # Errors
/// [`TrialError`] of the first plan that cannot be used.
pub fn floor_plans(
    plans: &Plans,
    seconds: f64,
    progress: &impl Progress,
) -> Result<Vec<Bounded>, TrialError> {
    plans.each(progress, |scenario, seed| bounded(scenario, seed, SetDown::Anywhere, seconds))
}

/// The time within which a share of the trials is found right; `None` if fewer are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// 50 %, seconds.
    pub half: Option<f64>,
    /// 80 %.
    pub four_fifths: Option<f64>,
    /// 95 %.
    pub nineteen_twentieths: Option<f64>,
    /// Share of the trials in which a wrong pose is found.
    pub wrong: f64,
}

impl Quantiles {
    /// Of the times of `trials`, and whether what is found then is right.
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 trials")]
    pub(crate) fn new(trials: &[(Option<f64>, bool)]) -> Self {
        let mut right: Vec<f64> =
            trials.iter().filter(|trial| trial.1).filter_map(|trial| trial.0).collect();
        right.sort_by(f64::total_cmp);
        let within = |percent: usize| right.get(trials.len() * percent / 100).copied();
        let wrong = trials.iter().filter(|trial| trial.0.is_some() && !trial.1).count();
        Self {
            half: within(50),
            four_fifths: within(80),
            nineteen_twentieths: within(95),
            wrong: wrong as f64 / trials.len() as f64,
        }
    }
}

/// The times over many trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Times {
    /// Trials.
    pub trials: usize,
    /// The bound.
    pub possible: Quantiles,
    /// The search.
    pub found: Quantiles,
    /// Median of the time of the search over the bound, of the trials that have a bound. A trial that the search does not find counts
    /// as the largest; `None` if it finds fewer than half.
    pub ratio: Option<f64>,
}

impl Times {
    /// The times of some trials.
    #[must_use]
    pub fn new(trials: &[Bounded]) -> Self {
        let possible: Vec<_> = trials.iter().map(|it| (it.possible_after, it.is_right)).collect();
        let found: Vec<_> =
            trials.iter().map(|it| (it.trial.unique_after, it.trial.is_right)).collect();
        let with_bound = trials.iter().filter(|it| it.is_right);
        let mut ratios: Vec<f64> = with_bound
            .map(|it| {
                let found = it.trial.unique_after.unwrap_or(f64::INFINITY);
                found / it.possible_after.unwrap_or(f64::INFINITY)
            })
            .collect();
        ratios.sort_by(f64::total_cmp);
        let ratio = ratios.get(ratios.len() / 2).copied().filter(|ratio| ratio.is_finite());
        Self {
            trials: trials.len(),
            possible: Quantiles::new(&possible),
            found: Quantiles::new(&found),
            ratio,
        }
    }
}

/// One trial with its bound.
///
/// # Errors
/// [`TrialError`], if the map cannot be used.
pub fn bounded(
    scenario: Scenario,
    seed: u64,
    set_down: SetDown,
    seconds: f64,
) -> Result<Bounded, TrialError> {
    let simulation = Simulation::new(scenario.clone());
    let mut posterior = Posterior::new(&simulation);
    let mut found = None;
    let trial = observed_trial(scenario, seed, set_down, seconds, |heard, _| {
        if found.is_none() {
            let (time, truth) = (heard.time, heard.pose);
            posterior.add(heard);
            found = posterior.found().map(|pose| (time, are_one(&pose, &truth)));
        }
        found.is_none()
    })?;
    let possible_after = found.map(|(time, _)| time);
    Ok(Bounded { trial, possible_after, is_right: found.is_some_and(|(_, is_right)| is_right) })
}

/// A pose at the first ping, and the logarithm of its likelihood.
#[derive(Debug, Clone, Copy)]
struct Cell {
    pose: Pose,
    log: f64,
}

/// The posterior of the pose at the first ping.
struct Posterior<'a> {
    simulation: &'a Simulation,
    /// What the map holds: no furniture.
    world: World,
    /// Mean distance that a beam goes until it meets an object that is not in the map, metres; infinite without such objects.
    free_path: f64,
    halvings: u32,
    sensor: SensorModel,
    cells: Vec<Cell>,
    pings: Vec<Heard>,
}

impl<'a> Posterior<'a> {
    fn new(simulation: &'a Simulation) -> Self {
        let world = World::new(&simulation.scenario.floor);
        let free_path = f64::from(simulation.config().echo.free_path.0);
        let cells = first_grid(&world);
        let mut posterior = Self {
            simulation,
            world,
            free_path: if free_path > 0.0 { free_path } else { f64::INFINITY },
            halvings: 0,
            sensor: simulation.sensor().clone(),
            cells,
            pings: Vec::new(),
        };
        posterior.sensor = posterior.blurred();
        posterior
    }

    /// Half of a cell's edges, metres and radians.
    fn half_cell(&self) -> (f64, f64) {
        let share = 0.5 * 0.5_f64.powf(f64::from(self.halvings));
        (share * FIRST_CELL.0, share * FIRST_CELL.1)
    }

    /// The sonar as heard from anywhere in a cell: the angle to a reflector at a metre differs by the size of the cell.
    fn blurred(&self) -> SensorModel {
        let (place, angle) = self.half_cell();
        let (true_sensor, spread) = (self.simulation.sensor(), angle + place);
        let mut sensor = true_sensor.clone();
        sensor.cone += spread;
        let rim = true_sensor.mirror.blur.at(1.0);
        sensor.mirror.blur = Curve::level(rim.hypot(0.5 * spread));
        sensor
    }

    /// Multiplies the posterior by the likelihood of a ping.
    fn add(&mut self, heard: Heard) {
        self.pings.push(heard);
        let mut cells = std::mem::take(&mut self.cells);
        for cell in &mut cells {
            cell.log += self.log_likelihood(&cell.pose, &heard);
        }
        self.cells = cells;
        self.drop_improbable();
        while self.halvings < HALVINGS && 8 * self.cells.len() <= CELLS {
            self.divide();
            self.drop_improbable();
        }
    }

    fn drop_improbable(&mut self) {
        let best = self.cells.iter().map(|cell| cell.log).fold(f64::NEG_INFINITY, f64::max);
        self.cells.retain(|cell| cell.log > best - DROPPED);
    }

    /// Halves the cells in each direction, and computes the likelihoods of all pings so far again.
    fn divide(&mut self) {
        self.halvings += 1;
        self.sensor = self.blurred();
        let (place, angle) = self.half_cell();
        let halves = |cell: &Cell| {
            let pose = cell.pose;
            (0..8_u8).map(move |part| {
                let side = |bit: u8| if part & bit == 0 { -1.0 } else { 1.0 };
                Pose {
                    x: pose.x + side(1) * place,
                    y: pose.y + side(2) * place,
                    heading: pose.heading + side(4) * angle,
                }
            })
        };
        let cells = self.cells.iter().flat_map(halves).map(|pose| {
            let log = self.pings.iter().map(|heard| self.log_likelihood(&pose, heard)).sum();
            Cell { pose, log }
        });
        self.cells = cells.collect();
    }

    /// ln p(ping | pose at the first ping).
    fn log_likelihood(&self, first: &Pose, heard: &Heard) -> f64 {
        let origin = self.pings.first().map_or(heard.pose, |ping| ping.pose);
        let pose = carried(first, &origin, &heard.pose);
        let at = self.simulation.sonar_at(&pose);
        let direction = pose.heading + heard.bearing;
        let ping = Ping { time: 0.0, sonar_after: &|_| at, direction };
        let (place, angle) = self.half_cell();
        let driven = (heard.pose.x - origin.x).hypot(heard.pose.y - origin.y);
        let blur = place.hypot(driven * angle) / 3.0_f64.sqrt();
        let least = LEAST * 4.0_f64.powf(f64::from(HALVINGS - self.halvings));
        self.likelihood(&ping, heard.range, blur).max(least).ln()
    }

    /// The probability of no echo, or the density of a range, 1/m, whose expectation is wrong by `blur`.
    fn likelihood(&self, ping: &Ping, range: Option<f64>, blur: f64) -> f64 {
        let found = self.world.reflectors(ping, &self.sensor);
        let farthest = self.sensor.reach.1;
        let range = range.map(|range| range / (1.0 + self.simulation.range_scale()));
        let free = |distance: f64| (-distance / self.free_path).exp();
        // Probability that no reflector so far has answered, also of those before the range, and that an object has absorbed the sound.
        let (mut silent, mut silent_before, mut absorbed, mut from) = (1.0, 1.0, 0.0, 0.0);
        let mut density = 0.0;
        for Reflector { distance, off_axis, audible, .. } in found {
            absorbed += silent * (free(from) - free(distance));
            from = distance;
            if let Some(range) = range {
                let first = silent * free(distance) * audible;
                density += first * self.density(distance, off_axis, range, blur);
                silent_before =
                    if distance < range { silent * (1.0 - audible) } else { silent_before };
            }
            silent *= 1.0 - audible;
        }
        absorbed += silent * (free(from) - free(farthest));
        match range {
            Some(range) => {
                let object = (1.0 - SILENT_OBJECT) * free(range) / self.free_path;
                density + silent_before * object
            }
            None => silent * free(farthest) + SILENT_OBJECT * absorbed,
        }
    }

    /// Density of the range of a reflector that is detected, 1/m.
    fn density(&self, distance: f64, off_axis: f64, range: f64, blur: f64) -> f64 {
        let sensor = &self.sensor;
        let (nearest, farthest) = sensor.reach;
        let (short, long) = (sensor.short.at(distance), sensor.long.at(distance));
        let spurious = if range < distance {
            short / (distance - nearest).max(LEAST_SPAN)
        } else {
            (1.0 - short) * long / (farthest - distance).max(LEAST_SPAN)
        };
        let skipped = 0.5 * WAVELENGTH * sensor.skip.sqrt();
        let variance = sensor.noise.powi(2)
            + (sensor.noise_per_metre * distance).powi(2)
            + sensor.quantum.powi(2) / 12.0
            + skipped.powi(2)
            + blur.powi(2);
        let expected = distance + sensor.bias.at(off_axis.abs()) + 0.5 * WAVELENGTH * sensor.skip;
        let normal = (-0.5 * (range - expected).powi(2) / variance).exp() / (TAU * variance).sqrt();
        (1.0 - short) * (1.0 - long) * normal + spurious
    }

    /// The present pose, if its odds against all others together are high enough.
    fn found(&self) -> Option<Pose> {
        let (first, last) = (self.pings.first()?, self.pings.last()?);
        let best = self.cells.iter().max_by(|one, other| one.log.total_cmp(&other.log))?;
        let now = |cell: &Cell| carried(&cell.pose, &first.pose, &last.pose);
        let pose = now(best);
        let (mut with, mut against) = (0.0, 0.0);
        for cell in &self.cells {
            let weight = (cell.log - best.log).exp();
            *(if are_one(&now(cell), &pose) { &mut with } else { &mut against }) += weight;
        }
        (with > ODDS * against).then_some(pose)
    }
}

/// Probability that an object which is not in the map, in the beam, returns no echo (`docs/model.md`, eq. 15).
const SILENT_OBJECT: f64 = 0.2;
/// Smallest span of ranges over which spurious echoes are distributed, metres.
const LEAST_SPAN: f64 = 0.05;

/// The centres of the cells over the box of the walls, in all directions.
fn first_grid(world: &World) -> Vec<Cell> {
    let ends = || world.walls().iter().flat_map(Segment::ends);
    let columns = centres(ends().map(|[x, _]| x));
    let rows = centres(ends().map(|[_, y]| y));
    let headings = steps(0.5 * FIRST_CELL.1, TAU - 0.25 * FIRST_CELL.1, FIRST_CELL.1);
    let mut cells = Vec::with_capacity(columns.len() * rows.len() * headings.len());
    for &x in &columns {
        for &y in &rows {
            let of = |&heading: &f64| Cell { pose: Pose { x, y, heading }, log: 0.0 };
            cells.extend(headings.iter().map(of));
        }
    }
    cells
}

/// The centres of cells from the least of some coordinates to the greatest.
fn centres(of: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
    let (least, most) =
        (of.clone().fold(f64::INFINITY, f64::min), of.fold(f64::NEG_INFINITY, f64::max));
    steps(least + 0.5 * FIRST_CELL.0, most, FIRST_CELL.0)
}

/// From `first` on, below `end`.
fn steps(first: f64, end: f64, step: f64) -> Vec<f64> {
    let values = std::iter::successors(Some(first), |value| Some(value + step));
    values.take_while(|&value| value < end).collect()
}

/// The pose that `pose` has after the motion from one true pose to another.
fn carried(pose: &Pose, from: &Pose, to: &Pose) -> Pose {
    let turned = pose.heading - from.heading;
    let (sin, cos) = turned.sin_cos();
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    Pose {
        x: pose.x + cos * dx - sin * dy,
        y: pose.y + sin * dx + cos * dy,
        heading: to.heading + turned,
    }
}

#[cfg(test)]
mod tests {
    use sonarfix_map::{Floor, NamedWall};

    use super::*;
    use crate::floor_plan::FloorPlan;

    /// The probabilities of no echo and of all ranges sum to one.
    #[test]
    fn a_ping_returns_something() -> Result<(), TrialError> {
        for seed in 0..2 {
            let simulation = Simulation::new(FloorPlan::new(seed).scenario()?);
            let posterior = Posterior::new(&simulation);
            let path = &simulation.scenario.path;
            for n in 0..5 {
                let pose = path.pose_at(0.2 * f64::from(n) * path.duration());
                let at = [pose.x, pose.y];
                let ping = Ping {
                    time: 0.0,
                    sonar_after: &|_| at,
                    direction: pose.heading + f64::from(n),
                };
                let step = posterior.sensor.reach.1 / 2_000.0;
                let ranges = (0..2_000).map(|n| step * (0.5 + f64::from(n)));
                let density = |range| posterior.likelihood(&ping, Some(range), 0.01);
                let echo: f64 = ranges.map(|range| step * density(range)).sum();
                let sum = echo + posterior.likelihood(&ping, None, 0.01);
                assert!((sum - 1.0).abs() < 0.02, "seed {seed}, pose {n}: {sum}");
            }
        }
        Ok(())
    }

    /// A robot that stands in an L-shaped room is found by one sweep; in a square room it never is.
    #[test]
    fn a_sweep_tells_a_pose_unless_the_room_is_symmetric() -> Result<(), Box<dyn core::error::Error>>
    {
        let shapes: [(&[[f64; 2]], bool); 2] = [
            (&[[0.0, 0.0], [3.1, 0.0], [3.1, 1.4], [1.7, 1.4], [1.7, 2.6], [0.0, 2.6]], true),
            (&[[0.0, 0.0], [2.6, 0.0], [2.6, 2.6], [0.0, 2.6]], false),
        ];
        for (corners, is_unique) in shapes {
            let mut scenario = FloorPlan::new(0).scenario()?;
            let next = corners.iter().cycle().skip(1);
            let walls = (0..).zip(corners.iter().zip(next));
            let walls = walls.map(|(n, (&from, &to))| NamedWall::new(format!("{n}"), from, to));
            scenario.floor = Floor::new(walls.collect::<Result<_, _>>()?);
            let simulation = Simulation::new(scenario);
            let mut posterior = Posterior::new(&simulation);
            let truth = Pose { x: 0.9, y: 0.7, heading: 0.4 };
            for n in 0..36_u8 {
                let bearing = f64::from(n) * TAU / 36.0;
                let at = simulation.sonar_at(&truth);
                let direction = truth.heading + bearing;
                let ping = Ping { time: 0.0, sonar_after: &|_| at, direction };
                let found = posterior.world.reflectors(&ping, simulation.sensor());
                let first = found.iter().find(|reflector| reflector.audible > 0.5);
                let range = first.map(|first| first.distance * (1.0 + simulation.range_scale()));
                let (time, travel) = (f64::from(n) * 0.066, [0.0; 2]);
                posterior.add(Heard { time, pose: truth, travel, bearing, range });
            }
            let found = posterior.found();
            assert_eq!(found.is_some(), is_unique, "{found:?}");
            assert!(found.is_none_or(|pose| are_one(&pose, &truth)), "{found:?}");
        }
        Ok(())
    }

    #[test]
    fn times_are_those_within_which_a_share_is_found() {
        let trials: Vec<_> = (0..10_u8).map(|n| (Some(f64::from(n)), n != 3)).collect();
        let times = Quantiles::new(&trials);
        assert_eq!((times.half, times.four_fifths), (Some(6.0), Some(9.0)));
        assert_eq!((times.nineteen_twentieths, times.wrong), (None, 0.1));
    }
}
