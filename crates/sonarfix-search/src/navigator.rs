//! Navigation with and without a pose: the [`Localizer`], the [`Search`] beside it, and the hand-over in both
//! directions.
//!
//! ```text
//!            Lost, or on demand                  unique answer
//!   Tracking ─────────────────▶ Searching ─────────────────────▶ Provisional
//!      ▲                            ▲             Lost                │
//!      │                            └─────────────────────────────────┤
//!      └──────────────────────────────────────────────────────────────┘
//!          2 m and 20 accepted ranges with the verdict Tracking, and no other hypothesis
//! ```
//!
//! - *Tracking*: the localizer alone.
//! - *Searching*: the pose is unknown. The localizer's verdict is `Lost` and its pose has deviations of
//!   [`UNKNOWN_POSITION`] and [`UNKNOWN_HEADING`]: it is the best hypothesis of the search's last cycle, if the pings fit
//!   one, and dead-reckons. The search takes odometry and pings.
//! - *Provisional*: the localizer has started from the search's unique answer. The search keeps its hypotheses and
//!   takes the pings as well, so that a wrong answer leads back to them. If it finds another unique answer, that one becomes
//!   the provisional pose.
//!
//! The search is an argument of each call and not a field, because its state is larger than everything else: its owner
//! decides where it lies. Without one the mode is always *Tracking*, and the navigator is the localizer.
//!
//! **Calibration.** Before a localizer is `Lost`, it has corrected its calibration by ranges from a wrong pose or with a
//! faulty encoder. The search therefore uses the calibration of a [checkpoint](CHECKPOINT) that is 10 m of driving
//! old or older, or that of the start.
//!
//! # Non-finite policy
//! That of [`Localizer`] and [`Search`]: a NaN or infinity is refused and changes nothing.

use crate::search::{Answer, Hypothesis, InvalidInput, Region, Search, SearchParameters};
use sonarfix::aim::{Aim, Choice, NoAim, Standing};
use sonarfix::config::{Policy, RangerId};
use sonarfix::filter::ekf::{EkfError, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::numeric::at_least;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::{AbsoluteFix, AbsoluteRefusal, Fix, Localizer, OdometryError, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::MeasuredTurn;

pub use sonarfix::localizer::{Mode, UNKNOWN_HEADING, UNKNOWN_POSITION};

/// Distance between two checkpoints of the calibration.
pub const CHECKPOINT: Metres = Metres(10.0);
/// Least standard deviations of the pose at the hand-over.
const LEAST_POSITION: f32 = 0.03;
const LEAST_HEADING: f32 = 2.0 * core::f32::consts::PI / 180.0;
/// Deviations of the search's least squares are multiplied by this: its pings share the errors of map and odometry. With
/// 3, a pose that is right to 2° has a heading deviation above a quarter of the cone, and the verdict stays `Degraded`.
const CAUTION: f32 = 1.5;
/// Distance and accepted ranges after which a provisional pose is confirmed.
const CONFIRMED_AFTER: Metres = Metres(2.0);
const CONFIRMED_BY: u16 = 20;
/// A unique answer of the search is another pose than a provisional one beyond this distance, metres, or turn, radians.
const ELSEWHERE: f32 = 0.5;
const TURNED: f32 = 0.35;
/// Mean weighted log-likelihood per ping from which the best hypothesis is a guess of an unknown pose.
const LEAST_GUESS: f32 = 0.2;
/// Pings of a provisional pose without an accepted range after which the nearest wall is measured.
const UNUSED: u16 = 3;
/// Cycles of the search after a failed hand-over before the next.
const PAUSE: u32 = 2;
/// A checkpoint holds deviations and no correlations. No covariance of four errors exceeds four times its diagonal.
const DECORRELATED: f32 = 2.0;

/// A localizer that searches for its pose when it has none.
///
/// ```
/// # use sonarfix::{config::Config, map::{Map, Wall}, geometry::pose::{Point, Pose}};
/// # use sonarfix::localizer::{Localizer, Start};
/// # use sonarfix::geometry::units::{Instant, Metres, Radians};
/// use sonarfix::health::Verdict;
/// use sonarfix_search::navigator::{Mode, Navigator};
/// use sonarfix_search::search::{Search, SearchParameters};
/// # let walls = [Wall::new(Point::new(0.0, 0.0), Point::new(4.0, 0.0))?];
/// # let config = Config::for_track_width(Metres(0.16));
/// # let map = Map::new(&walls);
/// # let start = Start {
/// #     pose: Pose::new(1.0, 1.0, Radians(0.0)),
/// #     position_deviation: Metres(0.05),
/// #     heading_deviation: Radians(0.02),
/// # };
/// let mut search: Search = Search::new(&config.rangers.first, map, SearchParameters::default());
/// let localizer = Localizer::new(config, map, start, Instant::from_ticks(0))?;
/// let mut navigator = Navigator::new(localizer);
/// navigator.search(&mut search);
/// assert_eq!(navigator.mode(), Mode::Searching);
/// assert_eq!(navigator.localizer().health().verdict, Verdict::Lost);
/// let bearing = search.aim();
/// navigator.ping(bearing, Some(Metres(1.2)), &mut search)?;
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Navigator<'m> {
    localizer: Localizer<'m>,
    mode: Mode,
    /// Distance since the last checkpoint while *Tracking*, since the hand-over while *Provisional*.
    driven: Metres,
    /// Ranges accepted since the hand-over.
    accepted: u16,
    /// Pings of the provisional pose since the last accepted range.
    unused: u16,
    /// The search's cycles when the unknown pose was last guessed.
    guessed: u32,
    /// The search's cycles before which it hands nothing over.
    not_before: u32,
    checkpoints: [Calibration; 2],
}

/// A calibration with its deviations; the pose in it has no meaning.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Calibration {
    state: StateEstimate,
    deviation: StandardDeviations,
}

impl Calibration {
    fn of(localizer: &Localizer) -> Self {
        let filter = localizer.filter();
        Self { state: filter.state(), deviation: filter.standard_deviations() }
    }

    /// The calibration and its deviations as those of a localizer whose pose is unknown.
    fn without_pose(&self, localizer: &Localizer) -> (StateEstimate, StandardDeviations) {
        let StateEstimate { x, y, heading, .. } = localizer.filter().state();
        let prior = &localizer.config().prior;
        let known = &self.deviation;
        let wider = |known: f32, prior: f32| {
            let wider = DECORRELATED * known;
            if wider < prior { wider } else { prior }
        };
        let deviation = StandardDeviations {
            x: UNKNOWN_POSITION,
            y: UNKNOWN_POSITION,
            heading: UNKNOWN_HEADING,
            scale_right: wider(known.scale_right, prior.scale_right),
            scale_left: wider(known.scale_left, prior.scale_left),
            track_width_error: Metres(wider(known.track_width_error.0, prior.track_width.0)),
            range_scale: wider(known.range_scale, prior.range_scale),
        };
        (StateEstimate { x, y, heading, ..self.state }, deviation)
    }
}

impl<'m> Navigator<'m> {
    /// A navigator that tracks the pose of this localizer.
    #[must_use]
    // It is built where the caller has it, without a copy on the stack.
    #[inline]
    pub fn new(localizer: Localizer<'m>) -> Self {
        let checkpoint = Calibration::of(&localizer);
        Self {
            localizer,
            mode: Mode::Tracking,
            driven: Metres(0.0),
            accepted: 0,
            unused: 0,
            guessed: 0,
            not_before: 0,
            checkpoints: [checkpoint; 2],
        }
    }

    /// The localizer: pose, covariance, calibration, health.
    #[must_use]
    pub fn localizer(&self) -> &Localizer<'m> {
        &self.localizer
    }

    /// The localizer, for what does not depend on the mode: a missing ping, ranger or odometry, and the clock. Its pose is
    /// replaced by [`Self::set_pose`] alone.
    pub fn localizer_mut(&mut self) -> &mut Localizer<'m> {
        &mut self.localizer
    }

    /// The mode.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Declares the pose unknown and begins the search. The pose of the localizer is proposed to it: if the robot was
    /// lost, it is probably near.
    pub fn search(&mut self, search: &mut Search<'m>) {
        let proposal = self.localizer.pose();
        self.forget_pose();
        self.restart(search);
        // The localizer's pose is finite.
        _ = search.propose(proposal);
    }

    /// Begins the search for a localizer that has been started without a pose, with deviations of [`UNKNOWN_POSITION`]
    /// and [`UNKNOWN_HEADING`]: in this region, or anywhere.
    pub fn search_in(&mut self, region: Option<Region>, search: &mut Search<'m>) {
        self.restart(search);
        self.keep_calibration();
        self.localizer.declare_lost();
        self.mode = Mode::Searching;
        if let Some(region) = region {
            search.begin_within(region);
        }
    }

    /// Makes the present calibration that with which the search begins, and with which each of its failed answers is forgotten.
    fn keep_calibration(&mut self) {
        let [_, older] = &mut self.checkpoints;
        *older = Calibration::of(&self.localizer);
    }

    fn restart(&mut self, search: &mut Search<'m>) {
        let localizer = &self.localizer;
        let known = localizer.filter().standard_deviations();
        let wheels = [known.scale_right, known.scale_left];
        let config = localizer.config();
        let parameters = SearchParameters::calibrated(config, wheels, known.track_width_error);
        search.restart(config, parameters, localizer.map());
        self.not_before = 0;
        self.guessed = 0;
    }

    #[inline(never)]
    fn forget_pose(&mut self) {
        let [_, older] = &self.checkpoints;
        let (state, deviation) = older.without_pose(&self.localizer);
        // The filter has held these numbers, and the deviations are finite: it takes them.
        _ = self.localizer.restart(state, deviation);
        self.localizer.declare_lost();
        self.mode = Mode::Searching;
    }

    /// Predicts over the travel of both wheels up to the time `now`, with the turn that the gyro has measured over the same time
    /// ([`Localizer::odometry_with_turn`]); the search takes it as well.
    ///
    /// # Errors
    /// As [`Localizer::odometry`]; neither has changed.
    pub fn odometry_with_turn(
        &mut self,
        now: Instant,
        travel: WheelTravel,
        turn: Option<MeasuredTurn>,
        search: Option<&mut Search<'m>>,
    ) -> Result<(), OdometryError> {
        let has_gyro = turn.is_some();
        let before = self.localizer.pose().heading;
        self.localizer.odometry_with_turn(now, travel, turn)?;
        let Some(search) = search else { return Ok(()) };
        self.driven = self.driven + travel.distance();
        if self.mode == Mode::Tracking {
            self.record_calibration();
            return Ok(());
        }
        // The calibration with which the search has begun: its bend is that of one odometry.
        let [_, Calibration { state, .. }] = &self.checkpoints;
        let right = travel.right.0 * (1.0 + state.scale_right);
        let left = travel.left.0 * (1.0 + state.scale_left);
        let width = self.localizer.config().drive.track_width + state.track_width_error;
        let turn = if has_gyro {
            self.localizer.pose().heading.from(before)
        } else {
            Radians((right - left) / width.0)
        };
        // Travel that the localizer has accepted is finite.
        _ = search.odometry(Metres(0.5 * (right + left)), turn);
        Ok(())
    }

    /// Takes a checkpoint of the calibration, if one is due and the ranges agree with the map.
    fn record_calibration(&mut self) {
        if self.driven < CHECKPOINT {
            return;
        }
        self.driven = Metres(0.0);
        let health = self.localizer.health();
        if health.verdict == Verdict::Tracking {
            let [newer, _] = self.checkpoints;
            self.checkpoints = [Calibration::of(&self.localizer), newer];
        }
    }

    /// As [`Localizer::aim`], while the mode is not [`Mode::Searching`].
    ///
    /// # Errors
    /// [`NoAim`], by the reason.
    pub fn aim(&self) -> Result<Aim, NoAim> {
        self.localizer.aim_by(self.policy())
    }

    /// As [`Localizer::aim_of`], while the mode is not [`Mode::Searching`].
    ///
    /// # Errors
    /// [`NoAim`], by the reason.
    pub fn aim_of(&self, ranger: RangerId, standing: &Standing) -> Result<Aim, NoAim> {
        self.localizer.aim_of_by(self.policy(), ranger, standing)
    }

    /// As [`Localizer::choose`], while the mode is not [`Mode::Searching`].
    pub fn choose(&self, choice: &mut Choice) -> Option<Result<Aim, NoAim>> {
        self.localizer.choose_by(self.policy(), choice)
    }

    /// The policy of the configuration; [`Policy::Nearest`] after [`UNUSED`] pings of a provisional pose without an accepted
    /// range: a hidden wall neither confirms nor contradicts it, however much it would tell.
    fn policy(&self) -> Policy {
        self.policy_with(self.localizer.config().policy)
    }

    fn policy_with(&self, configured: Policy) -> Policy {
        let is_hidden = self.mode == Mode::Provisional && self.unused >= UNUSED;
        if is_hidden { Policy::Nearest } else { configured }
    }

    /// As [`Localizer::fix`]; while the pose is provisional, the search takes the ping as well, if it is of the first
    /// ranger, with which it sweeps.
    pub fn fix(
        &mut self,
        aim: &Aim,
        range: Option<Metres>,
        search: Option<&mut Search<'m>>,
    ) -> Fix {
        let fix = self.localizer.fix(aim, range);
        if self.mode == Mode::Provisional {
            let is_accepted = matches!(fix, Fix::Accepted(_));
            self.accepted = self.accepted.saturating_add(u16::from(is_accepted));
            self.unused = if is_accepted { 0 } else { self.unused.saturating_add(1) };
            if let Some(search) = search.filter(|_| aim.ranger == RangerId::FIRST) {
                // What is not finite was refused above and is not taken here either.
                _ = self.ping(aim.bearing, range, search);
            }
        }
        fix
    }

    /// As [`Localizer::absolute`]; refused ([`AbsoluteRefusal::NoPose`]) while the pose is unknown.
    pub fn absolute(&mut self, at: Instant, measurement: &AbsoluteMeasurement) -> AbsoluteFix {
        if self.mode == Mode::Searching {
            return AbsoluteFix::Refused(AbsoluteRefusal::NoPose);
        }
        self.localizer.absolute(at, measurement)
    }

    /// Passes a ping in any direction to the search; `None`: no echo. An echo from nearer than the sonar's shortest
    /// range counts as none. Returns whether the ping is novel.
    ///
    /// # Errors
    /// [`InvalidInput`]; nothing changes.
    pub fn ping(
        &mut self,
        bearing: Radians,
        range: Option<Metres>,
        search: &mut Search<'m>,
    ) -> Result<bool, InvalidInput> {
        let shortest = self.localizer.config().rangers.first.min_range;
        // The search refuses what is not finite.
        search.ping(bearing, range.filter(|range| *range >= shortest || !range.is_finite()))
    }

    /// Replaces the pose by one that was measured independently, as [`Localizer::set_pose`] does; it is tracked.
    ///
    /// # Errors
    /// [`EkfError`], by what is wrong with it; nothing has changed.
    pub fn set_pose(&mut self, start: &Start) -> Result<(), EkfError> {
        self.localizer.set_pose(start)?;
        self.track();
        Ok(())
    }

    /// Takes the mode that another navigator has changed to, with its state and standard deviations then: for the replay
    /// of recorded changes.
    ///
    /// # Errors
    /// [`EkfError`], by what is wrong with the state or its deviations; nothing has changed.
    pub fn adopt(
        &mut self,
        mode: Mode,
        state: StateEstimate,
        deviation: StandardDeviations,
    ) -> Result<(), EkfError> {
        match mode {
            Mode::Tracking => {}
            Mode::Searching => {
                self.localizer.restart(state, deviation)?;
                self.localizer.declare_lost();
                self.keep_calibration();
            }
            Mode::Provisional => self.localizer.set_pose(&Start {
                pose: state.pose(),
                position_deviation: deviation.x,
                heading_deviation: deviation.heading,
            })?,
        }
        self.mode = mode;
        Ok(())
    }

    fn track(&mut self) {
        self.mode = Mode::Tracking;
        self.driven = Metres(0.0);
    }

    /// Changes the mode if verdict or answer require it; returns the new one.
    #[inline(never)]
    pub fn update(&mut self, search: &mut Search<'m>) -> Option<Mode> {
        let verdict = self.localizer.health().verdict;
        match self.mode {
            Mode::Tracking if verdict == Verdict::Lost => self.search(search),
            Mode::Searching => {
                if self.hand_over(search).is_none() {
                    self.guess(search);
                    return None;
                }
            }
            Mode::Provisional if verdict == Verdict::Lost => {
                self.not_before = search.cycles().saturating_add(PAUSE);
                self.forget_pose();
            }
            Mode::Provisional if self.is_contradicted(search) => self.hand_over(search)?,
            Mode::Provisional if verdict == Verdict::Degraded => {
                self.begin_confirmation();
                return None;
            }
            Mode::Provisional if self.is_confirmed(search) => self.track(),
            Mode::Tracking | Mode::Provisional => return None,
        }
        Some(self.mode)
    }

    /// Makes so many evaluations of the search while the pose is not confirmed, each a bounded slice, and changes the
    /// mode as soon as verdict or answer require it; returns the new one.
    ///
    /// The result depends on the number of evaluations between two inputs, and not on how they are divided into calls.
    pub fn work(&mut self, evaluations: u16, search: &mut Search<'m>) -> Option<Mode> {
        let mut changed = self.update(search);
        for _ in 0..evaluations {
            if self.mode == Mode::Tracking {
                break;
            }
            search.poll(1);
            changed = self.update(search).or(changed);
        }
        changed
    }

    fn begin_confirmation(&mut self) {
        self.driven = Metres(0.0);
        self.accepted = 0;
    }

    /// Whether the ranges confirm the pose, and the search still excludes every other: a pose of a nearly symmetric room takes ranges of
    /// the right one.
    fn is_confirmed(&self, search: &Search) -> bool {
        let is_unique = matches!(search.answer(), Answer::Unique(_));
        self.accepted >= CONFIRMED_BY && self.driven >= CONFIRMED_AFTER && is_unique
    }

    /// Takes the best hypothesis of each complete cycle as the pose that is unknown, if the pings fit it at all: only the
    /// mean changes.
    fn guess(&mut self, search: &Search<'m>) {
        if search.cycles() == self.guessed {
            return;
        }
        self.guessed = search.cycles();
        let Some(best) = search.ranked(0).filter(|best| best.fit >= LEAST_GUESS) else { return };
        let start = Start {
            pose: best.pose,
            position_deviation: UNKNOWN_POSITION,
            heading_deviation: UNKNOWN_HEADING,
        };
        if self.localizer.set_pose(&start).is_ok() {
            self.localizer.declare_lost();
        }
    }

    /// Whether the search has a unique answer at another place.
    fn is_contradicted(&self, search: &Search) -> bool {
        let Answer::Unique(found) = search.answer() else { return false };
        let pose = self.localizer.pose();
        let (dx, dy) = (found.pose.x.0 - pose.x.0, found.pose.y.0 - pose.y.0);
        dx * dx + dy * dy > ELSEWHERE * ELSEWHERE
            || found.pose.heading.from(pose.heading).0.abs() > TURNED
    }

    /// Starts the localizer from the unique answer of the search, if there is one.
    fn hand_over(&mut self, search: &Search<'m>) -> Option<()> {
        if search.cycles() < self.not_before {
            return None;
        }
        let Answer::Unique(found) = search.answer() else { return None };
        self.localizer.set_pose(&start_of(&found)).ok()?;
        self.mode = Mode::Provisional;
        self.unused = 0;
        self.begin_confirmation();
        Some(())
    }
}

/// The start from a hypothesis.
fn start_of(found: &Hypothesis) -> Start {
    let cautious = |deviation: f32, least: f32| at_least(CAUTION * deviation, least);
    Start {
        pose: found.pose,
        position_deviation: Metres(cautious(found.position_deviation.0, LEAST_POSITION)),
        heading_deviation: Radians(cautious(found.heading_deviation.0, LEAST_HEADING)),
    }
}

#[cfg(test)]
mod tests;
