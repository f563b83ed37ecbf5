//! Lists in the order of a score, best first.

use heapless::Vec;
use sonarfix::geometry::list::insert_at;

/// Inserts an element behind those with an equal or higher score. In a full list it replaces the last one, if its score is higher.
pub(super) fn insert_ranked<T, S: PartialOrd, const N: usize>(
    list: &mut Vec<T, N>,
    element: T,
    score: impl Fn(&T) -> S,
) {
    let is_below = |other: &T| score(other) < score(&element);
    if list.is_full() {
        if !list.last().is_some_and(is_below) {
            return;
        }
        list.pop();
    }
    let at = list.iter().position(is_below).unwrap_or(list.len());
    insert_at(list, at, element);
}
