//! The stages of a cycle, in bounded slices: lines, the bank, pairs of lines on pairs of walls, and a part of the global check.

use sonarfix::geometry::numeric::at_least;
use sonarfix::geometry::units::Metres;

use super::Search;
use super::bank::{Entry, SAME_PLACE, moved};
use super::candidates::{Generated, Pairs, Placement, make_a_pair};
use super::lines::{Line, TILTS};
use super::state::{Decision, Task, Work};
use super::trial::{Trial, Verdict};

/// Fewer pings than these are no window to search with.
pub(super) const LEAST_PINGS: usize = 12;
/// Pairs of lines that every cycle tries, and those that take turns.
pub(super) const BEST_PAIRS: u8 = 4;
pub(super) const OTHER_PAIRS: u8 = 4;
/// Lines that the global check moves along every wall, one after the other, and its steps in one cycle.
pub(super) const CHECKED_LINES: usize = 4;
pub(super) const CHECK_STEPS: u16 = 500;

/// Candidates are rejected below this share of the best score, and so much below it: those of pairs, and those of the global check. A
/// hypothesis whose score is by more than the second lower is certainly no rival.
const OF_PAIR: (f32, f32) = (0.25, f32::MAX);
const OF_CHECK: (f32, f32) = (0.6, 30.0);

/// How far beside its region a start may seem to lie: metres, and metres per metre travelled since.
pub(super) const REGION_MARGIN: f32 = 0.1;

impl<const PINGS: usize, const HYPOTHESES: usize> Search<'_, PINGS, HYPOTHESES> {
    #[inline(never)]
    pub(super) fn evaluate(&mut self) {
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
                match trial.advance(&self.echoes, &self.window, &self.odometry) {
                    Verdict::Running => return,
                    Verdict::Rejected => self.bank.end_trial(),
                    Verdict::Scored(entry) if is_answer => self.conclude(entry),
                    Verdict::Scored(entry) => {
                        self.bank.end_trial();
                        self.bank.offer(entry);
                    }
                }
                self.work = Work::None;
            }
        }
    }

    /// Makes a refined entry the answer, unless the refinement has moved it away from every hypothesis: the pings do not determine it then.
    pub(super) fn conclude(&mut self, entry: Entry) {
        if self.bank.has_near(&entry.placement, SAME_PLACE) {
            self.answer = Decision::Unique(entry);
        }
        // Its entry is still to be refined like the others.
        self.bank.begin_refinement();
    }

    /// Makes a step of the task.
    pub(super) fn begin(&mut self) {
        self.task = match self.task {
            Task::Rebase => self.rebase(),
            Task::Vote { ping, tilt } => self.vote(ping, tilt),
            Task::Fit { line } => self.fit(line),
            Task::Bank => self.refine(),
            Task::Pairs { pair, pairs } => self.try_pairs(pair, pairs),
            Task::Check { steps } => self.check(steps),
        };
    }

    pub(super) fn vote(&mut self, ping: u16, tilt: u8) -> Task {
        let Some(part) = TILTS.get(usize::from(tilt)) else {
            self.window.weigh(usize::from(ping));
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
    pub(super) fn rebase(&mut self) -> Task {
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

    pub(super) fn fit(&mut self, line: u8) -> Task {
        self.lines.fit(self.window.pings(), usize::from(line));
        if usize::from(line) + 1 < self.lines.all().len() {
            Task::Fit { line: line + 1 }
        } else {
            self.bank.begin_refinement();
            Task::Bank
        }
    }

    /// Tries the entries of the bank again, one after the other; before them the best one as the answer, if the last cycle has found one:
    /// the frame is at the robot now, so that the odometry adds least to the pose until it is used.
    pub(super) fn refine(&mut self) -> Task {
        match self.bank.next_stale() {
            Some(entry) => {
                let mut trial = Trial::of_entry(&entry);
                trial.is_answer = core::mem::take(&mut self.is_found);
                self.work = Work::Trial(trial);
                Task::Bank
            }
            None => Task::Pairs { pair: 0, pairs: Pairs::default() },
        }
    }

    #[inline(never)]
    pub(super) fn try_pairs(&mut self, pair: u8, mut pairs: Pairs) -> Task {
        let Some((first, second)) = self.pair(pair) else {
            return Task::Check { steps: 0 };
        };
        let bend = self.window.bend();
        match pairs.next(&self.echoes.reflectors.map, &first, &second, bend) {
            Generated::Candidate(placement) => self.try_candidate(placement, 0.15, OF_PAIR),
            Generated::Nothing => {}
            Generated::Done => return Task::Pairs { pair: pair + 1, pairs: Pairs::default() },
        }
        Task::Pairs { pair, pairs }
    }

    /// Moves a line a step on along the walls.
    #[inline(never)]
    pub(super) fn check(&mut self, steps: u16) -> Task {
        let lines = self.lines.all();
        let lines = lines.get(..CHECKED_LINES).unwrap_or(lines);
        let nth = usize::from(self.check.turn).checked_rem(lines.len());
        let line = nth.and_then(|nth| lines.get(nth)).copied();
        let Some(line) = line.filter(|_| steps < CHECK_STEPS) else {
            self.decide();
            return Task::Rebase;
        };
        let bend = self.window.bend();
        match self.check.along.next(&self.echoes.reflectors.map, &line, bend) {
            Generated::Candidate(placement) => self.try_candidate(placement, 0.25, OF_CHECK),
            Generated::Nothing => {}
            Generated::Done => self.check.end_line(),
        }
        Task::Check { steps: steps + 1 }
    }

    /// Tries a placement that is not within `near` of one of the bank, and is rejected once it cannot reach the share `rivalry` of the best
    /// score, nor come within `within` of it.
    pub(super) fn try_candidate(
        &mut self,
        placement: Placement,
        near: f32,
        (rivalry, within): (f32, f32),
    ) {
        let start = placement.at.plus(self.window.start().turned(placement.rotation));
        let margin = REGION_MARGIN * (1.0 + self.window.since_start());
        let is_outside =
            self.region.is_some_and(|region| !region.contains(start.into(), Metres(margin)));
        if is_outside || self.bank.has_near(&placement, near) {
            return;
        }
        let best = self.bank.entries().first().map_or(0.0, |entry| entry.score);
        let full = self.bank.least_score().unwrap_or(0.0);
        let rival = at_least(rivalry * best, best - within);
        let least = at_least(at_least(full, rival), 0.0);
        self.work = Work::Trial(Trial::of_candidate(placement, least, self.bank.least_past()));
    }

    /// The pairs of this cycle: the best ones, then others that take turns.
    pub(super) fn pair(&self, number: u8) -> Option<(Line, Line)> {
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
    pub(super) fn nth_pair(&self, nth: usize) -> Result<(Line, Line), usize> {
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
}
