//! The choice of a ping: its candidates are listed by their scores, then tested for occlusion, best first.
//!
//! A choice is the longest work of a robot's loop, and its cost grows with the walls that are near. It is therefore divided into
//! slices, between which the loop does what else is due. The estimate may change in between; a candidate has the score of its slice.

use core::marker::PhantomData;

use super::ranking::Ranked;
use super::{Aim, Along, BearingRule, ByPolicy, NoAim, Planner, Policy, Situation, Standing};
use crate::association::history::Slot;
use crate::association::visibility::Viewpoint;
use crate::config::{RangerId, Ranging};
use crate::geometry::units::{Radians, seconds};
use crate::map::WallId;
use crate::sensor::timing::PingDuration;

/// Number of candidates that are kept at a time, best first. They are tested for occlusion in that
/// order; if all are occluded, the next ones are listed.
const SHORTLIST: usize = 8;

/// The work of a slice: walls that are no candidates.
const SLICE: u32 = 24;
/// The work of a candidate, which costs as much as so many other walls.
const CANDIDATE: u32 = 8;

/// A choice in progress ([`Localizer::choose`](crate::localizer::Localizer::choose)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    ranger: RangerId,
    /// `None`: as after its last ping.
    standing: Option<Standing>,
    /// The bearing, if the planner does not choose it.
    along: Option<Radians>,
    /// Whether the margins for the uncertainty of the estimate are dropped, because no wall is safe.
    is_daring: bool,
    /// Candidates up to this one are occluded.
    after: Ranked,
    /// Best first.
    ranked: [Ranked; SHORTLIST],
    /// Number of the candidates.
    count: u16,
    /// Walls or beams that were taken so far.
    pub(super) taken: u32,
    /// Candidates of the list that are occluded; `None`: it is not complete.
    tested: Option<u8>,
}

impl Choice {
    /// A choice for a ranger whose servo stands where it has pinged last.
    #[must_use]
    pub fn new(ranger: RangerId) -> Self {
        Self {
            ranger,
            standing: None,
            along: None,
            is_daring: false,
            after: Ranked::BEFORE_ALL,
            ranked: [Ranked::NONE; SHORTLIST],
            count: 0,
            taken: 0,
            tested: None,
        }
    }

    /// A choice for a ranger whose servo stands as given.
    #[must_use]
    pub fn standing(ranger: RangerId, standing: Standing) -> Self {
        Self { standing: Some(standing), ..Self::new(ranger) }
    }

    /// The choice of the nearest wall to which a beam along this bearing is square.
    #[must_use]
    pub fn along(ranger: RangerId, bearing: Radians) -> Self {
        Self { along: Some(bearing), ..Self::new(ranger) }
    }

    /// The ranger.
    #[must_use]
    pub fn ranger(&self) -> RangerId {
        self.ranger
    }

    /// Takes the wall or beam with this number, and its score if it is a candidate.
    pub(super) fn take(&mut self, number: u32, score: Option<f32>) {
        self.taken += 1;
        let Some(score) = score else { return };
        self.count = self.count.saturating_add(1);
        let ranked = Ranked { number, score };
        if self.after.is_before(ranked) {
            ranked.insert(&mut self.ranked);
        }
    }

    /// What is to be done next.
    fn step(&mut self) -> Step {
        let Some(tested) = self.tested else { return Step::List };
        let Some(&ranked) = self.ranked.get(usize::from(tested)) else {
            // All of them are occluded, of which the last is in the last place.
            let [.., last] = self.ranked;
            self.list_after(last);
            return Step::ListMore;
        };
        if ranked != Ranked::NONE {
            self.tested = Some(tested + 1);
            return Step::Test(ranked);
        }
        if self.is_daring {
            return Step::End;
        }
        // No wall is safe: others are tried.
        self.is_daring = true;
        self.list_after(Ranked::BEFORE_ALL);
        Step::Dare
    }

    /// Begins another list, of the candidates after this one.
    #[inline(never)]
    fn list_after(&mut self, after: Ranked) {
        self.after = after;
        self.ranked = [Ranked::NONE; SHORTLIST];
        (self.count, self.taken, self.tested) = (0, 0, None);
    }
}

/// A step of a choice.
enum Step {
    /// Candidates are listed.
    List,
    /// Another list has begun.
    ListMore,
    /// Another list has begun, without the margins for the uncertainty of the estimate.
    Dare,
    /// The best candidate that was not tested is tested.
    Test(Ranked),
    /// There is no candidate.
    End,
}

impl<'a> Situation<'a> {
    /// Chooses ranger and wall.
    ///
    /// # Errors
    /// [`NoAim`] if no ranger has a wall to measure.
    pub fn choose(&self) -> Result<Aim, NoAim> {
        let mut best = Err(NoAim::NoWall);
        for (ranger, _) in self.config.rangers.iter() {
            best = better(self.policy, best, self.decide(Choice::new(ranger)));
        }
        best
    }

    /// Finds the nearest wall to which a beam of a ranger at `bearing` is square.
    ///
    /// # Errors
    /// [`NoAim`] if no wall can be measured, or the robot has no such ranger.
    pub fn at(&self, ranger: RangerId, bearing: Radians) -> Result<Aim, NoAim> {
        self.decide_by::<Along>(Choice::along(ranger, bearing))
    }

    /// Makes a whole choice.
    ///
    /// # Errors
    /// [`NoAim`] if no wall can be measured, or the robot has no such ranger.
    pub fn decide(&self, choice: Choice) -> Result<Aim, NoAim> {
        self.decide_by::<ByPolicy>(choice)
    }

    fn decide_by<P: BearingRule>(&self, mut choice: Choice) -> Result<Aim, NoAim> {
        let mut planner = self.planner::<P>(&choice)?;
        loop {
            if let Some(end) = planner.proceed(&mut choice, u32::MAX) {
                return end;
            }
        }
    }

    /// Makes a slice of a choice; returns its result after the last one.
    pub fn proceed(&self, choice: &mut Choice) -> Option<Result<Aim, NoAim>> {
        match choice.along {
            None => self.proceed_by::<ByPolicy>(choice),
            Some(_) => self.proceed_by::<Along>(choice),
        }
    }

    fn proceed_by<P: BearingRule>(&self, choice: &mut Choice) -> Option<Result<Aim, NoAim>> {
        match self.planner::<P>(choice) {
            Ok(mut planner) => {
                if choice.is_daring {
                    planner.view.drop_margins();
                }
                planner.proceed(choice, SLICE)
            }
            Err(none) => Some(Err(none)),
        }
    }

    /// The planner of a choice; none if the robot has no such ranger, or it is not to be tried, because it has failed.
    fn planner<P: BearingRule>(&self, choice: &Choice) -> Result<Planner<'a, P>, NoAim> {
        let Situation { config, map, ekf, history, now, policy } = *self;
        let &Choice { ranger, standing, along, .. } = choice;
        let is_one_of_several = P::CHOOSES && config.rangers.are_several();
        let rests = is_one_of_several && history.rests(ranger, config, now);
        let sonar = config.rangers.get(ranger).filter(|_| !rests).ok_or(NoAim::NoWall)?;
        let view = Viewpoint::new(config, sonar, ekf);
        let duration = PingDuration::new(sonar);
        let mut slot = history.slot(ranger, config, &duration);
        if let Some(Standing { bearing, ready_in }) = standing {
            slot = Slot { bearing, ready_in: seconds(ready_in), ..slot };
        }
        let works = history.works(ranger, config, now);
        Ok(Planner {
            config,
            map,
            ekf,
            history,
            now,
            policy,
            ranger,
            sonar,
            along: along.unwrap_or(Radians(0.0)),
            rule: PhantomData,
            slot,
            works,
            view,
            duration,
        })
    }
}

impl<P: BearingRule> Planner<'_, P> {
    /// Makes a slice of a choice: lists candidates by this much work, or tests one of the list.
    #[inline(never)]
    fn proceed(&mut self, choice: &mut Choice, work: u32) -> Option<Result<Aim, NoAim>> {
        let ranked = match choice.step() {
            Step::Test(ranked) => ranked,
            Step::List => {
                let is_complete = match self.sonar.ranging {
                    Ranging::Sound => self.list_walls(choice, work),
                    Ranging::Light(beam) => self.list_beams(beam, choice),
                };
                choice.tested = is_complete.then_some(0);
                return None;
            }
            Step::ListMore => return None,
            Step::Dare => {
                self.view.drop_margins();
                return None;
            }
            Step::End => return Some(Err(NoAim::NoWall)),
        };
        let (id, candidate) = match self.sonar.ranging {
            Ranging::Sound => {
                let id = WallId(ranked.number);
                (id, self.by_sound(id, &self.map.wall(id)?)?)
            }
            Ranging::Light(beam) => self.by_light(beam, ranked.number)?,
        };
        let is_free = !candidate.is_occluded(id, &self.view, self.map);
        is_free.then(|| Ok(candidate.aim(self.ranger, id, choice.count)))
    }

    /// Lists the next walls, by this much work; returns whether they are the last.
    fn list_walls(&self, choice: &mut Choice, mut work: u32) -> bool {
        let near = self.map.near(self.view.position(), self.sonar.max_range);
        for (id, wall) in near.skip(choice.taken as usize) {
            if work == 0 {
                return false;
            }
            let candidate = self.by_sound(id, &wall);
            work = work.saturating_sub(if candidate.is_some() { CANDIDATE } else { 1 });
            choice.take(id.0, candidate.map(|candidate| candidate.score));
        }
        true
    }
}

/// The better one of two pings; the first of two equal ones.
fn better(
    policy: Policy,
    one: Result<Aim, NoAim>,
    other: Result<Aim, NoAim>,
) -> Result<Aim, NoAim> {
    let (Ok(first), Ok(second)) = (&one, &other) else {
        return one.or(other);
    };
    if second.score(policy) > first.score(policy) { other } else { one }
}
