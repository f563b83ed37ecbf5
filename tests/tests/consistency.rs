//! The paper's statistics with few runs: the limits are those of the full number of runs (`cargo xtask
//! statistics`), widened by four standard deviations of the sampling error.

use sonarfix::aim::Policy;
use sonarfix_map::Scenario;
use sonarfix_sim::monte_carlo;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::Summary;

const RUNS: u32 = 200;

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

/// RMS over bound and NEES within 5 % of one, widened by four standard deviations of their sampling errors.
pub fn assert_efficient_and_consistent(summary: &Summary) {
    let runs = f64::from(u32::try_from(summary.runs).unwrap());
    assert_eq!(summary.lost_runs, 0);
    for state in summary.states.iter().filter(|state| state.bound > 0.0) {
        let ratio = state.rms_error / state.bound;
        // An RMS over n runs has a standard error of 1/√(2n).
        assert!((ratio - 1.0).abs() < 0.05 + 4.0 / (2.0 * runs).sqrt(), "{}: {ratio}", state.name);
    }
    // A χ² with 6 degrees of freedom has variance 12.
    let nees = summary.nees_mean / 6.0;
    assert!((nees - 1.0).abs() < 0.05 + 4.0 * (12.0 / runs).sqrt() / 6.0, "NEES/6 {nees}");
}

fn check_consistency(policy: Policy) {
    let summary = many(&paper(policy, true), 10_000, RUNS);
    assert_eq!((summary.lost_runs, summary.fixes.gated, summary.fixes.refused), (0, 0, 0));
    assert_eq!(summary.fixes.accepted, 1_248 * u64::from(RUNS));
    assert_eq!(summary.states.iter().filter(|state| state.bound > 0.0).count(), 6);
    assert_efficient_and_consistent(&summary);
    for state in summary.states.iter().filter(|state| state.bound > 0.0) {
        // The standard error of a mean over n runs is σ/√n.
        let bias = (state.mean_error / state.std_error).abs();
        assert!(bias < 0.1 + 4.0 / f64::from(RUNS).sqrt(), "{policy:?} {}: {bias}", state.name);
    }
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
