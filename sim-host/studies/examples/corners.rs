//! What concave corners as targets would add to the walls: the bound on the position error along the paths of
//! floor plans, with walls alone and with walls and corners.
//!
//! ```sh
//! cargo run --release -p sonarfix-studies --example corners            # floor plan 0 and seeds 20000 to 20199
//! ```
//!
//! A sonar without missed echoes pings every 0.2 s at the target with the largest decrease of the position's variance.
//! A corner answers in three of four pings, and its range is that to a line through it, square to the beam. Unmapped furniture
//! and errors of the association are left out: this is the most that corners can add. The start is known to 1 mm and 0.1°, as
//! for `sonarfix plan --need`.

use std::process::ExitCode;

use rayon::prelude::*;
use sonarfix_map::Scenario;
use sonarfix_sim::angle;
use sonarfix_sim::dense::{DenseFilter, Line, Matrix, Model, Vector};
use sonarfix_sim::world::World;
use sonarfix_sim::world::segment::{Point, direction, distance};
use sonarfix_sim::world::vertex::{Shape, Vertex};
use sonarfix_studies::floor_plan::{FloorPlan, Kind};

/// Seconds between two samples of the path.
const STEP: f64 = 0.1;
/// Samples between two pings.
const PING_EVERY: usize = 2;
/// Probability that a corner in the cone answers.
const CORNER_ANSWERS: f64 = 0.75;
/// Seconds without a range that reduces the larger axis of the position's ellipse, after which a robot is blind there.
const BLIND_AFTER: f64 = 5.0;
/// A range reduces the larger axis if its direction is within 60° of it.
const SEES: f64 = 0.25;
/// Deviations of the start: position, metres, and heading, radians.
const START: (f64, f64) = (0.001, 0.0017);

/// What the sonar can be pointed at.
#[derive(Clone, Copy)]
struct Target {
    line: Line,
    direction: f64,
    answers: f64,
}

/// The bound along a path.
#[derive(Clone, Copy, Default)]
struct Along {
    /// RMS and maximum of the position's deviation, metres.
    rms: f64,
    worst: f64,
    /// Share of the time in which the robot is blind.
    blind: f64,
    /// Share of the pings at corners.
    corners: f64,
}

/// A robot that drives a path.
struct Drive<'a> {
    scenario: &'a Scenario,
    world: World,
    vertices: Vec<Vertex>,
    filter: DenseFilter,
    /// When a range last reduced the larger axis.
    seen: f64,
}

impl<'a> Drive<'a> {
    fn new(scenario: &'a Scenario) -> Self {
        let world = World::new(&scenario.floor);
        let config = &scenario.robot.localizer;
        let prior = &config.prior;
        let scale = |deviation: f32| f64::from(deviation);
        let (position, heading) = START;
        let width = f64::from(prior.track_width.0);
        let calibration = [scale(prior.scale_right), scale(prior.scale_left), width];
        let [right, left, width] = calibration;
        let range = scale(prior.range_scale);
        let deviation = Vector::from([position, position, heading, right, left, width, range]);
        let pose = scenario.path.pose_at(0.0);
        let truth = Vector::from([pose.x, pose.y, pose.heading, 0.0, 0.0, 0.0, 0.0]);
        let p = Matrix::from_diagonal(&deviation.component_mul(&deviation));
        let filter = DenseFilter { model: Model::of(config), x: truth, p };
        let vertices = world.vertices().to_vec();
        Self { scenario, world, vertices, filter, seen: 0.0 }
    }

    /// Drives the whole path.
    fn run(mut self, with_corners: bool) -> Along {
        let mut along = Along::default();
        let (mut samples, mut pings, mut time) = (0.0, 0.0, STEP);
        let mut until_ping = PING_EVERY;
        while time <= self.scenario.path.duration() {
            self.advance_to(time);
            until_ping -= 1;
            if until_ping == 0 {
                until_ping = PING_EVERY;
                if let Some(target) = self.best(with_corners) {
                    self.correct(&target, time);
                    pings += 1.0;
                    along.corners += f64::from(u8::from(target.answers < 1.0));
                }
            }
            let deviation = position_variance(&self.filter.p).sqrt();
            samples += 1.0;
            along.rms += deviation * deviation;
            along.worst = along.worst.max(deviation);
            along.blind += f64::from(u8::from(time - self.seen > BLIND_AFTER));
            time += STEP;
        }
        along.rms = (along.rms / samples).sqrt();
        along.blind /= samples;
        along.corners /= f64::max(pings, 1.0);
        along
    }

    fn advance_to(&mut self, time: f64) {
        let pose = self.scenario.path.pose_at(time);
        let [x, y, heading, ..] = self.filter.x.data.0[0];
        let turn = angle::wrap(pose.heading - heading);
        let middle = heading + 0.5 * turn;
        let advance = (pose.x - x) * middle.cos() + (pose.y - y) * middle.sin();
        let aside = 0.5 * self.filter.model.track_width * turn;
        self.filter.propagate([advance + aside, advance - aside]);
        self.filter.x = Vector::from([pose.x, pose.y, pose.heading, 0.0, 0.0, 0.0, 0.0]);
    }

    /// The target with the largest decrease of the position's variance.
    fn best(&self, with_corners: bool) -> Option<Target> {
        let [x, y, heading, ..] = self.filter.x.data.0[0];
        let [ahead, aside] = self.filter.model.mount;
        let (sin, cos) = heading.sin_cos();
        let from = [x + cos * ahead - sin * aside, y + sin * ahead + cos * aside];
        let walls = self.world.walls().iter().filter_map(|wall| Some(wall.foot(from)?.0));
        let walls = walls.map(|foot| (foot, 1.0));
        let corners = self
            .vertices
            .iter()
            .filter(|vertex| with_corners && vertex.shape_from(from) == Some(Shape::Corner));
        let corners = corners.map(|vertex| (vertex.at, CORNER_ANSWERS));
        let targets = walls.chain(corners).filter(|&(at, _)| self.is_in_reach(from, at, heading));
        let targets = targets.map(|(at, answers)| {
            let direction = direction(from, at);
            let normal = [direction.cos(), direction.sin()];
            Target { line: Line { point: at, normal }, direction, answers }
        });
        targets.max_by(|one, other| self.gain(one).total_cmp(&self.gain(other)))
    }

    /// Whether servo and sonar reach a point, and no wall is before it.
    fn is_in_reach(&self, from: Point, at: Point, heading: f64) -> bool {
        let sonar = &self.scenario.robot.localizer.rangers.first;
        let range = distance(from, at);
        let bearing = angle::wrap(direction(from, at) - heading);
        let (right, left) = (f64::from(sonar.servo.0.0), f64::from(sonar.servo.1.0));
        if !(f64::from(sonar.min_range.0)..=f64::from(sonar.max_range.0)).contains(&range)
            || !(right..=left).contains(&bearing)
        {
            return false;
        }
        // Up to 1 cm before it: its own walls end or lie there.
        let share = 1.0 - 0.01 / range;
        let before = [from[0] + share * (at[0] - from[0]), from[1] + share * (at[1] - from[1])];
        self.world.walls().iter().all(|wall| wall.crossing(from, before).is_none())
    }

    /// P after a range to a target, with the information of the pings that are answered.
    fn corrected(&self, target: &Target) -> Matrix {
        let DenseFilter { model, x, p } = &self.filter;
        let (range, h) = model.range(x, &target.line);
        let projected = p * h;
        let noise = model.range_variance(range) / target.answers;
        p - projected * projected.transpose() / (h.dot(&projected) + noise)
    }

    fn gain(&self, target: &Target) -> f64 {
        position_variance(&self.filter.p) - position_variance(&self.corrected(target))
    }

    fn correct(&mut self, target: &Target, time: f64) {
        let p = &self.filter.p;
        let larger = 0.5 * (2.0 * p[(0, 1)]).atan2(p[(0, 0)] - p[(1, 1)]);
        if (target.direction - larger).cos().powi(2) >= SEES {
            self.seen = time;
        }
        self.filter.p = self.corrected(target);
    }
}

fn position_variance(p: &Matrix) -> f64 {
    p.fixed_view::<2, 2>(0, 0).trace()
}

/// Both bounds on a plan: without and with corners.
fn bounds(seed: u64) -> Option<(Kind, [Along; 2])> {
    let plan = FloorPlan::new(seed);
    let scenario = plan.scenario().ok()?;
    Some((plan.kind, [false, true].map(|with| Drive::new(&scenario).run(with))))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn print(name: &str, of: &[[Along; 2]]) {
    let column = |value: fn(&Along) -> f64| {
        let without = of.iter().map(|[without, _]| value(without)).collect();
        [without, of.iter().map(|[_, with]| value(with)).collect()].map(median)
    };
    let [rms, rms_with] = column(|along| 1e3 * along.rms);
    let [worst, worst_with] = column(|along| 1e3 * along.worst);
    let [blind, blind_with] = column(|along| 100.0 * along.blind);
    let [_, corners] = column(|along| 100.0 * along.corners);
    let ratio = median(of.iter().map(|[without, with]| with.rms / without.rms).collect());
    println!(
        "| {name} | {} | {rms:.1} | {rms_with:.1} | {ratio:.2} | {worst:.0} | {worst_with:.0} | {blind:.0} % | {blind_with:.0} % | {corners:.0} % |",
        of.len()
    );
}

fn main() -> ExitCode {
    println!(
        "| plans | number | RMS, mm | with corners | ratio | worst, mm | with corners | blind | with corners | pings at corners |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let Some((_, zero)) = bounds(0) else { return ExitCode::FAILURE };
    print("plan 0", &[zero]);
    let plans: Vec<_> = (20_000..20_200).into_par_iter().filter_map(bounds).collect();
    for kind in Kind::ALL {
        let of: Vec<_> = plans.iter().filter(|(k, _)| *k == kind).map(|(_, both)| *both).collect();
        print(&format!("{kind:?}").to_lowercase(), &of);
    }
    print("all", &plans.iter().map(|(_, both)| *both).collect::<Vec<_>>());
    ExitCode::SUCCESS
}
