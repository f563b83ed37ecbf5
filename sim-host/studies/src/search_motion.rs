//! Robots that move by themselves while they search for their pose, in floor plans: the shipped application drives, by its
//! configuration and its sonar alone, from the place where it is switched on.

use std::collections::VecDeque;

use serde::Serialize;
use sonarfix::geometry::units::Metres;
use sonarfix::localizer::{Localizer, Mode};
use sonarfix_hal::config::{SearchMotion, SearchMotionKind, StartPose};
use sonarfix_map::{Fidelity, Outline, Scenario};
use sonarfix_plan::trial::are_one;
use sonarfix_sim::progress::Progress;
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::segment::{Segment, distance};
use sonarfix_virtual_robot::robot::{Parts, VirtualRobot};

use crate::quantiles::Quantiles;
use crate::search_study::Plans;

/// Time between two records of the pose, µs.
const STEP: u64 = 20_000;
/// So many of them are kept: an answer is of the last sample of the encoders, and a robot that turns is elsewhere since then.
const RECENT: usize = 50;

/// The outcome of one trial, which ends with the first pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Trial {
    /// Seed of the trial and of its plan.
    pub seed: u64,
    /// Seconds until the search handed over a pose.
    pub found_after: Option<f64>,
    /// Whether that pose was right.
    pub is_right: bool,
    /// Distance driven until then, or until the end, metres.
    pub metres: f64,
    /// The least distance from the middle of the axle to a wall or to furniture, metres.
    pub nearest: f64,
}

/// Trials in floor plans, with a motion or none: each robot is switched on where the path of its plan begins.
///
/// # Errors
/// Of the first plan that cannot be used.
pub fn floor_plans(
    plans: &Plans,
    kind: Option<SearchMotionKind>,
    seconds: f64,
    progress: &impl Progress,
) -> anyhow::Result<Vec<Trial>> {
    plans.each(progress, |scenario, seed| trial(scenario, seed, kind, seconds))
}

/// One trial.
///
/// # Errors
/// If the scenario cannot be run.
pub fn trial(
    mut scenario: Scenario,
    seed: u64,
    kind: Option<SearchMotionKind>,
    seconds: f64,
) -> anyhow::Result<Trial> {
    scenario.fidelity = Fidelity::Pins;
    scenario.start.is_unknown = true;
    scenario.robot.start = match kind {
        None => StartPose::Unknown { region: None },
        Some(kind) => StartPose::Exploring {
            region: None,
            motion: SearchMotion { kind, bumper: Metres(0.3) },
        },
    };
    let obstacles = obstacles(&scenario);
    let parts = Parts::new(scenario)?;
    let mut robot = VirtualRobot::switched_on(&parts, seed, true)?;
    robot.start(None)?;
    let mut trial =
        Trial { seed, found_after: None, is_right: false, metres: 0.0, nearest: f64::INFINITY };
    let (mut time, mut recent) = (0, VecDeque::new());
    #[expect(clippy::cast_precision_loss, reason = "some minutes in µs")]
    let since = |time: u64| time as f64 * 1e-6;
    while since(time) < seconds && trial.found_after.is_none() {
        let from = robot.pose();
        time += STEP;
        robot.run_to(time);
        let pose = robot.pose();
        recent.push_front(pose);
        recent.truncate(RECENT);
        trial.metres += (pose.x - from.x).hypot(pose.y - from.y);
        let distances = obstacles.iter().map(|(segment, radius)| {
            distance([pose.x, pose.y], segment.nearest([pose.x, pose.y])) - radius
        });
        trial.nearest = distances.fold(trial.nearest, f64::min);
        if robot.mode().is_some_and(|mode| mode != Mode::Searching) {
            trial.found_after = Some(since(time));
            trial.is_right = robot.localizer().is_some_and(|found| {
                let age = (robot.now() - found.time().ticks()) / STEP;
                let truth = usize::try_from(age).ok().and_then(|age| recent.get(age));
                truth.is_some_and(|truth| is_right(found, truth))
            });
        }
    }
    Ok(trial)
}

fn is_right(localizer: &Localizer, truth: &Pose) -> bool {
    let found = localizer.pose();
    let heading = found.heading.radians().0.into();
    are_one(&Pose { x: found.x.0.into(), y: found.y.0.into(), heading }, truth)
}

/// What a robot can run into: walls, and furniture that stands, each with its radius.
fn obstacles(scenario: &Scenario) -> Vec<(Segment, f64)> {
    let walls = scenario.floor.named_walls().iter();
    let walls = walls.map(|wall| (Segment::new(wall.from(), wall.to()), 0.0));
    let standing = scenario.surroundings.obstacles.iter().filter(|it| it.walk.is_none());
    let furniture = standing.map(|obstacle| match &obstacle.outline {
        Outline::Circle { centre: [x, y], radius } => {
            (Segment::new([*x, *y], [*x, y + 1e-6]), *radius)
        }
        Outline::Face { from, to } => (Segment::new(*from, *to), 0.0),
    });
    walls.chain(furniture).collect()
}

/// Radius of the robot around the middle of its axle, metres.
const RADIUS: f64 = 0.1;

/// Shares and times over many trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Summary {
    /// Trials.
    pub trials: usize,
    /// Share with a right pose.
    pub right: f64,
    /// When they have it, and the share with a wrong pose.
    pub found: Quantiles,
    /// Distance driven, mean, metres.
    pub metres: f64,
    /// Share in which an obstacle was nearer than 10 cm to the middle of the axle: the robot touched it.
    pub touched: f64,
}

impl Summary {
    /// The summary of some trials.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 trials")]
    pub fn new(trials: &[Trial]) -> Self {
        let count = trials.len() as f64;
        let share =
            |is: &dyn Fn(&Trial) -> bool| trials.iter().filter(|it| is(it)).count() as f64 / count;
        let found: Vec<_> = trials.iter().map(|it| (it.found_after, it.is_right)).collect();
        Self {
            trials: trials.len(),
            right: share(&|trial| trial.is_right),
            found: Quantiles::new(&found),
            metres: trials.iter().map(|trial| trial.metres).sum::<f64>() / count,
            touched: share(&|trial| trial.nearest < RADIUS),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::floor_plan::Kind;

    fn homes(kind: Option<SearchMotionKind>, seconds: f64) -> Vec<Trial> {
        let plans =
            Plans { first: 6_000, trials: 6, kind: Some(Kind::Home), walls: None, mistake: None };
        floor_plans(&plans, kind, seconds, &|| ()).unwrap()
    }

    /// Six homes with furniture.
    #[test]
    fn robots_that_drive_ahead_find_their_pose_and_touch_nothing() {
        for trial in homes(Some(SearchMotionKind::Ahead), 90.0) {
            assert!(trial.is_right && trial.nearest > RADIUS, "{trial:?}");
        }
    }

    #[test]
    fn robots_without_a_motion_stand() {
        for trial in homes(None, 5.0) {
            assert!(trial.metres < 1e-6, "{trial:?}");
        }
    }

    #[test]
    fn a_summary_counts_right_wrong_and_touched() {
        let trial = |after: f64, is_right, nearest| Trial {
            seed: 0,
            found_after: (after > 0.0).then_some(after),
            is_right,
            metres: after,
            nearest,
        };
        let trials = [
            trial(4.0, true, 0.3),
            trial(2.0, true, 0.05),
            trial(3.0, false, 0.3),
            trial(0.0, false, 0.3),
        ];
        let summary = Summary::new(&trials);
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let shares = [summary.right, summary.found.wrong, summary.touched].map(percent);
        assert_eq!(shares, ["50 %", "25 %", "25 %"]);
        assert_eq!((summary.found.half, summary.found.four_fifths), (None, None));
        assert_eq!(Summary::new(&trials[..2]).found.half, Some(4.0));
    }
}
