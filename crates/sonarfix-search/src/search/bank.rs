//! The bank: the placements with the most evidence, one per mode.

use heapless::Vec;

use super::candidates::Placement;
use super::refine::Spread;
use super::window::{Bend, Station};
use sonarfix::geometry::list::{insert_in_order, remove_at};
use sonarfix::geometry::numeric::at_least;
use sonarfix::geometry::vector::Vector;

/// Placements within this distance, metres, and this cosine of rotation (25°) are one mode.
pub(super) const SAME_PLACE: f32 = 0.3;
const SAME_ROTATION: f32 = 0.906;

/// A placement with its score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Entry {
    pub placement: Placement,
    /// Sum of the weighted scores of all pings of the window, relative to a place without walls.
    pub score: f32,
    /// What the pings of earlier cycles tell for it, relative to a place without walls; a ping counts in parts while it moves through
    /// the window ([`Entry::age`]).
    pub past: f32,
    /// That and what the pings of the window tell: the logarithm of the odds against a place without walls.
    pub evidence: f32,
    /// Pings that were scored, those of them with an echo, and those that a reflector of the map
    /// explains.
    pub pings: u8,
    pub echoes: u8,
    pub explained: u8,
    pub spread: Spread,
    pub state: State,
}

/// Where an entry stands in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    /// Its score is that of an earlier cycle.
    Stale,
    /// It is being refined.
    InTrial,
    /// It was scored in this cycle.
    Fresh,
}

impl Entry {
    /// A placement that was not scored yet.
    pub fn proposed(placement: Placement, past: f32) -> Self {
        Self {
            placement,
            score: f32::MIN,
            past,
            evidence: f32::MIN,
            pings: 0,
            echoes: 0,
            explained: 0,
            spread: Spread::default(),
            state: State::Stale,
        }
    }
}

impl Entry {
    /// Counts so much of the window's pings as past: the share of the window that new pings have filled. Each ping so counts once in
    /// the time that it takes from one end of a full window to the other. The past fades with [`MEMORY`].
    pub fn age(&mut self, gain: f32, share: f32) {
        self.past += share * (gain - self.past / MEMORY);
    }
}

/// So many windows of pings after which the past has faded to 1/e: odometry drifts, and a robot may be carried.
const MEMORY: f32 = 5.0;
/// Logarithm of the odds against a pose that was not found in earlier cycles: the search does not find every pose at once.
const MISSED: f32 = 10.5;

#[derive(Debug, Clone)]
pub(super) struct Bank<const HYPOTHESES: usize> {
    entries: Vec<Entry, HYPOTHESES>,
}

impl<const HYPOTHESES: usize> Bank<HYPOTHESES> {
    pub const fn new() -> Self {
        Self { entries: Vec::new() }
    }

    /// These entries, best first, for tests.
    #[cfg(test)]
    pub fn of(entries: &[Entry]) -> Self {
        Self { entries: entries.iter().copied().collect() }
    }

    pub fn clear(&mut self) {
        self.entries.clear();
    }

    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    pub fn entries_mut(&mut self) -> &mut [Entry] {
        &mut self.entries
    }

    /// Begins a refinement of all entries.
    pub fn begin_refinement(&mut self) {
        for entry in &mut self.entries {
            entry.state = State::Stale;
        }
    }

    /// An entry that was not refined since; it stays in the bank until its trial ends.
    pub fn next_stale(&mut self) -> Option<Entry> {
        let entry = self.entries.iter_mut().find(|entry| entry.state == State::Stale)?;
        entry.state = State::InTrial;
        Some(*entry)
    }

    /// Removes the entry in trial, if there is one.
    pub fn end_trial(&mut self) {
        self.remove(|entry| entry.state == State::InTrial);
    }

    fn remove(&mut self, is_gone: impl Fn(&Entry) -> bool) {
        while let Some(at) = self.entries.iter().position(&is_gone) {
            remove_at(&mut self.entries, at);
        }
    }

    /// The score that a newcomer has to reach.
    pub fn least_score(&self) -> Option<f32> {
        if self.entries.is_full() { self.entries.last().map(|entry| entry.score) } else { None }
    }

    /// What earlier pings tell for a newcomer: as little as for any entry, because it would have been found with more; but at most
    /// [`MISSED`] less than for the best, because the search does not find everything at once.
    pub fn least_past(&self) -> f32 {
        let pasts = self.entries.iter().map(|entry| entry.past);
        let least = pasts.reduce(|least, past| if past < least { past } else { least });
        let best = self.entries.first().map_or(0.0, |entry| entry.past);
        at_least(best - MISSED, least.unwrap_or(0.0))
    }

    /// Whether a placement is near one of the bank, so that refining it leads there.
    pub fn has_near(&self, placement: &Placement, distance: f32) -> bool {
        self.entries.iter().any(|entry| is_near(&entry.placement, placement, distance))
    }

    /// Adds an entry, or lets it replace those of its mode if the pings of the window fit it better.
    #[inline(never)]
    pub fn offer(&mut self, mut entry: Entry) {
        let placement = entry.placement;
        let is_same = |other: &Entry| is_near(&other.placement, &placement, SAME_PLACE);
        for other in self.entries.iter().filter(|other| is_same(other)) {
            if other.score >= entry.score {
                return;
            }
            if other.past > entry.past {
                entry.evidence += other.past - entry.past;
                entry.past = other.past;
            }
        }
        self.remove(is_same);
        insert_in_order(&mut self.entries, entry, |one, other| one.evidence > other.evidence);
    }

    /// Moves all placements to a new reference of the odometry frame, of which `bend` is taken out.
    pub fn rebase(&mut self, reference: &Station, bend: Bend) {
        for entry in &mut self.entries {
            entry.placement = moved(&entry.placement, reference, bend);
        }
    }
}

/// The placement of the odometry frame, of which `bend` is taken out, with the origin at a station
/// that is not far: the path to it is rotated by half of the remaining bend.
pub(super) fn moved(placement: &Placement, station: &Station, bend: Bend) -> Placement {
    let turn = placement.bend.minus(bend).at(station).0;
    let middle = placement.rotation.turned(Vector::of_angle(0.5 * turn));
    Placement {
        at: placement.at.plus(station.at.turned(middle)),
        rotation: placement.rotation.turned(Vector::of_angle(turn)),
        bend: placement.bend,
    }
}

fn is_near(one: &Placement, other: &Placement, distance: f32) -> bool {
    one.rotation.dot(other.rotation) > SAME_ROTATION
        && one.at.minus(other.at).length_squared() < distance * distance
}

#[cfg(test)]
mod tests;
