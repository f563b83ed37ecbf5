//! The example `paper_robot` on the paper's path: the smallest program on the filter reaches the accuracy of the paper.

#[path = "../../crates/sonarfix/examples/paper_robot/robot.rs"]
mod robot;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use robot::{Outcome, PaperRobot};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix_map::Scenario;
use sonarfix_sim::angle;
use sonarfix_sim::plant::Plant;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::world::Ping;

const RUNS: u64 = 40;
/// Encoder samples between two ranges, and those of the run: 1,248 s at ten samples a second.
const SAMPLES_A_RANGE: u32 = 10;
const SAMPLES: u32 = 12_480;
/// Standard deviations of the paper's Table 1 for the errors at the end: x of 3.5 mm, heading of 0.25°, and of the estimated scale
/// errors. Its y, 0.2 mm, is less than the Cramér–Rao bound of 1.07 mm, which is taken here.
const PAPER: [f64; 5] = [3.5e-3, 1.07e-3, 0.25 * core::f64::consts::PI / 180.0, 1.75e-4, 1.95e-4];
/// The deviation of 40 runs has a relative sampling error of 11 %: four of them.
const TOLERANCE: f64 = 1.45;

#[test]
fn the_smallest_robot_is_as_accurate_as_that_of_the_paper() {
    let simulation = Simulation::new(Scenario::paper().unwrap());
    let mut squares = [0.0; PAPER.len()];
    for seed in 0..RUNS {
        for (sum, error) in squares.iter_mut().zip(run(&simulation, seed)) {
            *sum += error * error;
        }
    }
    for (square, paper) in squares.into_iter().zip(PAPER) {
        let rms = (square / RUNS as f64).sqrt();
        assert!(rms < TOLERANCE * paper, "{rms} where the paper has {paper}");
        assert!(rms > 0.01 * paper, "{rms}: a robot without noise is not the paper's");
    }
}

/// A range of another wall, or of none, changes nothing.
#[test]
fn a_range_beyond_the_gate_is_not_used() {
    let simulation = Simulation::new(Scenario::paper().unwrap());
    let walls = simulation.scenario.floor.walls();
    let mut robot =
        PaperRobot::new(Pose::new(0.0, 0.0, Radians(1.5)), Metres(0.35), &walls).unwrap();
    let target = robot.aim().unwrap();
    let before = robot.state();
    for range in [1.4, 1.7, f32::NAN] {
        assert_eq!(robot.fix(&target, Metres(range)), Ok(Outcome::Gated), "{range}");
        assert_eq!(robot.state(), before, "{range}");
    }
    assert_eq!(robot.fix(&target, Metres(1.501)), Ok(Outcome::Accepted));
    assert_ne!(robot.state(), before);
}

/// Errors of x, y, heading and scale errors at the end of a run.
fn run(simulation: &Simulation, seed: u64) -> [f64; PAPER.len()] {
    let [mut wheels, mut slips, mut noise, mut echoes] =
        [0, 1, 2, 3].map(|stream| ChaCha8Rng::seed_from_u64(4 * seed + stream));
    let walls = simulation.scenario.floor.walls();
    let mut plant = Plant::new(&simulation.scenario, 0.0);
    let start = plant.pose();
    let pose = Pose::new(start.x as f32, start.y as f32, Radians(start.heading as f32));
    let mut robot = PaperRobot::new(pose, Metres(0.35), &walls).unwrap();
    for sample in 1..=SAMPLES {
        let time = f64::from(sample) / 10.0;
        let travel = plant.drive_to(time, &mut wheels, &mut slips);
        let [right, left] = travel.measured.map(|metres| metres as f32);
        robot.odometry(WheelTravel::new(right, left)).unwrap();
        if !sample.is_multiple_of(SAMPLES_A_RANGE) {
            continue;
        }
        let Some(target) = robot.aim() else { continue };
        let truth = plant.pose();
        let ping = Ping {
            time,
            sonar_after: &|_| [truth.x, truth.y],
            direction: angle::wrap(truth.heading + f64::from(target.bearing.0)),
        };
        let (world, sensor) = (simulation.world(), simulation.sensor());
        if let Some(echo) = world.echo(&ping, sensor, &mut noise, &mut echoes) {
            robot.fix(&target, Metres(echo.range as f32)).unwrap();
        }
    }
    let (truth, estimate) = (plant.state(), robot.state());
    let estimate = estimate.to_array().map(f64::from);
    [0, 1, 2, 3, 4].map(|state| match state {
        2 => angle::wrap(estimate[2] - truth[2]),
        _ => estimate[state] - truth[state],
    })
}
