//! What a microcontroller is compared with is the very simulation that all other figures come from.
#![cfg(test)]

use sonarfix_map::{Fidelity, Scenario};
use sonarfix_sim::pil::Emulated;
use sonarfix_sim::pil::pair::Pair;
use sonarfix_sim::pil::progress::Progress;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::RunResult;

/// A run with the software as a microcontroller would be asked to run it, on this computer.
fn alone(simulation: &Simulation, seed: u64) -> (RunResult, u64) {
    let mut pair = Pair::new(None, Progress::of(0.0));
    let mut computer = Emulated::new(simulation, &mut pair).unwrap();
    let result = simulation.run_on(&mut computer, seed, &mut ()).unwrap();
    (result, pair.questions())
}

#[test]
fn a_localizer_asked_message_by_message_ends_as_the_simulators_own_to_the_bit() {
    let simulation = Simulation::new(Scenario::paper().unwrap());
    for seed in 0..3 {
        let (asked, questions) = alone(&simulation, seed);
        assert_eq!(asked, simulation.run(seed, &mut ()).unwrap());
        assert_eq!(questions, 12_480 + 2 * 1_248);
    }
}

/// The shipped loop is polled every millisecond, and so not at the instants of the simulator's own;
/// it must do as well.
#[test]
fn the_shipped_loop_drives_the_scenario_as_well() {
    let mut scenario = Scenario::paper().unwrap();
    scenario.fidelity = Fidelity::Pins;
    let simulation = Simulation::new(scenario).shortened(60.0);
    for seed in 0..5 {
        let (asked, questions) = alone(&simulation, seed);
        let own = simulation.run(seed, &mut ()).unwrap();
        assert!(questions >= 60_000, "{questions} polls");
        assert!(asked.fixes.accepted + 2 >= own.fixes.accepted && own.fixes.accepted > 50);
        assert!(asked.faults.is_none(), "{:?}", asked.faults);
        for (state, (asked, own)) in asked.error.iter().zip(own.error.iter()).enumerate() {
            // Other instants, other roundings to whole ticks of 1 mm; of 0.1 m and more that a minute
            // leaves along a wall.
            assert!((asked - own).abs() < 0.02, "seed {seed}, state {state}: {asked} and {own}");
        }
    }
}
