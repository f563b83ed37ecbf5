//! Order of the candidates.

/// A candidate by its rank: the higher the score the better; of two equal ones the first by its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ranked {
    /// Number of the wall in its map, or of the beam in its fan.
    pub number: u32,
    pub score: f32,
}

impl Ranked {
    /// Ranks after all candidates.
    pub const NONE: Self = Self { number: u32::MAX, score: f32::NEG_INFINITY };
    /// Ranks before all candidates.
    pub const BEFORE_ALL: Self = Self { number: 0, score: f32::INFINITY };

    /// Whether this candidate ranks before another.
    pub fn is_before(self, other: Self) -> bool {
        self.score > other.score || (self.score >= other.score && self.number < other.number)
    }

    /// Inserts the candidate into a sorted list, which drops its last.
    pub fn insert(mut self, list: &mut [Self]) {
        for slot in list {
            if self.is_before(*slot) {
                core::mem::swap(slot, &mut self);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the order in which they are found.
    #[test]
    fn of_equal_scores_the_first_number_is_first() {
        let ranked = |number, score| Ranked { number, score };
        for order in [[2, 5, 9], [9, 5, 2], [5, 9, 2], [2, 9, 5]] {
            let mut list = [Ranked::NONE; 4];
            for number in order {
                ranked(number, 1.0).insert(&mut list);
            }
            ranked(7, 2.0).insert(&mut list);
            ranked(1, 0.5).insert(&mut list);
            assert_eq!(list.map(|it| it.number), [7, 2, 5, 9], "{order:?}");
        }
    }
}
