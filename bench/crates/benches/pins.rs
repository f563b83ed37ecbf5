//! The paper's 1,248 s at both fidelities: `cargo bench --package bench-crates --bench pins`.

use criterion::{Criterion, criterion_group, criterion_main};
use sonarfix_map::{Fidelity, Scenario};
use sonarfix_sim::simulate::Simulation;

fn run(criterion: &mut Criterion) {
    for (name, fidelity) in [("ideal", Fidelity::Ideal), ("pins", Fidelity::Pins)] {
        let mut scenario = Scenario::paper().expect("the reference scenario is read");
        scenario.fidelity = fidelity;
        let simulation = Simulation::new(scenario);
        criterion.bench_function(&format!("1248 s, {name}"), |bencher| {
            bencher.iter(|| simulation.run(0, &mut ()).expect("the run ends"));
        });
    }
}

criterion_group!(benches, run);
criterion_main!(benches);
