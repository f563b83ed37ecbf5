//! One simulated start at a random place: how long the search takes, and with which poses it confuses the true one.

use serde::Serialize;
use sonarfix_map::{Floor, Scenario};
use sonarfix_search::search::{Answer, Hypothesis, Search};
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::World;
use sonarfix_sim::world::segment::Segment;

use super::free_space::FreeSpace;
use super::route::Steps;
use super::settings::{AnywhereError, Settings};
use super::{furniture, wander};
use crate::trial::{Heard, SetDown, are_one, observed_trial, pose_of, stream};

/// From a wheel to the side of the robot, metres: the robot of the floor plans has a clearance of 20 cm.
const BESIDE_WHEEL: f64 = 0.085;
/// The random streams of a start, beside those of a trial.
const DRIVE: u64 = 10;
const FURNITURE: u64 = 11;
/// The area that [`Settings::furniture`] counts pieces on, m².
const FURNISHED_AREA: f64 = 10.0;
/// Mean score of a ping from which on a hypothesis explains the pings: that of the navigator.
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
    /// When several poses explained the pings, about once a second.
    #[serde(skip)]
    pub(super) ambiguities: Vec<Ambiguity>,
}

/// A time at which several poses explain the pings.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ambiguity {
    /// Seconds since the start.
    pub time: f64,
    pub truth: Pose,
    /// The hypotheses that are wrong.
    pub wrong: Vec<Pose>,
}

/// What all starts on a map have in common.
pub(super) struct Place<'a> {
    pub scenario: &'a Scenario,
    pub floor: Floor,
    pub space: FreeSpace,
    steps: Steps,
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
        let steps = Steps::new(&space);
        Ok(Self { scenario, floor, space, steps, walls, clearance })
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
        let rng = &mut stream(seed, DRIVE);
        let drive = wander::drive(&self.space, &self.steps, plan, settings.seconds, rng)?;
        scenario.path = drive.ok_or(AnywhereError::NoPlace(self.clearance))?;
        let pieces = settings.furniture * self.space.area() / FURNISHED_AREA;
        let rng = &mut stream(seed, FURNITURE);
        scenario.surroundings.obstacles = furniture::beside(
            &scenario.path,
            &self.space,
            &self.walls,
            (pieces, self.clearance),
            rng,
        );
        let at = scenario.path.pose_at(0.0);
        let mut ambiguities: Vec<Ambiguity> = Vec::new();
        let seconds = settings.seconds;
        let trial = observed_trial(scenario, seed, SetDown::At(0.0), seconds, |ping, search| {
            self.record(&mut ambiguities, &ping, search);
            false
        })?;
        let outcome = match trial.unique_after {
            Some(_) if trial.is_right => Outcome::Right,
            Some(_) => Outcome::Wrong,
            None => Outcome::None,
        };
        Ok(Start { at: [at.x, at.y, at.heading], outcome, after: trial.unique_after, ambiguities })
    }

    /// Records the hypotheses that are wrong, about once a second, and a wrong unique answer.
    fn record(&self, ambiguities: &mut Vec<Ambiguity>, ping: &Heard, search: &Search<'_>) {
        let answers: Vec<Hypothesis> = match search.answer() {
            Answer::Unique(found) => vec![found],
            Answer::Several(count)
                if ambiguities.last().is_none_or(|last| ping.time >= last.time + RECORDED) =>
            {
                search.hypotheses().take(count).collect()
            }
            _ => return,
        };
        let is_wrong =
            |pose: &Pose| !are_one(pose, &ping.pose) && self.space.is_near([pose.x, pose.y]);
        let fitting = answers.iter().filter(|found| found.fit >= FITTING);
        let wrong: Vec<Pose> = fitting.map(pose_of).filter(is_wrong).collect();
        if !wrong.is_empty() {
            ambiguities.push(Ambiguity { time: ping.time, truth: ping.pose, wrong });
        }
    }
}

impl Settings {
    /// Seconds of search of a start: until the right answer, or all of them.
    pub(super) fn search_time(&self, start: &Start) -> f64 {
        let is_right = start.outcome == Outcome::Right;
        start.after.filter(|_| is_right).unwrap_or(self.seconds)
    }

    /// The sum of the seconds of search.
    pub(super) fn total_search_time(&self, starts: &[Start]) -> f64 {
        starts.iter().map(|start| self.search_time(start)).sum()
    }
}
