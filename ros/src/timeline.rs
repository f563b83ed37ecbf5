//! The localizer with the inputs of the latest time, so that a late range is used at the time of its stamp: the estimate returns
//! to the step before it, and takes that step and all later ones again.
//!
//! A range that is newer than the odometry waits for it. Until then [`Timeline::ahead`] predicts its time from the last
//! speeds, so that the pose does not wait.

use std::collections::VecDeque;

use sonarfix::config::RangerId;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{Fix, Mode, OdometryError, Start};
use sonarfix::sensor::gyro::MeasuredTurn;
use sonarfix_hal::robot::EVALUATIONS_PER_MILLISECOND;
use sonarfix_search::navigator::Navigator;
use sonarfix_search::search::Search;

use crate::motion::{Part, seconds};
use crate::problem::{Nanoseconds, Problem};

/// The most ranges that wait for odometry, and the most steps that are kept.
const MOST_WAITING: usize = 256;
const MOST_STEPS: usize = 2000;
/// How far the estimate is predicted beyond the odometry.
const MOST_AHEAD: Nanoseconds = 100_000_000;
/// The localizer's time of the first odometry, microseconds: later than zero, so that a step that ends a little earlier exists.
const FIRST: u64 = 1_000_000;

/// The result of a ping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Echo {
    /// No echo, or one from beyond the longest range.
    None,
    /// An echo from nearer than the ranger can measure: it has no range.
    TooNear,
    /// The range, metres.
    At(f64),
}

impl Echo {
    /// The range, metres, if there is one.
    #[must_use]
    pub fn range(self) -> Option<f64> {
        match self {
            Self::None | Self::TooNear => None,
            Self::At(range) => Some(range),
        }
    }
}

/// A range along a bearing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// When it was measured.
    pub at: Nanoseconds,
    /// The ranger.
    pub ranger: RangerId,
    /// Radians counter-clockwise from the heading.
    pub bearing: f64,
    /// The result.
    pub echo: Echo,
}

impl Beam {
    fn is_same(&self, other: &Self) -> bool {
        self.at == other.at
            && self.ranger == other.ranger
            && self.bearing.to_bits() == other.bearing.to_bits()
    }
}

/// What became of a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heard {
    /// The range.
    pub beam: Beam,
    /// Its effect; `None` if no wall can be measured along its bearing, or the search took it.
    pub fix: Option<Fix>,
}

/// A travel with the ranges in it, and the estimate before it.
#[derive(Debug, Clone)]
struct Step<'m> {
    part: Part,
    before: Navigator<'m>,
    beams: Vec<Beam>,
}

/// The localizer and its latest inputs.
#[derive(Debug)]
pub struct Timeline<'m> {
    navigator: Navigator<'m>,
    search: Box<Search<'m>>,
    searches: bool,
    history: Nanoseconds,
    /// The time of the first odometry.
    epoch: Nanoseconds,
    /// The time of the last odometry.
    last: Nanoseconds,
    /// What was measured before is not used: it is of another pose.
    settled: Nanoseconds,
    steps: VecDeque<Step<'m>>,
    waiting: VecDeque<Beam>,
    /// The last travel.
    speed: Option<Part>,
    /// Ranges of gaps of the odometry.
    unplaced: u32,
}

impl<'m> Timeline<'m> {
    /// A localizer whose first odometry was at `at`; its own time is [`Self::start`].
    #[must_use]
    pub fn new(navigator: Navigator<'m>, search: Box<Search<'m>>, at: Nanoseconds) -> Self {
        Self {
            navigator,
            search,
            searches: true,
            history: 0,
            epoch: at,
            last: at,
            settled: at,
            steps: VecDeque::new(),
            waiting: VecDeque::new(),
            speed: None,
            unplaced: 0,
        }
    }

    /// The localizer's time of the first odometry.
    #[must_use]
    pub fn start() -> Instant {
        Instant::from_ticks(FIRST)
    }

    /// Sets how late a range may arrive, and whether a lost robot searches for its pose.
    pub fn set(&mut self, history: Nanoseconds, searches: bool) {
        (self.history, self.searches) = (history, searches);
    }

    /// The time of the last odometry.
    #[must_use]
    pub fn time(&self) -> Nanoseconds {
        self.last
    }

    /// The estimate at that time.
    #[must_use]
    pub fn navigator(&self) -> &Navigator<'m> {
        &self.navigator
    }

    /// The search.
    #[must_use]
    pub fn search(&self) -> &Search<'m> {
        &self.search
    }

    /// Whether the pose is unknown.
    #[must_use]
    pub fn is_searching(&self) -> bool {
        self.navigator.mode() == Mode::Searching
    }

    /// Takes a travel and the ranges that waited for it.
    ///
    /// # Errors
    /// [`OdometryError`], by what is wrong with the travel; the estimate is unchanged.
    pub fn advance(&mut self, part: &Part) -> Result<Vec<Heard>, OdometryError> {
        let due = self.waiting.partition_point(|beam| beam.at <= part.to);
        let mut beams: Vec<Beam> = self.waiting.drain(..due).collect();
        if part.is_gap {
            let before = beams.len();
            beams.retain(|beam| beam.at == part.to);
            self.unplaced += u32::try_from(before - beams.len()).unwrap_or(u32::MAX);
        }
        let is_tracking = self.navigator.mode() == Mode::Tracking;
        let before = self.navigator.clone();
        let clock = Clock { epoch: self.epoch };
        let taken = clock.run(&mut self.navigator, Some(&mut self.search), part, &beams);
        let heard = taken.inspect_err(|_| self.navigator = before.clone())?;
        (self.last, self.speed) = (part.to, Some(*part));
        if is_tracking {
            self.keep(Step { part: *part, before, beams });
        }
        self.work(part.to - part.from);
        Ok(heard)
    }

    /// The number of ranges that were measured in gaps of the odometry since the last call; they are not used.
    pub fn take_unplaced(&mut self) -> u32 {
        std::mem::take(&mut self.unplaced)
    }

    fn keep(&mut self, step: Step<'m>) {
        self.steps.push_back(step);
        let oldest = self.last - self.history;
        let is_old = |step: &Step| step.part.to < oldest;
        while self.steps.len() > MOST_STEPS || self.steps.front().is_some_and(is_old) {
            self.steps.pop_front();
        }
    }

    /// Lets the search compute, and changes the mode.
    fn work(&mut self, elapsed: Nanoseconds) {
        if !self.searches && self.navigator.mode() == Mode::Tracking {
            return;
        }
        let evaluations = elapsed / 1_000_000 * i64::from(EVALUATIONS_PER_MILLISECOND);
        let evaluations = u16::try_from(evaluations).unwrap_or(u16::MAX);
        if self.navigator.work(evaluations, &mut self.search).is_some() {
            self.forget_steps();
        }
    }

    fn forget_steps(&mut self) {
        self.steps.clear();
        self.settled = self.last;
    }

    /// Takes a range. One that is newer than the odometry waits for it, and nothing is heard yet.
    ///
    /// # Errors
    /// [`Problem`], if it is not used, by the reason.
    pub fn take(&mut self, beam: Beam) -> Result<Vec<Heard>, Problem> {
        if beam.at > self.last {
            return self.wait(beam).map(|()| Vec::new());
        }
        if self.navigator.mode() != Mode::Tracking {
            return self.take_now(beam);
        }
        if beam.at <= self.settled {
            return Err(Problem::RangeBeforeStart);
        }
        let is_within = |step: &Step| step.part.from < beam.at && beam.at <= step.part.to;
        let Some(place) = self.steps.iter().position(is_within) else {
            return Err(Problem::RangeLate);
        };
        self.insert(place, beam)
    }

    fn wait(&mut self, beam: Beam) -> Result<(), Problem> {
        if self.waiting.iter().any(|other| other.is_same(&beam)) {
            return Err(Problem::RangeRepeated);
        }
        if self.waiting.len() >= MOST_WAITING {
            return Err(Problem::RangeQueue);
        }
        let place = self.waiting.partition_point(|other| other.at <= beam.at);
        self.waiting.insert(place, beam);
        Ok(())
    }

    /// While the pose is unknown or not confirmed, the search takes ranges in the order of their arrival.
    fn take_now(&mut self, beam: Beam) -> Result<Vec<Heard>, Problem> {
        if self.last - beam.at > self.history {
            return Err(Problem::RangeLate);
        }
        let clock = Clock { epoch: self.epoch };
        Ok(vec![clock.hear(&mut self.navigator, Some(&mut self.search), beam)])
    }

    /// Returns to the step at `place`, and takes it with the range, and the later ones again.
    fn insert(&mut self, place: usize, beam: Beam) -> Result<Vec<Heard>, Problem> {
        let Some(step) = self.steps.get_mut(place) else { return Ok(Vec::new()) };
        if step.part.is_gap && beam.at != step.part.to {
            return Err(Problem::RangeUnplaced);
        }
        if step.beams.iter().any(|other| other.is_same(&beam)) {
            return Err(Problem::RangeRepeated);
        }
        let order = step.beams.partition_point(|other| other.at <= beam.at);
        step.beams.insert(order, beam);
        self.navigator = step.before.clone();
        let clock = Clock { epoch: self.epoch };
        let mut heard = Vec::new();
        for step in self.steps.iter_mut().skip(place) {
            step.before = self.navigator.clone();
            let run =
                clock.run(&mut self.navigator, Some(&mut self.search), &step.part, &step.beams);
            // The travel was accepted before, and no range changes whether it is.
            let run = run.unwrap_or_default();
            heard.extend(run.into_iter().filter(|heard| heard.beam.is_same(&beam)));
        }
        self.work(0);
        Ok(heard)
    }

    /// The estimate at the time of the newest range that waits for odometry, predicted from the last speeds, and what became of
    /// the ranges; `None` if none waits, or it is too far ahead.
    #[must_use]
    pub fn ahead(&self) -> Option<Ahead<'m>> {
        let at = self.waiting.back()?.at;
        let speed = self.speed.filter(|part| part.to > part.from && !part.is_gap)?;
        if at - self.last > MOST_AHEAD || self.navigator.mode() == Mode::Searching {
            return None;
        }
        let share = seconds(at - self.last) / seconds(speed.to - speed.from);
        let (right, left) = (share * speed.right, share * speed.left);
        let turn = speed.turn.map(|turn| share * turn);
        let part = Part {
            from: self.last,
            to: at,
            right,
            left,
            turn,
            is_gap: false,
            is_unobserved: false,
        };
        let mut navigator = self.navigator.clone();
        let beams: Vec<Beam> = self.waiting.iter().copied().collect();
        let clock = Clock { epoch: self.epoch };
        let heard = clock.run(&mut navigator, None, &part, &beams).ok()?;
        Some(Ahead { navigator, part, heard })
    }

    /// Replaces the pose at the time of the last odometry; earlier ranges are not used any more.
    ///
    /// # Errors
    /// If the filter refuses it; nothing has changed.
    pub fn set_pose(&mut self, start: &Start) -> Result<(), Problem> {
        self.navigator.set_pose(start).map_err(|_| Problem::PoseRefused)?;
        self.waiting.clear();
        self.forget_steps();
        Ok(())
    }

    /// Declares the pose unknown and begins the search, anywhere.
    pub fn search_anywhere(&mut self) {
        self.navigator.search(&mut self.search);
        self.forget_steps();
    }

    /// Begins the search of a localizer that has started without a pose.
    pub fn search_from_start(&mut self) {
        self.navigator.search_in(None, &mut self.search);
        self.forget_steps();
    }

    /// Continues at another time, because the clock of the odometry was set; the pose is kept.
    pub fn set_clock(&mut self, at: Nanoseconds) {
        (self.epoch, self.last, self.speed) = (at, at, None);
        self.navigator.localizer_mut().set_clock(Self::start());
        self.waiting.clear();
        self.forget_steps();
    }
}

/// An estimate that is predicted beyond the odometry.
#[derive(Debug, Clone)]
pub struct Ahead<'m> {
    /// The estimate.
    pub navigator: Navigator<'m>,
    /// The predicted travel.
    pub part: Part,
    /// What became of the ranges.
    pub heard: Vec<Heard>,
}

/// Times of the localizer.
struct Clock {
    epoch: Nanoseconds,
}

impl Clock {
    fn instant(&self, at: Nanoseconds) -> Instant {
        let since = u64::try_from((at - self.epoch) / 1000).unwrap_or(0);
        Instant::from_ticks(FIRST + since)
    }

    /// Takes a travel, and each range at its time within it.
    fn run<'m>(
        &self,
        navigator: &mut Navigator<'m>,
        mut search: Option<&mut Search<'m>>,
        part: &Part,
        beams: &[Beam],
    ) -> Result<Vec<Heard>, OdometryError> {
        if part.is_unobserved {
            navigator.localizer_mut().odometry_missing(self.instant(part.to));
        }
        let mut heard = Vec::new();
        let mut since = part.from;
        for beam in beams {
            // A range from before this step was refused with the step before.
            let at = beam.at.clamp(since, part.to);
            self.drive(navigator, search.as_deref_mut(), part, [since, at])?;
            since = at;
            heard.push(self.hear(navigator, search.as_deref_mut(), *beam));
        }
        self.drive(navigator, search, part, [since, part.to])?;
        Ok(heard)
    }

    /// Takes the share of a travel between two times.
    fn drive<'m>(
        &self,
        navigator: &mut Navigator<'m>,
        search: Option<&mut Search<'m>>,
        part: &Part,
        [from, to]: [Nanoseconds; 2],
    ) -> Result<(), OdometryError> {
        let (begin, end) = (self.instant(from), self.instant(to));
        if end <= begin {
            return Ok(());
        }
        let share = seconds(to - from) / seconds(part.to - part.from);
        let travel = WheelTravel::new(single(share * part.right), single(share * part.left));
        let duration = Duration::from_ticks(end.ticks() - begin.ticks());
        let turn =
            part.turn.map(|turn| MeasuredTurn { angle: Radians(single(share * turn)), duration });
        navigator.odometry_with_turn(end, travel, turn, search)
    }

    #[expect(clippy::unused_self, reason = "beside `run`")]
    fn hear<'m>(
        &self,
        navigator: &mut Navigator<'m>,
        search: Option<&mut Search<'m>>,
        beam: Beam,
    ) -> Heard {
        let (bearing, range) =
            (Radians(single(beam.bearing)), beam.echo.range().map(|it| Metres(single(it))));
        if navigator.mode() == Mode::Searching {
            if let Some(search) = search.filter(|_| beam.ranger == RangerId::FIRST) {
                // What is not finite was refused before.
                _ = navigator.ping(bearing, range, search);
            }
            return Heard { beam, fix: None };
        }
        let aim = navigator.localizer().aim_along(beam.ranger, bearing).ok();
        let fix = aim.map(|aim| navigator.fix(&aim, range, search));
        if fix.is_none() {
            navigator.localizer_mut().skip_unplanned();
        }
        Heard { beam, fix }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the localizer computes in f32")]
pub(crate) fn single(number: f64) -> f32 {
    number as f32
}
