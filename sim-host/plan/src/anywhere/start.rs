//! One simulated start at a random place: how long the search takes, and with which poses it confuses the true one.

use serde::Serialize;
use sonarfix_map::{Floor, Scenario};
use sonarfix_search::search::{Answer, Hypothesis, Search};
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::World;
use sonarfix_sim::world::segment::Segment;

use super::free_space::FreeSpace;
use super::settings::{AnywhereError, Settings};
use super::{furniture, wander};
use crate::trial::{Heard, are_one, observed_trial_from, pose_of, stream};

/// From a wheel to the side of the robot, metres: the robot of the floor plans has a clearance of 20 cm.
const BESIDE_WHEEL: f64 = 0.085;
/// The random streams of a start, beside those of a trial.
const DRIVE: u64 = 10;
const FURNITURE: u64 = 11;
/// Area that the furniture of [`Settings::furniture`] stands on, m².
const TEN: f64 = 10.0;
/// Mean score of a ping from which on a hypothesis explains what is heard: that of the navigator.
const FITTING: f32 = 0.2;
/// Seconds from one record of the hypotheses to the next.
const RECORDED: f64 = 1.0;

/// What a start led to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// A unique answer, and right.
    Right,
    /// A unique answer, and wrong.
    Wrong,
    /// No unique answer.
    None,
}

/// One start.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Start {
    /// Where: metres, radians.
    pub at: [f64; 3],
    /// What it led to.
    pub outcome: Outcome,
    /// Seconds until the unique answer.
    pub after: Option<f64>,
    /// What was confused meanwhile, about once a second.
    #[serde(skip)]
    pub(super) doubts: Vec<Doubt>,
}

/// A moment at which several poses explain the pings.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Doubt {
    /// Seconds since the start.
    pub time: f64,
    pub truth: Pose,
    /// The wrong ones of the answers.
    pub rivals: Vec<Pose>,
}

/// What all starts on a map have in common.
pub(super) struct Place<'a> {
    pub scenario: &'a Scenario,
    pub floor: Floor,
    pub space: FreeSpace,
    walls: Vec<Segment>,
    clearance: f64,
}

impl<'a> Place<'a> {
    /// A scenario's robot on a floor.
    ///
    /// # Errors
    /// [`AnywhereError::NoPlace`], if no place of the floor is free.
    pub fn new(scenario: &'a Scenario, floor: Floor) -> Result<Self, AnywhereError> {
        let track = f64::from(scenario.robot.localizer.drive.track_width.0);
        let clearance = 0.5 * track + BESIDE_WHEEL;
        let space = FreeSpace::new(&floor, clearance);
        if space.free().is_empty() {
            return Err(AnywhereError::NoPlace(clearance));
        }
        let walls = World::new(&floor).walls().to_vec();
        Ok(Self { scenario, floor, space, walls, clearance })
    }

    /// From the centre of the robot to its side, metres.
    pub fn clearance(&self) -> f64 {
        self.clearance
    }

    /// Simulates the start of a seed, which chooses place, drive, furniture and the errors of the robot.
    ///
    /// # Errors
    /// [`AnywhereError`], if the map cannot be used.
    pub fn start(&self, seed: u64, settings: &Settings) -> Result<Start, AnywhereError> {
        let mut scenario = Scenario { floor: self.floor.clone(), ..self.scenario.clone() };
        let plan = self.scenario.path.plan();
        let drive = wander::drive(&self.space, plan, settings.seconds, &mut stream(seed, DRIVE))?;
        scenario.path = drive.ok_or(AnywhereError::NoPlace(self.clearance))?;
        let pieces = settings.furniture * self.space.area() / TEN;
        let rng = &mut stream(seed, FURNITURE);
        scenario.surroundings.obstacles = furniture::beside(
            &scenario.path,
            &self.space,
            &self.walls,
            (pieces, self.clearance),
            rng,
        );
        let at = scenario.path.pose_at(0.0);
        let mut doubts: Vec<Doubt> = Vec::new();
        let seconds = settings.seconds;
        let trial = observed_trial_from(scenario, seed, 0.0, seconds, |heard, search| {
            self.record(&mut doubts, &heard, search);
            false
        })?;
        let outcome = match trial.unique_after {
            Some(_) if trial.is_right => Outcome::Right,
            Some(_) => Outcome::Wrong,
            None => Outcome::None,
        };
        Ok(Start { at: [at.x, at.y, at.heading], outcome, after: trial.unique_after, doubts })
    }

    /// Records the answers that are wrong, about once a second, and a wrong unique one.
    fn record(&self, doubts: &mut Vec<Doubt>, heard: &Heard, search: &Search<'_>) {
        let answers: Vec<Hypothesis> = match search.answer() {
            Answer::Unique(found) => vec![found],
            Answer::Several(count)
                if doubts.last().is_none_or(|last| heard.time >= last.time + RECORDED) =>
            {
                search.hypotheses().take(count).collect()
            }
            _ => return,
        };
        let is_rival =
            |pose: &Pose| !are_one(pose, &heard.pose) && self.space.is_near([pose.x, pose.y]);
        let fitting = answers.iter().filter(|found| found.fit >= FITTING);
        let rivals: Vec<Pose> = fitting.map(pose_of).filter(is_rival).collect();
        if !rivals.is_empty() {
            doubts.push(Doubt { time: heard.time, truth: heard.pose, rivals });
        }
    }
}

impl Settings {
    /// The time that a start costs: until the right answer, or all of it.
    pub(super) fn lost(&self, start: &Start) -> f64 {
        let is_right = start.outcome == Outcome::Right;
        start.after.filter(|_| is_right).unwrap_or(self.seconds)
    }

    /// The same of all of them.
    pub(super) fn lost_by(&self, starts: &[Start]) -> f64 {
        starts.iter().map(|start| self.lost(start)).sum()
    }
}
