//! The simulation in processor in the loop equals the simulation of all other results.
#![cfg(test)]

use std::path::Path;

use sonarfix::filter::ekf::STATES;
use sonarfix::localizer::Localizer;
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::robot::Report;
use sonarfix_map::{CLASSROOM, Fidelity, Scenario, robot_file};
use sonarfix_pil_host::Emulated;
use sonarfix_pil_host::pair::Pair;
use sonarfix_pil_host::progress::Progress;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::RunResult;
use sonarfix_sim::trace::{FixRecord, Recorder, Tick};

/// A run with the requests of processor in the loop, answered by this computer.
fn alone(simulation: &Simulation, seed: u64) -> (RunResult, u64) {
    let mut pair = Pair::new(None, Progress::of(0.0));
    let mut computer = Emulated::new(simulation, &mut pair).unwrap();
    let result = simulation.run_on(&mut computer, seed, &mut ()).unwrap();
    (result, pair.requests())
}

#[test]
fn a_localizer_by_messages_equals_that_of_the_simulator_to_the_bit() {
    let simulation = Simulation::new(Scenario::paper().unwrap());
    for seed in 0..3 {
        let (asked, requests) = alone(&simulation, seed);
        assert_eq!(asked, simulation.run(seed, &mut ()).unwrap());
        assert_eq!(requests, 12_480 + 2 * 1_248);
    }
}

/// In processor in the loop the shipped loop is polled when it asks to be, in whole milliseconds, in the simulator at
/// events; the results must be as good.
#[test]
fn the_shipped_loop_drives_the_scenario_as_well() {
    const RUNS: u64 = 100;
    let mut scenario = Scenario::paper().unwrap();
    scenario.fidelity = Fidelity::Pins;
    let simulation = Simulation::new(scenario).shortened(60.0);
    let mut squares = [[0.0; 2]; STATES];
    for seed in 0..RUNS {
        let (asked, requests) = alone(&simulation, seed);
        let own = simulation.run(seed, &mut ()).unwrap();
        // At least once per encoder sample, and not every millisecond.
        assert!((600..6_000).contains(&requests), "{requests} polls");
        assert!(asked.fixes.accepted + 2 >= own.fixes.accepted && own.fixes.accepted > 50);
        assert!(asked.faults.is_none(), "{:?}", asked.faults);
        for (squares, (asked, own)) in squares.iter_mut().zip(asked.error.iter().zip(&own.error)) {
            squares[0] += asked * asked;
            squares[1] += own * own;
        }
    }
    // Other instants give other roundings to whole ticks of 1 mm, by which the errors of one run differ; those of many do not.
    for (state, [asked, own]) in squares.into_iter().map(|it| it.map(f64::sqrt)).enumerate() {
        let is_as_good = asked <= 1.15 * own && own <= 1.15 * asked;
        assert!(is_as_good, "state {state}: {asked} and {own} in all");
    }
}

/// What the loop did with its devices.
#[derive(Debug, Default)]
struct Conduct {
    /// Encoder samples.
    samples: u32,
    pings: u32,
    /// The bearings farthest to the right and to the left that were pinged at, degrees.
    bearings: (f32, f32),
}

impl Recorder for Conduct {
    fn tick(&mut self, _: impl FnOnce() -> Tick) {}

    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}

    fn polled(&mut self, report: &Report, _: &Localizer) {
        self.samples += u32::from(report.tick.is_some());
        if let Some(aim) = report.pinged {
            let bearing = aim.bearing.0.to_degrees();
            self.pings += 1;
            self.bearings = (self.bearings.0.min(bearing), self.bearings.1.max(bearing));
        }
    }
}

/// A minute of `classroom` with this robot, with the requests of processor in the loop.
fn in_the_classroom(robot: &RobotConfig) -> (RunResult, Conduct) {
    let mut scenario = Scenario::parse(CLASSROOM, "classroom.toml", Path::new("")).unwrap();
    scenario.robot = *robot;
    let simulation = Simulation::new(scenario).shortened(60.0);
    let mut pair = Pair::new(None, Progress::of(0.0));
    let mut computer = Emulated::new(&simulation, &mut pair).unwrap();
    let mut conduct = Conduct::default();
    let result = simulation.run_on(&mut computer, 0, &mut conduct).unwrap();
    (result, conduct)
}

/// The same program is two robots that differ in wheels, servo, encoder period and ping schedule, by
/// their configuration alone. `cargo xtask pil` runs both on an emulated microcontroller.
#[test]
fn two_configurations_make_two_robots_of_one_program() {
    let robots = [
        ("/../firmware/robot.toml", 1_200, 300..=1_000, 90.0),
        ("/robots/coarse.toml", 600, 100..=120, 100.0),
    ];
    for (path, samples, pings, limit) in robots {
        let path = [env!("CARGO_MANIFEST_DIR"), path].concat();
        let robot = robot_file::read(Path::new(&path)).unwrap();
        let (result, conduct) = in_the_classroom(&robot);
        println!("{conduct:?}");
        assert!(conduct.samples.abs_diff(samples) <= 5, "{conduct:?}");
        assert!(pings.contains(&conduct.pings), "{conduct:?}");
        let (right, left) = conduct.bearings;
        assert!(right >= -limit - 0.1 && left <= limit + 0.1, "{conduct:?}");
        // The other robot drives along walls that are squarely met only beyond the first one's limits.
        assert!(limit < 95.0 || right < -91.0, "{conduct:?}");
        // With wrong wheel diameters or servo pulses the estimate would diverge.
        assert!(result.faults.is_none(), "{:?}", result.faults);
        let off = result.error[0].hypot(result.error[1]);
        assert!(off < 0.05 && result.fixes.accepted > 50, "{off} m, {:?}", result.fixes);
    }
}
