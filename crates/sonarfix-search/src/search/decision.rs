//! What a cycle has found.

use sonarfix::geometry::numeric::{at_least, at_most};
use sonarfix::geometry::units::Metres;
use sonarfix::geometry::vector::Vector;
use sonarfix::map::WallId;

use super::bank::{Entry, State};
use super::state::Decision;
use super::trial::count;
use super::{Search, largest};

/// An answer needs a logarithm of odds that is by so much larger if the map explained no echo: what misleads a search is furniture.
const UNEXPLAINED: f32 = 22.0;
/// So many echoes more count as unexplained: the share that the map explains of a few echoes is uncertain.
const UNKNOWN_ECHOES: f32 = 4.0;
/// Evidence that an answer needs besides: with less, a few echoes decide, which often fit elsewhere as well.
const LEAST_EVIDENCE: f32 = 60.0;
/// Hypotheses are rivals whose evidence is less than this below that of the best one.
const RIVAL: f32 = 6.0;
/// So many lines reach the end of the last wall between the last rival and an answer. The first may have been on its way: one was moved
/// along every wall.
const LINES_BEFORE_ANSWER: u8 = 2;
/// A position with a larger deviation than this is undetermined, metres.
const UNDETERMINED: f32 = 0.3;

impl<const PINGS: usize, const HYPOTHESES: usize> Search<'_, PINGS, HYPOTHESES> {
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
    pub(super) fn decide(&mut self) {
        self.cycles = self.cycles.wrapping_add(1);
        let taken = self.window.taken();
        let fresh = taken.wrapping_sub(self.taken);
        self.taken = taken;
        let Some(best) = self.bank.entries().first().copied() else {
            self.check.moved = 0;
            self.answer = Decision::Nowhere;
            return;
        };
        let least = best.evidence - RIVAL;
        let rivals = self.bank.entries().iter().filter(|entry| entry.evidence > least).count();
        let spread = &best.spread;
        let variance = largest(spread.xx, spread.xy, spread.yy);
        let is_determined = variance < UNDETERMINED * UNDETERMINED;
        let (position, heading) = self.sharpness;
        let is_sharp =
            variance < position.0 * position.0 && spread.rotation < heading.0 * heading.0;
        let is_clear = self.lead(&best) >= self.odds(&best)
            && best.evidence >= LEAST_EVIDENCE
            && is_sharp
            && self.has_separate_lines();
        self.age(fresh);
        let was_unique = matches!(self.answer, Decision::Unique(_));
        if rivals > 1 {
            self.check.moved = 0;
        }
        let is_checked = was_unique || self.check.moved >= LINES_BEFORE_ANSWER;
        // False for NaN.
        let is_anywhere = best.evidence > 0.0;
        self.answer = if !is_anywhere {
            Decision::Nowhere
        } else if let Some(along) = self.along(&best).filter(|_| !is_determined) {
            along
        } else if is_clear && is_checked {
            // The answer before stays until this one is refined.
            self.is_found = true;
            return;
        } else {
            Decision::Several(rivals)
        };
    }

    /// Logarithm of the odds of the best entry against the next, or a place without walls if that is more probable.
    fn lead(&self, best: &Entry) -> f32 {
        let second = self.bank.entries().get(1).map_or(0.0, |entry| entry.evidence);
        best.evidence - at_least(second, 0.0)
    }

    /// Logarithm of the odds that an answer needs.
    #[inline(never)]
    fn odds(&self, best: &Entry) -> f32 {
        let explained = f32::from(best.explained) / (f32::from(best.echoes) + UNKNOWN_ECHOES);
        self.odds + UNEXPLAINED * (1.0 - explained)
    }

    /// Counts what so many new pings have moved through the window as past.
    fn age(&mut self, fresh: u16) {
        let share = at_most(f32::from(fresh) / count(PINGS), 1.0);
        // One that was proposed in this cycle has no score.
        let scored = self.bank.entries_mut().iter_mut().filter(|it| it.state == State::Fresh);
        for entry in scored {
            entry.age(entry.score, share);
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
