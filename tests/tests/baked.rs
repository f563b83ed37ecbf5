//! The localizer gives the same results on a baked map and on plain walls.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use sonarfix::config::Policy;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Metres;
use sonarfix::map::Map;
use sonarfix_map::Scenario;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Trace;

fn trace(simulation: &Simulation) -> Trace {
    let mut trace = simulation.empty_trace();
    simulation.run(7, &mut trace).unwrap();
    trace
}

/// For the whole paper scenario and both policies, every ping aims at the same wall and every estimate
/// is the same. Already at the start the index leaves walls out.
#[test]
fn the_paper_on_a_baked_map_is_the_same_run() {
    let image = sonarfix_map::bake(&Scenario::paper().unwrap().floor.walls()).unwrap();
    let map = Map::read(&image).unwrap();
    assert!(map.near(Point::new(0.0, 0.0), Metres(10.0)).count() < 8);
    for policy in [Policy::Nearest, Policy::Informative] {
        let mut scenario = Scenario::paper().unwrap();
        scenario.robot.localizer.policy = policy;
        let plain = Simulation::new(scenario.clone());
        let baked = Simulation::new(scenario).on_baked_map().unwrap();
        let (plain, baked) = (trace(&plain), trace(&baked));
        assert_eq!(plain.ticks.len(), 12_480);
        assert!(plain.ticks == baked.ticks, "{policy:?}: the runs differ");
    }
}
