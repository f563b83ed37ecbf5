//! The expected log odds of a sweep at one pose against another pose, by the echoes that the simulated sonar may receive at both.

use sonarfix_map::{Floor, Scenario};
use sonarfix_sim::angle;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::{Ping, World};

/// Angle between the directions of a sweep that are compared, radians, and what each stands for: pings at 10°.
const STEP: f64 = 0.349;
const PINGS_A_STEP: f64 = 2.0;
/// Ranges nearer to each other than this are the same, metres: σ with which the search scores a candidate.
const ALIKE: f64 = 0.15;
/// The share of pings that an object answers that no map has.
const CLUTTER: f64 = 0.2;

/// The range of an echo, metres, `None` without one, and its probability.
type Echo = (Option<f64>, f64);

/// The sweeps of a robot's sonar on a floor.
pub(super) struct Sweeps {
    simulation: Simulation,
}

impl Sweeps {
    pub fn new(scenario: &Scenario, floor: &Floor) -> Self {
        let mut scenario = Scenario { floor: floor.clone(), ..scenario.clone() };
        scenario.surroundings.obstacles.clear();
        Self { simulation: Simulation::new(scenario) }
    }

    /// The farthest range, metres.
    pub fn reach(&self) -> f64 {
        self.simulation.sensor().reach.1
    }

    /// Expected log odds of the true pose against another one after a sweep.
    pub fn log_odds(&self, truth: &Pose, other: &Pose) -> f64 {
        let (right, left) = self.simulation.config().rangers.first.servo;
        let (right, left) = (f64::from(right.0), f64::from(left.0));
        let bearings = std::iter::successors(Some(right), |bearing| Some(bearing + STEP));
        let bearings = bearings.take_while(|bearing| *bearing <= left);
        let each = bearings
            .map(|bearing| log_odds(&self.echoes(truth, bearing), &self.echoes(other, bearing)));
        PINGS_A_STEP * each.sum::<f64>()
    }

    /// The echoes of a ping, each with the probability that it is the first that is received.
    fn echoes(&self, pose: &Pose, bearing: f64) -> Vec<Echo> {
        let at = self.simulation.sonar_at(pose);
        let direction = angle::wrap(pose.heading + bearing);
        let (world, sensor) = (self.simulation.world(), self.simulation.sensor());
        if sensor.light.is_some() {
            return vec![(lit(world, at, direction).filter(|range| *range <= self.reach()), 1.0)];
        }
        let ping = Ping { time: 0.0, sonar_after: &|_| at, direction };
        let mut silent = 1.0;
        let mut echoes: Vec<Echo> = Vec::new();
        for reflector in world.reflectors(&ping, sensor) {
            echoes.push((Some(reflector.distance), silent * reflector.audible));
            silent *= 1.0 - reflector.audible;
        }
        echoes.push((None, silent));
        echoes
    }
}

/// The range of a beam of light, metres.
fn lit(world: &World, at: [f64; 2], direction: f64) -> Option<f64> {
    let (_, hit) = world.on_axis(at, direction)?;
    Some((hit[0] - at[0]).hypot(hit[1] - at[1]))
}

/// The expected log odds of a ping at the true pose.
fn log_odds(truth: &[Echo], other: &[Echo]) -> f64 {
    let probability = |of: &[Echo], range: Option<f64>| {
        let is_alike = |echo: Option<f64>| match (echo, range) {
            (Some(one), Some(other)) => (one - other).abs() < ALIKE,
            (one, other) => one.is_none() && other.is_none(),
        };
        let mass: f64 = of.iter().filter(|(echo, _)| is_alike(*echo)).map(|(_, p)| p).sum();
        (1.0 - CLUTTER) * mass + CLUTTER
    };
    let each = truth.iter().map(|(range, share)| {
        share * (probability(truth, *range) / probability(other, *range)).ln()
    });
    each.sum()
}
