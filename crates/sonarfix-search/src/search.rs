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
mod lines;
mod refine;
mod removal;
mod score;
mod trial;
mod window;

use bank::{Bank, Entry, moved};
use candidates::{AlongWalls, Generated, Pairs, Placement, make_a_pair};
use lines::{Line, Lines, TILTS};
use refine::Prior;
use score::EchoModel;
use sonarfix::geometry::vector::Vector;
use trial::{Odometry, Trial, Verdict};
use window::{Straightening, Window};

use sonarfix::config::{Config, Sonar};
use sonarfix::geometry::numeric::at_least;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::{Map, WallId};
use sonarfix::sensor::echo::EchoParameters;

pub use sonarfix::map::Region;

/// What the search is tuned with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchParameters {
    /// A ping is novel if none was sent from within 30 cm in a direction within this angle. The
    /// plain sweep has steps of this angle.
    pub novel_angle: Radians,
    /// The same before the robot has driven 30 cm: with nothing else to measure, more pings help.
    pub novel_angle_at_rest: Radians,
    /// Deviation of the odometry's heading drift per metre of travel.
    pub drift: Radians,
    /// Deviation of the relative error of turns by the odometry: track width and wheels.
    pub turn_scale: f32,
    /// Deviation that a metre of odometry adds to the place of a ping besides, metres.
    pub odometry: f32,
    /// What a ping returns besides the range of its wall.
    pub echo: EchoParameters,
    /// Hypotheses within this log-likelihood of the best are answers, too.
    pub margin: f32,
    /// The mean log-likelihood per ping, relative to a place without walls, of a hypothesis that fits.
    pub least_fit: f32,
    /// Novel pings during which one hypothesis must be the only answer before it is unique.
    pub persistence: u16,
    /// Largest deviations of position and heading of a unique answer.
    pub sharpness: (Metres, Radians),
}

impl Default for SearchParameters {
    fn default() -> Self {
        Self {
            novel_angle: Radians::from_degrees(20.0),
            novel_angle_at_rest: Radians::from_degrees(3.8),
            drift: Radians::from_degrees(2.0),
            turn_scale: 0.02,
            odometry: 0.015,
            echo: EchoParameters::HC_SR04,
            margin: 8.0,
            least_fit: 0.5,
            persistence: 20,
            sharpness: (Metres(0.05), Radians::from_degrees(3.0)),
        }
    }
}

impl SearchParameters {
    /// For the sonar, the wheels and the priors of a robot.
    #[must_use]
    pub fn of(config: &Config) -> Self {
        let Config { prior, .. } = config;
        Self::calibrated(config, [prior.scale_right, prior.scale_left], prior.track_width)
    }

    /// As [`Self::of`] with the standard deviations that the scales of the right and of the left wheel and the track
    /// width have after a calibration.
    #[must_use]
    pub fn calibrated(config: &Config, wheels: [f32; 2], track_width: Metres) -> Self {
        let drive = &config.drive;
        let width = drive.track_width.0;
        let (common, difference) = mean_and_difference(wheels, config);
        let by_width = track_width.0 / width;
        // Heading noise after a metre: the deviation aside that it causes grows with the distance to the
        // power 1.5, and is this many metres a metre at 4 m.
        let per_root_metre = core::f32::consts::SQRT_2 * drive.wheel_noise.0.0 / width;
        let odometry = at_least(1.2 * per_root_metre, LEAST_ODOMETRY);
        let (position, heading) = Self::default().sharpness;
        Self {
            drift: Radians(at_least(difference / width, LEAST_DRIFT.0)),
            turn_scale: at_least(libm::hypotf(by_width, common), LEAST_TURN_SCALE),
            odometry,
            echo: config.echo,
            sharpness: (Metres(at_least(SHARP_WITHIN * odometry, position.0)), heading),
            ..Self::default()
        }
    }
}

/// Deviations of the mean and of the difference of the scale errors of both wheels, eq. (48).
fn mean_and_difference([right, left]: [f32; 2], config: &Config) -> (f32, f32) {
    let independent = libm::hypotf(right, left);
    match config.prior.difference_of(right, left) {
        Some(difference) => {
            let mean = 0.5 * independent * independent - 0.25 * difference * difference;
            (libm::sqrtf(mean), difference)
        }
        None => (0.5 * independent, independent),
    }
}

/// Below this mean log-likelihood per ping, relative to echoes anywhere, much that is around is not in the map: the
/// answer has to persist for so many times longer, unless it leads by so many margins.
const UNCERTAIN_SCORE: f32 = 0.3;
const UNCERTAIN_FOR: u16 = 3;
const CLEAR_LEAD: f32 = 4.0;
/// An answer that leads by so many margins need not persist longer than for half of the novel pings.
const LARGE_LEAD: f32 = 8.0;
/// A unique answer need not be sharper than what the odometry adds within this distance, metres.
const SHARP_WITHIN: f32 = 1.8;
/// Least deviations: a prior of zero would fix what a slip changes.
const LEAST_DRIFT: Radians = Radians(0.005);
const LEAST_TURN_SCALE: f32 = 0.003;
const LEAST_ODOMETRY: f32 = 0.005;

/// A pose that the pings fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The robot's pose now.
    pub pose: Pose,
    /// The larger axis of the position's error ellipse, one deviation.
    pub position_deviation: Metres,
    /// One deviation of the heading.
    pub heading_deviation: Radians,
    /// Mean log-likelihood per ping, relative to a place without walls.
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
    /// So many hypotheses fit, the first ones of [`Search::hypotheses`].
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

/// Fewer pings than these are no window to search with.
const LEAST_PINGS: usize = 12;
/// Pairs of lines that every cycle tries, and those that take turns.
const BEST_PAIRS: u8 = 4;
const OTHER_PAIRS: u8 = 4;
/// A global check is made when a hypothesis has persisted, and at least once in so many cycles.
const CHECK_EVERY: u32 = 4;
/// Lines that are moved along every wall.
const CHECKED_LINES: u8 = 2;
/// A position with a larger deviation than this is undetermined, metres.
const UNDETERMINED: f32 = 0.3;

/// How far beside its region a start may seem to lie: metres, and metres per metre travelled since.
const REGION_MARGIN: f32 = 0.1;

/// Where a cycle stands.
#[derive(Debug, Clone, Copy)]
enum Task {
    Rebase,
    Vote { ping: u16, tilt: u8 },
    Fit { line: u8 },
    Bank,
    Pairs { pair: u8, pairs: Pairs },
    Along { line: u8, along: AlongWalls },
}

/// What takes several evaluations, before the task goes on.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "there is one of it, and no heap")]
enum Work {
    None,
    Straighten(Straightening),
    Trial(Trial),
}

/// The search for the pose.
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
///     Search::new(&config.sonar, Map::new(&walls), SearchParameters::default());
/// search.odometry(Metres(0.01), Radians(0.0))?;
/// search.ping(search.aim(), Some(Metres(1.0)))?;
/// search.poll(100);
/// assert_eq!(search.answer(), Answer::Searching);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Search<'m, const PINGS: usize = 96, const HYPOTHESES: usize = 8> {
    parameters: SearchParameters,
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
    is_check_due: bool,
    answer: Decision,
    region: Option<Region>,
}

impl<const PINGS: usize, const HYPOTHESES: usize> Default for Search<'_, PINGS, HYPOTHESES> {
    /// A search without walls, to be begun by [`Self::restart`].
    #[expect(clippy::inline_always, reason = "a copy on a microcontroller's stack is large")]
    #[inline(always)]
    fn default() -> Self {
        let sonar = Config::for_track_width(Metres(0.0)).sonar;
        Self::new(&sonar, Map::new(&[]), SearchParameters::default())
    }
}

/// The plain sweep of the servo.
#[derive(Debug, Clone, Copy)]
struct Sweep {
    bearing: f32,
    step: f32,
}

/// The answer without the poses, which follow the odometry.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Decision {
    Searching,
    Several(usize),
    Along(WallId, f32),
    Nowhere,
    Unique(Entry),
}

impl<'m, const PINGS: usize, const HYPOTHESES: usize> Search<'m, PINGS, HYPOTHESES> {
    /// A search without a ping yet.
    #[expect(clippy::inline_always, reason = "a copy on a microcontroller's stack is large")]
    #[inline(always)]
    #[must_use]
    pub fn new(sonar: &Sonar, map: Map<'m>, parameters: SearchParameters) -> Self {
        let (right, left) = (sonar.servo.0.0, sonar.servo.1.0);
        Self {
            parameters,
            echoes: EchoModel::new(map, sonar, &parameters.echo),
            servo: (right, left),
            sweep: Sweep { bearing: right, step: parameters.novel_angle.0 },
            window: Window::new(sonar.mount.into()),
            lines: Lines::of_ranger(sonar),
            bank: Bank::new(),
            task: Task::Rebase,
            work: Work::None,
            cycles: 0,
            taken: 0,
            is_check_due: true,
            answer: Decision::Searching,
            region: None,
        }
    }

    /// Begins again for a robot, without a ping, a hypothesis or an answer. It changes the state in
    /// place, because a copy of it on a microcontroller's stack is large.
    pub fn restart(&mut self, config: &Config, parameters: SearchParameters, map: Map<'m>) {
        let sonar = &config.sonar;
        self.parameters = parameters;
        let (right, left) = (sonar.servo.0.0, sonar.servo.1.0);
        self.echoes = EchoModel::new(map, sonar, &self.parameters.echo);
        self.servo = (right, left);
        self.sweep = Sweep { bearing: right, step: self.parameters.novel_angle.0 };
        self.window.restart(sonar.mount.into());
        self.lines.restart_of_ranger(sonar);
        self.bank.clear();
        self.task = Task::Rebase;
        self.work = Work::None;
        self.cycles = 0;
        self.taken = 0;
        self.is_check_due = true;
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
        let novel = [self.parameters.novel_angle_at_rest, self.parameters.novel_angle];
        Ok(self.window.ping(bearing.0, range, novel))
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
        self.bank.offer(Entry::proposed(Placement { at, rotation, bend }));
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
            Task::Along { .. } => Phase::GlobalCheck,
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
            let echo = ping.range().map(|range| ping.axis.times(range));
            let echo = echo.map(|offset| placed(placement, ping.station.at.plus(offset)));
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
        let rotation = libm::atan2f(now.rotation.y, now.rotation.x);
        let spread = &entry.spread;
        Hypothesis {
            pose: Pose::new(now.at.x, now.at.y, Radians(rotation + self.window.heading())),
            position_deviation: Metres(libm::sqrtf(largest(spread.xx, spread.xy, spread.yy))),
            heading_deviation: Radians(libm::sqrtf(spread.rotation)),
            fit: self.fit_of(entry),
            explained: f32::from(entry.explained) / at_least_one(entry.echoes),
            drift: entry.placement.bend.drift,
            turn_scale: entry.placement.bend.turn_scale,
        }
    }

    /// Mean log-likelihood per ping, relative to a place without walls.
    fn fit_of(&self, entry: &Entry) -> f32 {
        let nothing = self.echoes.nothing(entry.pings, entry.echoes);
        (entry.score - nothing) / at_least_one(entry.pings)
    }

    #[inline(never)]
    fn evaluate(&mut self) {
        if self.window.count() < LEAST_PINGS {
            return;
        }
        match &mut self.work {
            Work::None => self.begin(),
            Work::Straighten(straightening) => {
                if !self.window.straighten(straightening) {
                    self.work = Work::None;
                }
            }
            Work::Trial(trial) => {
                let is_answer = trial.is_answer;
                let parameters = &self.parameters;
                let prior = Prior { drift: parameters.drift.0, turn_scale: parameters.turn_scale };
                let odometry = Odometry { prior, per_metre: parameters.odometry };
                match trial.advance(&self.echoes, &self.window, &odometry) {
                    Verdict::Running => return,
                    Verdict::Rejected => self.bank.end_trial(),
                    Verdict::Scored(entry) if is_answer => self.answer = Decision::Unique(entry),
                    Verdict::Scored(entry) => {
                        self.bank.end_trial();
                        self.bank.offer(entry);
                    }
                }
                self.work = Work::None;
            }
        }
    }

    /// Makes a step of the task.
    fn begin(&mut self) {
        self.task = match self.task {
            Task::Rebase => self.rebase(),
            Task::Vote { ping, tilt } => self.vote(ping, tilt),
            Task::Fit { line } => self.fit(line),
            Task::Bank => self.refine(),
            Task::Pairs { pair, pairs } => self.try_pairs(pair, pairs),
            Task::Along { line, along } => self.check(line, along),
        };
    }

    fn vote(&mut self, ping: u16, tilt: u8) -> Task {
        let Some(part) = TILTS.get(usize::from(tilt)) else {
            let next = ping + 1;
            return if usize::from(next) < self.window.pings().len() {
                Task::Vote { ping: next, tilt: 0 }
            } else {
                Task::Fit { line: 0 }
            };
        };
        let (pings, voter) = (self.window.pings(), usize::from(ping));
        if self.lines.is_light() {
            self.lines.vote_of_two(pings, voter, usize::from(tilt) + 1);
        } else {
            self.lines.vote(pings, voter, *part);
        }
        Task::Vote { ping, tilt: tilt + 1 }
    }

    /// Moves the frame to the robot, and begins to straighten the path by the best hypothesis.
    fn rebase(&mut self) -> Task {
        let bend = self.window.bend();
        let reference = self.window.rebase();
        self.bank.rebase(&reference, bend);
        if let Decision::Unique(entry) = &mut self.answer {
            entry.placement = moved(&entry.placement, &reference, bend);
        }
        self.lines.clear();
        if let Some(best) = self.bank.entries().first() {
            let straightening = self.window.begin_straightening(best.placement.bend);
            self.work = Work::Straighten(straightening);
        }
        Task::Vote { ping: 0, tilt: 0 }
    }

    fn fit(&mut self, line: u8) -> Task {
        self.lines.fit(self.window.pings(), usize::from(line));
        if usize::from(line) + 1 < self.lines.all().len() {
            Task::Fit { line: line + 1 }
        } else {
            {
                self.bank.begin_refinement();
                Task::Bank
            }
        }
    }

    /// Tries the entries of the bank again, one after the other.
    fn refine(&mut self) -> Task {
        match self.bank.next_stale() {
            Some(entry) => {
                self.work = Work::Trial(Trial::of_entry(&entry));
                Task::Bank
            }
            None => Task::Pairs { pair: 0, pairs: Pairs::default() },
        }
    }

    #[inline(never)]
    fn try_pairs(&mut self, pair: u8, mut pairs: Pairs) -> Task {
        let Some((first, second)) = self.pair(pair) else {
            if self.is_check_due {
                return Task::Along { line: 0, along: AlongWalls::default() };
            }
            self.decide(false);
            return Task::Rebase;
        };
        let bend = self.window.bend();
        match pairs.next(&self.echoes.reflectors.map, &first, &second, bend) {
            Generated::Candidate(placement) => self.try_candidate(placement, 0.15, 0.25),
            Generated::Nothing => {}
            Generated::Done => return Task::Pairs { pair: pair + 1, pairs: Pairs::default() },
        }
        Task::Pairs { pair, pairs }
    }

    #[inline(never)]
    fn check(&mut self, line: u8, mut along: AlongWalls) -> Task {
        let checked = self.lines.all().get(usize::from(line)).copied();
        let Some(checked) = checked.filter(|_| line < CHECKED_LINES) else {
            self.decide(true);
            return Task::Rebase;
        };
        let bend = self.window.bend();
        match along.next(&self.echoes.reflectors.map, &checked, bend) {
            Generated::Candidate(placement) => self.try_candidate(placement, 0.25, 0.6),
            Generated::Nothing => {}
            Generated::Done => {
                return Task::Along { line: line + 1, along: AlongWalls::default() };
            }
        }
        Task::Along { line, along }
    }

    fn try_candidate(&mut self, placement: Placement, near: f32, rivalry: f32) {
        let start = placement.at.plus(self.window.start().turned(placement.rotation));
        let margin = REGION_MARGIN * (1.0 + self.window.since_start());
        let is_outside =
            self.region.is_some_and(|region| !region.contains(start.into(), Metres(margin)));
        if is_outside || self.bank.has_near(&placement, near) {
            return;
        }
        let best = self.bank.entries().first().map_or(0.0, |entry| entry.score);
        let full = self.bank.least_score().unwrap_or(0.0);
        let least = if full > rivalry * best { full } else { rivalry * best };
        let least = if least > 0.0 { least } else { 0.0 };
        self.work = Work::Trial(Trial::of_candidate(placement, least));
    }

    /// The pairs of this cycle: the best ones, then others that take turns.
    fn pair(&self, number: u8) -> Option<(Line, Line)> {
        if number < BEST_PAIRS {
            return self.nth_pair(number.into()).ok();
        }
        let turn = number - BEST_PAIRS;
        if turn >= OTHER_PAIRS {
            return None;
        }
        let all = self.nth_pair(usize::MAX).err()?;
        let others = all.checked_sub(usize::from(BEST_PAIRS))?;
        let nth = usize::from(turn);
        if nth >= others {
            return None;
        }
        let first = (self.cycles as usize).wrapping_mul(usize::from(OTHER_PAIRS));
        self.nth_pair(usize::from(BEST_PAIRS) + (first + nth) % others).ok()
    }

    /// The pair of this rank, from 0; how many there are if it is beyond.
    #[inline(never)]
    fn nth_pair(&self, nth: usize) -> Result<(Line, Line), usize> {
        let lines = self.lines.all();
        let mut rank = 0;
        for sum in 1..2 * lines.len() {
            for one in 0..sum.div_ceil(2) {
                let (Some(one), Some(other)) = (lines.get(one), lines.get(sum - one)) else {
                    continue;
                };
                if !make_a_pair(one, other) {
                    continue;
                }
                if rank == nth {
                    return Ok((*one, *other));
                }
                rank += 1;
            }
        }
        Err(rank)
    }

    /// Whether the lines are more than one wall.
    fn has_separate_lines(&self) -> bool {
        let mut lines = self.lines.all();
        while let [one, others @ ..] = lines {
            if others.iter().any(|other| self.lines.are_separate(one, other)) {
                return true;
            }
            lines = others;
        }
        false
    }

    /// Ends a cycle.
    fn decide(&mut self, is_checked: bool) {
        self.cycles = self.cycles.wrapping_add(1);
        let taken = self.window.taken();
        let fresh = taken.wrapping_sub(self.taken);
        self.taken = taken;
        let Some(best) = self.bank.entries().first().copied() else {
            self.answer = Decision::Nowhere;
            self.is_check_due = true;
            return;
        };
        let least = best.score - self.parameters.margin;
        let rivals = self.bank.entries().iter().filter(|entry| entry.score > least).count();
        let spread = &best.spread;
        let is_fit = self.fit_of(&best) >= self.parameters.least_fit;
        let variance = largest(spread.xx, spread.xy, spread.yy);
        let is_determined = variance < UNDETERMINED * UNDETERMINED;
        let (position, heading) = self.parameters.sharpness;
        let is_sharp =
            variance < position.0 * position.0 && spread.rotation < heading.0 * heading.0;
        let has_lines = self.has_separate_lines();
        let is_sole = rivals == 1 && is_fit && is_determined && has_lines;
        for (n, entry) in self.bank.entries_mut().iter_mut().enumerate() {
            let streak = entry.streak.saturating_add(fresh);
            entry.streak = if n == 0 && is_sole { streak } else { 0 };
        }
        let persistence = self.persistence(&best);
        let has_persisted = is_sole && best.streak.saturating_add(fresh) >= persistence && is_sharp;
        let was_unique = matches!(self.answer, Decision::Unique(_));
        self.is_check_due =
            has_persisted && !is_checked && !was_unique || self.cycles.is_multiple_of(CHECK_EVERY);
        self.answer = if !is_fit {
            Decision::Nowhere
        } else if let Some(along) = self.along(&best).filter(|_| !is_determined) {
            along
        } else if has_persisted && (is_checked || was_unique) {
            // The answer before stays until this one is refined.
            self.work = Work::Trial(Trial::of_answer(&best));
            return;
        } else {
            Decision::Several(rivals)
        };
    }

    /// Novel pings during which the best entry must be the only answer: the fewer, the farther it leads.
    fn persistence(&self, best: &Entry) -> u16 {
        let nothing = self.echoes.nothing(best.pings, best.echoes);
        let second = self.bank.entries().get(1).map_or(nothing, |entry| entry.score);
        let lead = (best.score - at_least(second, nothing)) / self.parameters.margin;
        let is_low = best.score < UNCERTAIN_SCORE * f32::from(best.pings);
        let persistence = self.parameters.persistence;
        if lead >= LARGE_LEAD {
            persistence / 2
        } else if is_low && lead < CLEAR_LEAD {
            persistence.saturating_mul(UNCERTAIN_FOR)
        } else {
            persistence
        }
    }

    /// The wall along which the position of an entry is undetermined: the nearest that is parallel to
    /// the long axis of its error ellipse.
    fn along(&self, entry: &Entry) -> Option<Decision> {
        let spread = &entry.spread;
        let most = largest(spread.xx, spread.xy, spread.yy);
        let axis = if spread.xx > spread.yy {
            Vector::new(most - spread.yy, spread.xy)
        } else {
            Vector::new(spread.xy, most - spread.xx)
        };
        let at = entry.placement.at.into();
        let mut nearest: Option<(f32, WallId)> = None;
        for (id, wall) in
            self.echoes.reflectors.map.near(at, Metres(self.echoes.reflectors.max_range))
        {
            let across = axis.dot(Vector::new(wall.a(), wall.b()));
            let is_parallel = across * across < 0.1 * axis.length_squared();
            let distance = wall.signed_distance(at).abs().0;
            if is_parallel && nearest.is_none_or(|(least, _)| distance < least) {
                nearest = Some((distance, id));
            }
        }
        nearest.map(|(_, id)| Decision::Along(id, libm::sqrtf(most)))
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
fn at_least_one(count: u16) -> f32 {
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
