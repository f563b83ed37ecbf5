//! What a cycle has found.

use sonarfix::geometry::numeric::{at_least, at_most};
use sonarfix::geometry::units::Metres;
use sonarfix::geometry::vector::Vector;
use sonarfix::map::WallId;

use super::bank::{Entry, State};
use super::state::{Decision, Work};
use super::trial::{Trial, count};
use super::{Search, at_least_one, largest};

/// Mean scores per ping at which the evidence counts not at all, and fully: where much of what is around is not in the map, pings
/// that no wall explains come in groups.
const UNTRUSTED: f32 = 0.4;
const TRUSTED: f32 = 0.6;
/// An answer needs less than the whole odds where the map explains more than this share of the echoes, and half of them where it explains all:
/// what misleads a search is furniture. Chosen as `docs/search.md` states.
const EXPLAINED: f32 = 0.8;
/// So many global checks are made before an answer since the last rival, the last one with a clear lead.
const CHECKS: u8 = 3;
/// A global check is made at least once in so many cycles.
const CHECK_EVERY: u32 = 4;
/// A position with a larger deviation than this is undetermined, metres.
const UNDETERMINED: f32 = 0.3;

impl<const PINGS: usize, const HYPOTHESES: usize> Search<'_, PINGS, HYPOTHESES> {
    /// Mean log-likelihood per ping, relative to a place without walls.
    pub(super) fn fit_of(&self, entry: &Entry) -> f32 {
        self.gain(entry) / at_least_one(entry.pings)
    }

    /// What the pings of the window tell for an entry, relative to a place without walls.
    fn gain(&self, entry: &Entry) -> f32 {
        entry.score - self.echoes.nothing(entry.pings.into(), entry.echoes.into())
    }

    /// Whether the lines are more than one wall.
    pub(super) fn has_separate_lines(&self) -> bool {
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
    pub(super) fn decide(&mut self, is_checked: bool) {
        self.cycles = self.cycles.wrapping_add(1);
        let taken = self.window.taken();
        let fresh = taken.wrapping_sub(self.taken);
        self.taken = taken;
        let Some(best) = self.bank.entries().first().copied() else {
            self.checks = 0;
            self.answer = Decision::Nowhere;
            self.is_check_due = true;
            return;
        };
        let least = best.evidence - 0.5 * self.parameters.odds;
        let rivals = self.bank.entries().iter().filter(|entry| entry.evidence > least).count();
        let spread = &best.spread;
        let variance = largest(spread.xx, spread.xy, spread.yy);
        let is_determined = variance < UNDETERMINED * UNDETERMINED;
        let (position, heading) = self.parameters.sharpness;
        let is_sharp =
            variance < position.0 * position.0 && spread.rotation < heading.0 * heading.0;
        let is_clear =
            self.lead(&best) >= self.odds(&best) && is_sharp && self.has_separate_lines();
        self.age(fresh);
        let was_unique = matches!(self.answer, Decision::Unique(_));
        self.checks = match rivals {
            1 => self.checks.saturating_add(is_checked.into()),
            _ => 0,
        };
        let is_checked = was_unique || is_checked && self.checks >= CHECKS;
        self.is_check_due = is_clear && !is_checked || self.cycles.is_multiple_of(CHECK_EVERY);
        // False for NaN.
        let is_anywhere = best.evidence > 0.0;
        self.answer = if !is_anywhere {
            Decision::Nowhere
        } else if let Some(along) = self.along(&best).filter(|_| !is_determined) {
            along
        } else if is_clear && is_checked {
            // The answer before stays until this one is refined.
            self.work = Work::Trial(Trial::of_answer(&best));
            return;
        } else {
            Decision::Several(rivals)
        };
    }

    /// Logarithm of the odds of the best entry against the next, or a place without walls if that is more probable; less if
    /// the pings hardly fit it.
    pub(super) fn lead(&self, best: &Entry) -> f32 {
        let second = self.bank.entries().get(1).map_or(0.0, |entry| entry.evidence);
        let mean = best.score / at_least_one(best.pings);
        let trust = at_most(at_least((mean - UNTRUSTED) / (TRUSTED - UNTRUSTED), 0.0), 1.0);
        trust * (best.evidence - at_least(second, 0.0))
    }

    /// Logarithm of the odds that an answer needs.
    fn odds(&self, best: &Entry) -> f32 {
        let explained = f32::from(best.explained) / at_least_one(best.echoes);
        let well = at_least(explained - EXPLAINED, 0.0) / (1.0 - EXPLAINED);
        self.parameters.odds * (1.0 - 0.5 * well)
    }

    /// Counts what so many new pings have moved through the window as past.
    fn age(&mut self, fresh: u16) {
        let share = at_most(f32::from(fresh) / count(PINGS), 1.0);
        // One that was proposed in this cycle has no score.
        let scored = self.bank.entries_mut().iter_mut().filter(|it| it.state == State::Fresh);
        for entry in scored {
            let gain = entry.score - self.echoes.nothing(entry.pings.into(), entry.echoes.into());
            entry.age(gain, share);
        }
    }

    /// The wall along which the position of an entry is undetermined: the nearest that is parallel to
    /// the long axis of its error ellipse.
    pub(super) fn along(&self, entry: &Entry) -> Option<Decision> {
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
