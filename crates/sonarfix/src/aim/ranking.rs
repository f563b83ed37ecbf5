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

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the order in which they are found.
    #[test]
    fn of_equal_scores_the_first_wall_of_the_map_is_first() {
        let ranked = |wall, score| Ranked { wall: WallId(wall), score };
        for order in [[2, 5, 9], [9, 5, 2], [5, 9, 2], [2, 9, 5]] {
            let mut list = [None; 4];
            for wall in order {
                ranked(wall, 1.0).insert(&mut list);
            }
            ranked(7, 2.0).insert(&mut list);
            ranked(1, 0.5).insert(&mut list);
            let walls = list.map(|it| it.map(|it| it.wall));
            assert_eq!(walls, [7, 2, 5, 9].map(|wall| Some(WallId(wall))), "{order:?}");
        }
    }
}
