//! A cell of the study: a family of rooms with objects, a sensor and a robot.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{FileError, Floor, Scenario};
use sonarfix_sim::simulate::{Simulation, SimulationError};

use super::family::{Family, Room};
use super::objects::{Objects, Scene};
use super::robot::Robot;
use super::sensor::Sensor;
use super::sums::Sums;
use super::text;
use super::watch::Watch;

/// The tables that are the same for every room.
const ROBOT: &str = include_str!("scenario.toml");

/// Why a run failed.
#[derive(Debug, thiserror::Error)]
pub enum RoomError {
    /// The room is invalid.
    #[error(transparent)]
    Room(#[from] FileError),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] SimulationError),
}

/// What is the same in all runs of a cell.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// The family of rooms.
    pub family: Family,
    /// What is not in the map.
    pub objects: Objects,
    /// The sensor.
    pub sensor: Sensor,
    /// The robot.
    pub robot: Robot,
}

impl Cell {
    /// Whether the page has it: a robot whose file is wrong has an HC-SR04 there, and an empty room.
    #[must_use]
    pub fn is_of_page(&self) -> bool {
        let is_plain = self.sensor == Sensor::HcSr04 && self.objects == Objects::Nothing;
        self.robot.is_nominal() || is_plain
    }

    /// The run of a seed.
    ///
    /// # Errors
    /// [`RoomError`].
    pub fn run(&self, seed: u64) -> Result<Sums, RoomError> {
        let (room, scene, mut rng) = self.scene(seed);
        let simulation = self.simulation(&self.text(seed, &room, &scene, &mut rng), &scene)?;
        let mut watch = Watch::new(room.unobservable);
        let result = simulation.run(seed, &mut watch)?;
        Ok(Sums::of(&result, &watch))
    }

    /// The run of a seed as a scenario. It lacks what a scenario cannot say: another map than the walls, and obstacles that change.
    #[must_use]
    pub fn toml(&self, seed: u64) -> String {
        let (room, scene, mut rng) = self.scene(seed);
        self.text(seed, &room, &scene, &mut rng)
    }

    /// The room of a seed, with objects of a random stream of their own, so that the same room has none; and the random numbers for
    /// the errors of the robot.
    fn scene(&self, seed: u64) -> (Room, Scene, ChaCha8Rng) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let room = self.family.room(&mut rng);
        let mut objects_rng = ChaCha8Rng::seed_from_u64(seed);
        objects_rng.set_stream(1);
        let scene = Scene::new(&room, self.objects, &mut objects_rng);
        (room, scene, rng)
    }

    fn text(&self, seed: u64, room: &Room, scene: &Scene, rng: &mut ChaCha8Rng) -> String {
        let name = format!("{}, {}, seed {seed}", self.family.name(), self.objects.name());
        let scenario = text::scenario(&name, room, scene, rng);
        format!("{scenario}{}\n{ROBOT}", self.sensor.tables())
    }

    fn simulation(&self, text: &str, scene: &Scene) -> Result<Simulation, RoomError> {
        let mut scenario = Scenario::parse(text, "room.toml", std::path::Path::new(""))?;
        let map = Floor::parse(&text::map(&scene.map), "map.toml")?;
        self.robot.drive(&mut scenario);
        let robot = scenario.robot;
        let mut simulation = Simulation::new(scenario).believing(robot, map.walls());
        if let Some((from, obstacles)) = &scene.later {
            simulation = simulation.rearranged(*from, obstacles);
        }
        Ok(simulation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_gives_valid_scenarios_that_differ_by_seed() {
        for family in Family::ALL {
            for objects in Objects::ALL {
                let cell = Cell { family, objects, sensor: Sensor::Nxt, robot: Robot::NOMINAL };
                for seed in 0..3 {
                    let (_, scene, _) = cell.scene(seed);
                    let simulation = cell.simulation(&cell.toml(seed), &scene);
                    let seconds = simulation.unwrap().seconds();
                    assert!(seconds >= text::DURATION, "{} {seed}", family.name());
                }
                assert_ne!(cell.toml(0), cell.toml(1));
                assert_eq!(cell.toml(7), cell.toml(7));
            }
        }
    }

    #[test]
    fn every_sensor_localizes_in_an_empty_room() {
        for sensor in Sensor::ALL {
            let cell = Cell {
                family: Family::Corner,
                objects: Objects::Nothing,
                sensor,
                robot: Robot::NOMINAL,
            };
            let sums = cell.run(0).unwrap();
            assert!(sums.lost == 0 && sums.rms() < 0.05, "{}: {}", sensor.name(), sums.rms());
        }
    }
}
