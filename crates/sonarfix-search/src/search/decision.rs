//! What a cycle has found.

use sonarfix::geometry::numeric::at_least;
use sonarfix::geometry::units::Metres;
use sonarfix::geometry::vector::Vector;
use sonarfix::map::WallId;

use super::bank::Entry;
use super::state::{Decision, Work};
use super::trial::Trial;
use super::{Search, at_least_one, largest};

/// Below this mean log-likelihood per ping, relative to echoes anywhere, much that is around is not in the map: the
/// answer has to persist for so many times longer, unless it leads by so many margins.
const UNCERTAIN_SCORE: f32 = 0.3;
const UNCERTAIN_FOR: u16 = 3;
const CLEAR_LEAD: f32 = 4.0;
/// An answer that leads by so many margins need not persist longer than for half of the novel pings.
const LARGE_LEAD: f32 = 8.0;
/// A global check is made when a hypothesis has persisted, and at least once in so many cycles.
const CHECK_EVERY: u32 = 4;
/// A position with a larger deviation than this is undetermined, metres.
const UNDETERMINED: f32 = 0.3;

impl<const PINGS: usize, const HYPOTHESES: usize> Search<'_, PINGS, HYPOTHESES> {
    /// Mean log-likelihood per ping, relative to a place without walls.
    pub(super) fn fit_of(&self, entry: &Entry) -> f32 {
        let nothing = self.echoes.nothing(entry.pings, entry.echoes);
        (entry.score - nothing) / at_least_one(entry.pings)
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
    pub(super) fn persistence(&self, best: &Entry) -> u16 {
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
