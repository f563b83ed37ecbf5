//! A simulated robot, at the fidelity of pins, that sweeps with its sonar while a person steers it, and what its
//! software records.

use nalgebra::Vector3;
use sonarfix::geometry::pose::Point;
use sonarfix::localizer::Localizer;
use sonarfix::map::Wall;
use sonarfix_batch::recording::{Ping, Reading, Recording, StartPose};
use sonarfix_hal::config::{RobotConfig, StartPose as Start};
use sonarfix_hal::robot::{Report, Step, StepResult};
use sonarfix_map::Scenario;
use sonarfix_sim::simulate::{Simulation, SimulationError};
use sonarfix_sim::trace::{FixRecord, Pose, Recorder, Tick};

/// What a drive left: the recording, and the true poses.
#[derive(Debug, Clone, Default)]
pub struct Drive {
    /// What the robot recorded.
    pub recording: Recording,
    /// True poses: time, pose.
    pub truth: Vec<(f64, Pose)>,
}

/// Drives along the scenario's path. The software is configured as `robot`, whose mount and servo may differ from those
/// of the scenario's robot. It has no map and no pose: its map is one wall far away, so long that
/// no place along it is unique, so that it sweeps all the time.
///
/// # Errors
/// [`SimulationError`], if the robot does not start.
pub fn drive(
    mut scenario: Scenario,
    mut robot: RobotConfig,
    seed: u64,
) -> Result<(Drive, Simulation), SimulationError> {
    const FAR: f32 = 9_000.0;
    robot.start = Start::Unknown { region: None };
    scenario.robot.start = robot.start;
    scenario.start.is_unknown = true;
    let begin = scenario.path.pose_at(0.0);
    let far = Wall::new(Point::new(FAR, 0.0), Point::new(FAR, FAR)).into_iter().collect();
    let simulation = Simulation::new(scenario).believing(robot, far);
    let mut recorder = Sweeps::default();
    simulation.run(seed, &mut recorder)?;
    let mut drive = recorder.drive;
    drive.recording.start = Some(StartPose {
        time: 0.0,
        pose: Vector3::new(begin.x, begin.y, begin.heading),
        position: 0.02,
        heading: 0.035,
    });
    drive.recording.readings.insert(0, Reading { time: 0.0, travel: [0.0, 0.0] });
    drive.recording.readings.dedup_by(|next, one| next.time <= one.time);
    Ok((drive, simulation))
}

/// Records the inputs of the localizer.
#[derive(Default)]
struct Sweeps {
    drive: Drive,
    travel: [f64; 2],
}

impl Sweeps {
    fn step(&mut self, step: &Step) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "some hours in µs")]
        let time = step.at.ticks() as f64 * 1e-6;
        if !matches!(step.result, StepResult::Deferred(_)) {
            let [right, left] = self.travel;
            let (by_right, by_left) = (step.travel.right.0, step.travel.left.0);
            self.travel = [right + f64::from(by_right), left + f64::from(by_left)];
            self.drive.recording.readings.push(Reading { time, travel: self.travel });
        }
        time
    }
}

impl Recorder for Sweeps {
    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let tick = make();
        if let Some(truth) = tick.truth {
            self.drive.truth.push((tick.time, truth.pose));
        }
    }

    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}

    fn polled(&mut self, report: &Report, _: &Localizer) {
        if let Some(swept) = &report.swept {
            let heard = swept.step.as_ref().map(|step| self.step(step));
            let last = self.drive.recording.readings.last().map_or(0.0, |reading| reading.time);
            let range = swept.outcome.ok().map(|echo| f64::from(echo.range.0));
            self.drive.recording.pings.push(Ping {
                time: heard.unwrap_or(last),
                bearing: swept.bearing.0.into(),
                range: range.filter(|_| heard.is_some()),
            });
        }
        if let Some(step) = report.tick.as_ref().and_then(|tick| tick.step.as_ref()) {
            self.step(step);
        }
    }
}

#[cfg(test)]
mod tests {
    use sonarfix_plan::trial::PERIOD;

    use super::*;
    use crate::floor_plan::FloorPlan;

    /// The trials of the search ping as often as the loop at the fidelity of pins.
    #[test]
    #[expect(clippy::cast_precision_loss, reason = "some thousand pings")]
    fn a_sweep_has_the_period_of_the_trials() -> Result<(), Box<dyn core::error::Error>> {
        for seed in 0..2 {
            let scenario = FloorPlan::new(seed).scenario()?;
            let robot = scenario.robot;
            let pings = drive(scenario, robot, seed)?.0.recording.pings;
            let end = pings.last().map_or(0.0, |ping| ping.time);
            let period = end / pings.len() as f64;
            assert!((period / PERIOD - 1.0).abs() < 0.05, "{period} s");
        }
        Ok(())
    }
}
