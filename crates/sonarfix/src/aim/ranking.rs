//! Order of the candidates.

use crate::map::WallId;

/// A candidate by its rank: the higher the score the better; of two equal ones the first in the map.
#[derive(Clone, Copy)]
pub(super) struct Ranked {
    pub wall: WallId,
    pub score: f32,
}

impl Ranked {
    /// Whether this candidate ranks before another.
    pub fn is_before(self, other: Self) -> bool {
        self.score > other.score || (self.score >= other.score && self.wall < other.wall)
    }

    /// Inserts the candidate into a sorted list; a full list drops its last.
    pub fn insert(mut self, list: &mut [Option<Self>]) {
        for slot in list {
            match slot {
                Some(held) if self.is_before(*held) => core::mem::swap(held, &mut self),
                Some(_) => {}
                None => {
                    *slot = Some(self);
                    return;
                }
            }
        }
    }
}
