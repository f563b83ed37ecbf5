//! The posterior of the pose at the first ping.
//!
//! It is on a grid, which is refined as it narrows: cells far below the best are dropped, and the others are divided as soon as they are
//! few. A cell's likelihoods are those of its centre, with the noise of its size. What is expected is that of `World::reflectors`; furniture
//! is not in the map, and stands at random with the free path of the robot file.

use std::f64::consts::TAU;

use sonarfix_plan::trial::{Heard, are_one};
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::reflector::Reflector;
use sonarfix_sim::world::segment::Segment;
use sonarfix_sim::world::sensor::{Curve, SensorModel, WAVELENGTH};
use sonarfix_sim::world::{Ping, World};

use super::odometry::{Motions, Odometry, moved};

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

/// A pose at the first ping with the drift of the odometry, and the logarithm of its likelihood.
#[derive(Debug, Clone, Copy)]
struct Cell {
    pose: Pose,
    /// The number of the drift.
    drift: usize,
    log: f64,
}

/// The posterior of the pose at the first ping.
pub(super) struct Posterior<'a> {
    simulation: &'a Simulation,
    /// What the map holds: no furniture.
    world: World,
    /// Mean distance that a beam goes until it meets an object that is not in the map, metres; infinite without such objects.
    free_path: f64,
    halvings: u32,
    sensor: SensorModel,
    cells: Vec<Cell>,
    motions: Motions,
    pings: Vec<Heard>,
}

impl<'a> Posterior<'a> {
    pub(super) fn new(simulation: &'a Simulation, odometry: Odometry) -> Self {
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
            motions: Motions::new(simulation, odometry),
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
    pub(super) fn add(&mut self, heard: Heard) {
        self.pings.push(heard);
        self.motions.add(&self.pings);
        let last = self.pings.len() - 1;
        let mut cells = std::mem::take(&mut self.cells);
        for cell in &mut cells {
            cell.log += self.log_likelihood(cell, last);
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
        let drifts = self.motions.halve(&self.pings);
        let (place, angle) = self.half_cell();
        let halves = |cell: &Cell| {
            let Cell { pose, drift, .. } = *cell;
            let drifts = (0..drifts).map(move |part| drifts * drift + part);
            drifts.flat_map(move |drift| {
                (0..8_u8).map(move |part| {
                    let side = |bit: u8| if part & bit == 0 { -1.0 } else { 1.0 };
                    let pose = Pose {
                        x: pose.x + side(1) * place,
                        y: pose.y + side(2) * place,
                        heading: pose.heading + side(4) * angle,
                    };
                    Cell { pose, drift, log: 0.0 }
                })
            })
        };
        let cells = self.cells.iter().flat_map(halves).map(|cell| {
            let pings = (0..self.pings.len()).map(|ping| self.log_likelihood(&cell, ping));
            let log = self.motions.log_prior(cell.drift) + pings.sum::<f64>();
            Cell { log, ..cell }
        });
        self.cells = cells.collect();
    }

    /// ln p(ping | cell) of the ping with this number.
    fn log_likelihood(&self, cell: &Cell, number: usize) -> f64 {
        let Some(heard) = self.pings.get(number) else { return 0.0 };
        let motion = self.motions.at(cell.drift, number);
        let pose = moved(&cell.pose, &motion);
        let at = self.simulation.sonar_at(&pose);
        let direction = pose.heading + heard.bearing;
        let ping = Ping { time: 0.0, sonar_after: &|_| at, direction };
        let (place, angle) = self.half_cell();
        let turned = motion.x.hypot(motion.y) * angle;
        let spread = place.hypot(turned).hypot(self.motions.spread(number));
        let blur = (spread / 3.0_f64.sqrt()).hypot(self.motions.deviation(number));
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
    pub(super) fn found(&self) -> Option<Pose> {
        let last = self.pings.len().checked_sub(1)?;
        let best = self.cells.iter().max_by(|one, other| one.log.total_cmp(&other.log))?;
        let now = |cell: &Cell| moved(&cell.pose, &self.motions.at(cell.drift, last));
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
            let of = |&heading: &f64| {
                let pose = Pose { x, y, heading };
                Cell { pose, drift: 0, log: 0.0 }
            };
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

#[cfg(test)]
mod tests {
    use sonarfix_map::{Floor, NamedWall};

    use super::*;
    use crate::floor_plan::FloorPlan;

    /// The probabilities of no echo and of all ranges sum to one.
    #[test]
    fn a_ping_returns_something() -> Result<(), Box<dyn core::error::Error>> {
        for seed in 0..2 {
            let simulation = Simulation::new(FloorPlan::new(seed).scenario()?);
            let posterior = Posterior::new(&simulation, Odometry::Exact);
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
            let mut posterior = Posterior::new(&simulation, Odometry::Exact);
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
}
