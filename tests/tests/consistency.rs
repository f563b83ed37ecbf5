//! The paper's statistics with few runs: the limits are those of the full number of runs (`cargo xtask
//! statistics`), widened by four standard deviations of the sampling error.

use sonarfix::aim::Policy;
use sonarfix_map::Scenario;
use sonarfix_sim::monte_carlo;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::Summary;

const RUNS: u32 = 200;
/// Four standard deviations of an RMS over n runs: 4/√(2n).
const RMS_NOISE: f64 = 4.0 / 20.0;

fn many(simulation: &Simulation, seed: u64, runs: u32) -> Summary {
    Summary::of(&monte_carlo::results(simulation, seed, runs, &|| ()).unwrap())
}

fn paper(policy: Policy, statistics: bool) -> Simulation {
    let mut scenario = Scenario::paper().unwrap();
    scenario.robot.localizer.policy = policy;
    if statistics {
        scenario.let_truth_walk_as_assumed();
    }
    Simulation::new(scenario)
}

fn check_consistency(policy: Policy) {
    let summary = many(&paper(policy, true), 10_000, RUNS);
    assert_eq!((summary.lost_runs, summary.fixes.gated, summary.fixes.refused), (0, 0, 0));
    assert_eq!(summary.fixes.accepted, 1_248 * u64::from(RUNS));
    let estimated: Vec<_> = summary.states.iter().filter(|s| s.bound > 0.0).collect();
    assert_eq!(estimated.len(), 6);
    for state in estimated {
        let ratio = state.rms_error / state.bound;
        assert!((ratio - 1.0).abs() < 0.05 + RMS_NOISE, "{policy:?} {}: {ratio}", state.name);
        // The standard error of a mean over n runs is σ/√n.
        let bias = (state.mean_error / state.std_error).abs();
        assert!(bias < 0.1 + 4.0 / f64::from(RUNS).sqrt(), "{policy:?} {}: {bias}", state.name);
    }
    // A χ² with 6 degrees of freedom has variance 12.
    let nees = summary.nees_mean / 6.0;
    let nees_noise = 4.0 * (12.0 / f64::from(RUNS)).sqrt() / 6.0;
    assert!((nees - 1.0).abs() < 0.05 + nees_noise, "{policy:?}: NEES/6 {nees}");
    let nis_noise = 4.0 * (2.0 / summary.fixes.accepted as f64).sqrt();
    assert!((summary.nis_mean - 1.0).abs() < 0.02 + nis_noise, "{policy:?}: {}", summary.nis_mean);
}

#[test]
fn nearest_is_efficient_and_consistent() {
    check_consistency(Policy::Nearest);
}

#[test]
fn informative_is_efficient_and_consistent() {
    check_consistency(Policy::Informative);
}

/// The seeds of Table 1.
#[test]
fn table_1_is_within_the_papers_figures() {
    let summary = many(&paper(Policy::Nearest, false), 0, 50);
    let deviation = |name| {
        let state = summary.states.iter().find(|state| state.name == name).unwrap();
        println!("{name}: {:e}", state.std_error);
        state.std_error
    };
    // The bound is 3.5 mm, the paper's figure too; 50 runs leave 10 %.
    assert!((deviation("x") - 0.0035).abs() < 0.0035 * 0.3);
    assert!((deviation("y") - 0.0011).abs() < 0.0011 * 0.3);
    assert!(deviation("heading").to_degrees() <= 0.16);
    assert!(deviation("scale_right") <= 8e-5);
    assert!(deviation("scale_left") <= 8e-5);
    assert!(deviation("track_width") <= 0.25e-3);
    let left = summary.states.iter().find(|state| state.name == "scale_left").unwrap();
    // In the paper it is biased by three standard deviations.
    assert!((left.mean_error / left.std_error).abs() < 4.0 / 50_f64.sqrt());
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let on = |threads| -> Summary {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let simulation = paper(Policy::Informative, true);
        pool.install(|| many(&simulation, 7, 6))
    };
    assert_eq!(on(1), on(5));
}
