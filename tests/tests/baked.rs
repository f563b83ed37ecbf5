//! The localizer on a baked map is the localizer on plain walls.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use sonarfix::config::Policy;
use sonarfix::map::Map;
use sonarfix::pose::Point;
use sonarfix::units::Metres;
use sonarfix_map::Scenario;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Trace;

fn trace(simulation: &Simulation) -> Trace {
    let mut trace = simulation.empty_trace();
    simulation.run(7, &mut trace).unwrap();
    trace
}

/// Over the whole paper, under both policies: every look at the same wall, every estimate the same
/// number. At the start the index already leaves walls out.
#[test]
fn the_paper_on_a_baked_map_is_the_same_run() {
    let image = sonarfix_map::bake(&Scenario::paper().unwrap().floor.walls()).unwrap();
    let map = Map::read(&image).unwrap();
    assert!(map.near(Point::new(0.0, 0.0), Metres(10.0)).count() < 8);
    for policy in [Policy::Nearest, Policy::Informative] {
        let mut scenario = Scenario::paper().unwrap();
        scenario.robot.config.policy = policy;
        let plain = Simulation::new(scenario.clone());
        let baked = Simulation::new(scenario).on_baked_map().unwrap();
        let (plain, baked) = (trace(&plain), trace(&baked));
        assert_eq!(plain.ticks.len(), 12_480);
        assert!(plain.ticks == baked.ticks, "{policy:?}: the runs differ");
    }
}
