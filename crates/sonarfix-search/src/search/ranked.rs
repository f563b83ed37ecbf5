//! Lists in the order of a score, best first.

use heapless::Vec;

/// Removes an element and moves those behind it; nothing if there is no such element. [`Vec::remove`] can panic.
pub(super) fn remove_at<T: Copy, const N: usize>(list: &mut Vec<T, N>, at: usize) {
    let Some(tail) = list.get_mut(at..) else { return };
    let mut behind: Option<&mut T> = None;
    let mut is_empty = true;
    for element in tail {
        if let Some(slot) = behind {
            *slot = *element;
        }
        behind = Some(element);
        is_empty = false;
    }
    if !is_empty {
        list.pop();
    }
}

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
    // There is room: it was made above.
    let _ = list.insert(at, element);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_element_is_removed_and_no_other() {
        let list: Vec<u8, 4> = [1, 2, 3, 4].into_iter().collect();
        for (at, left) in [
            (0, &[2, 3, 4][..]),
            (1, &[1, 3, 4]),
            (3, &[1, 2, 3]),
            (4, &[1, 2, 3, 4]),
            (9, &[1, 2, 3, 4]),
        ] {
            let mut list = list.clone();
            remove_at(&mut list, at);
            assert_eq!(list, left);
        }
    }
}
