//! The shipped `f32` filter against the dense `f64` one, on the same inputs over a whole run.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use sonarfix::aim::Policy;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::Map;
use sonarfix_map::Scenario;
use sonarfix_sim::angle;
use sonarfix_sim::dense::{DenseFilter, Line, Model};
use sonarfix_sim::observe;
use sonarfix_sim::plant::Plant;

/// Runs of each kind.
const SEEDS: u64 = 20;

/// The largest difference of a state in its own σ, and the largest relative difference of a
/// deviation, over a run.
#[derive(Debug, Default)]
struct Difference {
    state: f64,
    deviation: f64,
    fixes: usize,
}

impl Difference {
    fn note(&mut self, localizer: &Localizer, oracle: &DenseFilter) {
        let mut apart = observe::state(localizer.filter()) - oracle.x;
        apart[2] = angle::wrap(apart[2]);
        let ours = observe::covariance(localizer.filter()).diagonal().map(f64::sqrt);
        let theirs = oracle.standard_deviations();
        for i in (0..7).filter(|&i| theirs[i] > 0.0) {
            self.state = self.state.max((apart[i] / theirs[i]).abs());
            self.deviation = self.deviation.max((ours[i] / theirs[i] - 1.0).abs());
        }
    }
}

/// Drives the paper's path with both filters. The oracle has the same inputs as the localizer: travel
/// and ranges, rounded to `f32`, and the choice of walls.
fn drive(policy: Policy, range_scale_prior: f32, seed: u64) -> Difference {
    let mut scenario = Scenario::paper().unwrap();
    scenario.robot.localizer.policy = policy;
    scenario.robot.localizer.prior.range_scale = range_scale_prior;
    let config = scenario.robot.localizer;
    let model = Model::of(&config);
    let walls = scenario.floor.walls();
    let [mut rng, mut slips] = [0, 1].map(|stream| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        rng
    });
    let mut plant = Plant::new(&scenario, 0.0);

    let start = Start {
        pose: Pose::new(0.001, -0.001, Radians(std::f32::consts::FRAC_PI_2)),
        position_deviation: Metres(0.001),
        heading_deviation: Radians(0.001),
    };
    let mut localizer =
        Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(0)).unwrap();
    let (x, p) = (observe::state(localizer.filter()), observe::covariance(localizer.filter()));
    let mut oracle = DenseFilter { model, x, p };

    let mut difference = Difference::default();
    for tick in 1..=12_480_u64 {
        let travel = plant.drive_to(tick as f64 * 0.1, &mut rng, &mut slips);
        let travel = travel.measured.map(|m| m as f32);
        let now = Instant::from_ticks(tick * 100_000);
        localizer.odometry(now, WheelTravel::new(travel[0], travel[1])).unwrap();
        oracle.predict(travel.map(f64::from));
        if tick % 10 == 0 {
            let aim = localizer.aim().unwrap();
            let wall = &scenario.floor.named_walls()[aim.wall.0 as usize];
            let line = Line::through(wall.from(), wall.to());
            let (distance, _) = model.range(&plant.state(), &line);
            let range = (distance + 0.0024 * rng.sample::<f64, _>(StandardNormal)) as f32;
            assert!(matches!(localizer.fix(&aim, Some(Metres(range))), Fix::Accepted(_)));
            oracle.correct(&line, range.into());
            difference.fixes += 1;
        }
        difference.note(&localizer, &oracle);
    }
    difference
}

fn check(policy: Policy, range_scale_prior: f32) {
    for seed in 0..SEEDS {
        let difference = drive(policy, range_scale_prior, seed);
        println!("{policy:?}, range scale ±{range_scale_prior}, seed {seed}: {difference:?}");
        assert_eq!(difference.fixes, 1_248);
        assert!(difference.state < 0.005, "a state is off by {} σ", difference.state);
        // Each of the 12,480 propagations rounds a variance by up to 2⁻²⁴ of itself several times, always upwards where
        // nothing else grows (model.md, process noise): 4 · 2⁻²⁴ · 12,480 is 0.003, of a deviation half.
        assert!(difference.deviation < 0.003, "a deviation is off by {}", difference.deviation);
    }
}

#[test]
fn nearest_agrees_over_a_whole_run() {
    check(Policy::Nearest, 0.0);
}

#[test]
fn informative_agrees_over_a_whole_run() {
    check(Policy::Informative, 0.0);
}

#[test]
fn an_estimated_range_scale_agrees_over_a_whole_run() {
    check(Policy::Informative, 0.01);
}
