//! Global localization: finds the pose of a robot that was set down anywhere, from what it measures
//! while it drives (`docs/search.md`).
//!
//! A window of novel pings in the odometry frame holds a few straight lines. Pairs of lines against
//! pairs of walls give pose candidates (Lim and Leonard 2000; Arras et al. 2002). Each is scored on all
//! pings, refined by Gauss–Newton steps and kept in a bank of hypotheses, one per mode (Jensfelt and
//! Kristensen 2001). A global check along every wall precedes every unique answer.
//!
//! The search is sans-IO and works in slices: [`Search::poll`] does as many evaluations as it is
//! given. Memory is fixed.
//!
//! # Non-finite policy
//! Travel, bearings and ranges that are not finite are refused and change nothing.

mod bank;
mod candidates;
mod cycle;
mod decision;
mod lines;
mod parameters;
mod refine;
mod score;
mod state;
mod trial;
mod window;

use sonarfix::config::{Config, RangerParameters, Ranging};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::trig::atan2;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::geometry::vector::Vector;
use sonarfix::map::{Map, WallId};

use bank::{Bank, Entry, moved};
use candidates::Placement;
use lines::Lines;
use score::EchoModel;
use state::{Decision, GlobalCheck, Task, Work};
use trial::Odometry;
use window::Window;

pub use parameters::SearchParameters;
pub use sonarfix::map::Region;

/// A pose that the pings fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The robot's pose now.
    pub pose: Pose,
    /// The larger axis of the position's error ellipse, one deviation.
    pub position_deviation: Metres,
    /// One deviation of the heading.
    pub heading_deviation: Radians,
    /// Mean weighted log-likelihood per ping, relative to a place without walls.
    pub fit: f32,
    /// The share of the pings with an echo that a wall or corner of the map explains.
    pub explained: f32,
    /// Heading drift of the odometry, radians per metre of travel.
    pub drift: f32,
    /// Relative error of the odometry's turns.
    pub turn_scale: f32,
}

/// What the search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Answer {
    /// No cycle is complete, or too few pings are in the window.
    Searching,
    /// So many hypotheses have nearly the evidence of the best one, it included, the first ones of [`Search::hypotheses`].
    Several(usize),
    /// The position along this wall is undetermined.
    Along {
        /// The wall.
        wall: WallId,
        /// One deviation of the position along it.
        extent: Metres,
    },
    /// No pose of the map fits.
    Nowhere,
    /// One pose fits, and the global check found no other.
    Unique(Hypothesis),
}

/// The stage of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Lines are fitted to the pings.
    Lines,
    /// The hypotheses of the bank are refined.
    Bank,
    /// Pairs of lines are compared with pairs of walls.
    Pairs,
    /// Lines are moved along every wall.
    GlobalCheck,
}

/// Why an input is refused: a number is NaN or infinite, a range is negative, or a place, travel or turn is beyond 10⁶ m or
/// radians.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct InvalidInput;

impl core::fmt::Display for InvalidInput {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("a travel, bearing or range is NaN, infinite or too large")
    }
}

impl core::error::Error for InvalidInput {}

/// Largest coordinate, travel (metres) and turn (radians): squares of their sums are finite.
const FARTHEST: f32 = 1e6;

/// Whether a number is finite and not so large that sums of it are not; false for NaN.
fn is_near(number: f32) -> bool {
    number.abs() <= FARTHEST
}

/// The search for the pose, with so many pings, at most 255, in its window.
///
/// ```
/// use sonarfix::config::Config;
/// use sonarfix::map::{Map, Wall};
/// use sonarfix::geometry::pose::Point;
/// use sonarfix_search::search::{Answer, Search, SearchParameters};
/// use sonarfix::geometry::units::{Metres, Radians};
/// let walls = [Wall::new(Point::new(0.0, 0.0), Point::new(4.0, 0.0))?];
/// let config = Config::for_track_width(Metres(0.16));
/// let mut search: Search =
///     Search::new(&config.rangers.first, Map::new(&walls), SearchParameters::default());
/// search.odometry(Metres(0.01), Radians(0.0))?;
/// search.ping(search.aim(), Some(Metres(1.0)))?;
/// search.poll(100);
/// assert_eq!(search.answer(), Answer::Searching);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Search<'m, const PINGS: usize = 96, const HYPOTHESES: usize = 8> {
    /// A ping is novel if none was sent in a direction within this angle: before the robot has driven 20 cm, and after that.
    novel: [Radians; 2],
    odometry: Odometry,
    odds: f32,
    sharpness: (Metres, Radians),
    echoes: EchoModel<'m>,
    servo: (f32, f32),
    sweep: Sweep,
    window: Window<PINGS>,
    lines: Lines,
    bank: Bank<HYPOTHESES>,
    task: Task,
    work: Work,
    cycles: u32,
    /// Novel pings when the last cycle ended.
    taken: u16,
    check: GlobalCheck,
    /// Whether the last cycle has found an answer, which the next one refines.
    is_found: bool,
    answer: Decision,
    region: Option<Region>,
}

impl<const PINGS: usize, const HYPOTHESES: usize> Default for Search<'_, PINGS, HYPOTHESES> {
    /// A search without walls, to be begun by [`Self::restart`].
    #[expect(clippy::inline_always, reason = "a copy on a microcontroller's stack is large")]
    #[inline(always)]
    fn default() -> Self {
        let sonar = Config::for_track_width(Metres(0.0)).rangers.first;
        Self::new(&sonar, Map::new(&[]), SearchParameters::default())
    }
}

/// The plain sweep of the servo.
#[derive(Debug, Clone, Copy)]
struct Sweep {
    bearing: f32,
    step: f32,
}

impl<'m, const PINGS: usize, const HYPOTHESES: usize> Search<'m, PINGS, HYPOTHESES> {
    /// A search without a ping yet.
    #[expect(clippy::inline_always, reason = "a copy on a microcontroller's stack is large")]
    #[inline(always)]
    #[must_use]
    pub fn new(sonar: &RangerParameters, map: Map<'m>, parameters: SearchParameters) -> Self {
        const { assert!(PINGS <= 255, "entries of the bank count pings in a byte") };
        let (right, left) = (sonar.servo.0.0, sonar.servo.1.0);
        Self {
            novel: [parameters.novel_angle_at_rest, parameters.novel_angle],
            odometry: Odometry::of(&parameters),
            odds: parameters.odds,
            sharpness: parameters.sharpness,
            echoes: EchoModel::new(map, sonar, &parameters.echo),
            servo: (right, left),
            sweep: Sweep { bearing: right, step: parameters.novel_angle.0 },
            window: Window::new(sonar.mount.into()),
            lines: Lines::new(sonar.cone, sonar.ranging != Ranging::Sound),
            bank: Bank::new(),
            task: Task::Rebase,
            work: Work::None,
            cycles: 0,
            taken: 0,
            check: GlobalCheck::default(),
            is_found: false,
            answer: Decision::Searching,
            region: None,
        }
    }

    /// Begins again for a robot, without a ping, a hypothesis or an answer. It changes the state in
    /// place, because a copy of it on a microcontroller's stack is large.
    pub fn restart(&mut self, config: &Config, parameters: SearchParameters, map: Map<'m>) {
        let sonar = &config.rangers.first;
        self.novel = [parameters.novel_angle_at_rest, parameters.novel_angle];
        self.odometry = Odometry::of(&parameters);
        self.odds = parameters.odds;
        self.sharpness = parameters.sharpness;
        let (right, left) = (sonar.servo.0.0, sonar.servo.1.0);
        self.echoes = EchoModel::new(map, sonar, &parameters.echo);
        self.servo = (right, left);
        self.sweep = Sweep { bearing: right, step: parameters.novel_angle.0 };
        self.window.restart(sonar.mount.into());
        self.lines.restart(sonar.cone, sonar.ranging != Ranging::Sound);
        self.bank.clear();
        self.task = Task::Rebase;
        self.work = Work::None;
        self.cycles = 0;
        self.taken = 0;
        self.check = GlobalCheck::default();
        self.is_found = false;
        self.answer = Decision::Searching;
        self.region = None;
    }

    /// Considers only poses with which the search began in this region of the map.
    pub fn begin_within(&mut self, region: Region) {
        self.region = Some(region);
    }

    /// The pings in the window.
    #[must_use]
    pub fn pings(&self) -> usize {
        self.window.count()
    }

    /// Moves the robot by a distance along its mid-heading and a turn.
    ///
    /// # Errors
    /// [`InvalidInput`]; nothing changes.
    pub fn odometry(&mut self, advance: Metres, turn: Radians) -> Result<(), InvalidInput> {
        if !is_near(advance.0) || !is_near(turn.0) {
            return Err(InvalidInput);
        }
        self.window.drive(advance.0, turn.0);
        Ok(())
    }

    /// The bearing for the next ping: a plain sweep.
    #[must_use]
    pub fn aim(&self) -> Radians {
        Radians(self.sweep.bearing)
    }

    /// Takes the result of a ping; `None`: no echo. Returns whether it is novel.
    ///
    /// # Errors
    /// [`InvalidInput`]; nothing changes.
    pub fn ping(&mut self, bearing: Radians, range: Option<Metres>) -> Result<bool, InvalidInput> {
        if !bearing.is_finite() || range.is_some_and(|range| !(range.is_finite() && range.0 >= 0.0))
        {
            return Err(InvalidInput);
        }
        self.sweep.advance(self.servo);
        let range =
            range.map(|range| range.0).filter(|range| *range <= self.echoes.reflectors.max_range);
        Ok(self.window.ping(bearing.0, range, self.novel))
    }

    /// Adds a pose of the robot, as it may be now, to the bank: the place where it was lost, or the
    /// region where it starts. It is scored in the next cycle like any other hypothesis.
    ///
    /// # Errors
    /// [`InvalidInput`]; nothing changes.
    pub fn propose(&mut self, pose: Pose) -> Result<(), InvalidInput> {
        if !is_near(pose.x.0) || !is_near(pose.y.0) || !pose.is_finite() {
            return Err(InvalidInput);
        }
        let turn = pose.heading.radians() - Radians(self.window.heading());
        let bend = self.window.bend();
        // Back from the robot's place to the reference.
        let rotation = Vector::of_angle(turn.0);
        let at = Vector::from(pose.position()).minus(self.window.robot().at.turned(rotation));
        self.bank.offer(Entry::proposed(Placement { at, rotation, bend }, self.bank.least_past()));
        Ok(())
    }

    /// Does so many evaluations, each a bounded slice of work, and returns the phase of the cycle.
    pub fn poll(&mut self, evaluations: u16) -> Phase {
        for _ in 0..evaluations {
            self.evaluate();
        }
        match self.task {
            Task::Rebase | Task::Vote { .. } | Task::Fit { .. } => Phase::Lines,
            Task::Bank => Phase::Bank,
            Task::Pairs { .. } => Phase::Pairs,
            Task::Check { .. } => Phase::GlobalCheck,
        }
    }

    /// How many cycles are complete.
    #[must_use]
    pub fn cycles(&self) -> u32 {
        self.cycles
    }

    /// What the last complete cycle found.
    #[must_use]
    pub fn answer(&self) -> Answer {
        match self.answer {
            Decision::Searching => Answer::Searching,
            Decision::Several(count) => Answer::Several(count),
            Decision::Along(wall, extent) => Answer::Along { wall, extent: Metres(extent) },
            Decision::Nowhere => Answer::Nowhere,
            Decision::Unique(entry) => Answer::Unique(self.hypothesis(&entry)),
        }
    }

    /// The bank, best hypothesis first, each as the robot's pose now.
    pub fn hypotheses(&self) -> impl Iterator<Item = Hypothesis> {
        self.bank.entries().iter().map(|entry| self.hypothesis(entry))
    }

    /// The pings of the window as the best hypothesis places them on the map: where the sonar was, and the point on
    /// the beam's axis at the measured range; `None` without an echo. For pictures.
    pub fn placed_pings(&self) -> impl Iterator<Item = (Point, Option<Point>)> {
        let best = self.bank.entries().first();
        let pings = self.window.pings().iter();
        pings.filter_map(move |ping| {
            let placement = &best?.placement;
            let from = placed(placement, ping.station.at);
            let echo = ping.point().map(|at| placed(placement, at));
            Some((from.into(), echo.map(Point::from)))
        })
    }

    /// The lines among the pings as the best hypothesis places them on the map, each from end to end. For pictures.
    pub fn placed_lines(&self) -> impl Iterator<Item = [Point; 2]> {
        let best = self.bank.entries().first();
        self.lines.all().iter().filter_map(move |line| {
            let placement = &best?.placement;
            let (begin, end) = line.stretch;
            let foot = line.normal.times(line.offset);
            let at = |along: f32| placed(placement, foot.plus(line.normal.left().times(along)));
            Some([at(begin).into(), at(end).into()])
        })
    }

    /// The hypothesis of this rank, from 0, the best.
    #[must_use]
    pub fn ranked(&self, rank: usize) -> Option<Hypothesis> {
        self.bank.entries().get(rank).map(|entry| self.hypothesis(entry))
    }

    fn hypothesis(&self, entry: &Entry) -> Hypothesis {
        let now = moved(&entry.placement, self.window.robot(), self.window.bend());
        let rotation = atan2(now.rotation.y, now.rotation.x);
        let spread = &entry.spread;
        Hypothesis {
            pose: Pose::new(now.at.x, now.at.y, Radians(rotation + self.window.heading())),
            position_deviation: Metres(libm::sqrtf(largest(spread.xx, spread.xy, spread.yy))),
            heading_deviation: Radians(libm::sqrtf(spread.rotation)),
            fit: entry.score / at_least_one(entry.pings),
            explained: f32::from(entry.explained) / at_least_one(entry.echoes),
            drift: entry.placement.bend.drift,
            turn_scale: entry.placement.bend.turn_scale,
        }
    }
}

impl Sweep {
    /// Turns a step on, and back at the servo's limits. Its bearings are two grids in turn, one for
    /// each direction, 0.38 of a step apart: at ever new bearings fewer robots found their pose (20 instead of 24 of 24).
    fn advance(&mut self, (right, left): (f32, f32)) {
        const PART: f32 = 0.381_966;
        let next = self.bearing + self.step;
        if next >= right && next <= left {
            self.bearing = next;
            return;
        }
        self.step = -self.step;
        let next = self.bearing + PART * self.step;
        self.bearing = if next >= right && next <= left { next } else { right };
    }
}

/// A count as a divisor.
fn at_least_one(count: u8) -> f32 {
    f32::from(if count > 0 { count } else { 1 })
}

/// The larger eigenvalue of a symmetric matrix.
fn largest(xx: f32, xy: f32, yy: f32) -> f32 {
    let half = 0.5 * (xx - yy);
    0.5 * (xx + yy) + libm::sqrtf(half * half + xy * xy)
}

/// A point of the odometry frame on the map.
fn placed(placement: &Placement, at: Vector) -> Vector {
    placement.at.plus(at.turned(placement.rotation))
}

#[cfg(test)]
mod tests;
