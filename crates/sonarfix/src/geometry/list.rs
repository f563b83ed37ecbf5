//! Short lists: an element is inserted or removed by exchanges of neighbours. `Vec::insert` and `remove` of `heapless` move a whole
//! range of memory, by a function of 1.5 KB, and contain a panic.
//!
//! # Non-finite policy
//! Elements are moved as they are.

use core::mem::{swap, take};

use heapless::Vec;

/// Inserts an element into a list that is in order: before the first one that it precedes. From a full list the last one drops out
/// instead, unless the element does not precede it.
pub fn insert_in_order<T, const N: usize>(
    list: &mut Vec<T, N>,
    element: T,
    precedes: impl Fn(&T, &T) -> bool,
) {
    if list.is_full() {
        if !list.last().is_some_and(|last| precedes(&element, last)) {
            return;
        }
        list.pop();
    }
    if list.push(element).is_err() {
        return;
    }
    let mut rest = list.as_mut_slice();
    while let Some((last, before)) = take(&mut rest).split_last_mut() {
        let Some(previous) = before.last_mut().filter(|it| precedes(last, it)) else { return };
        swap(previous, last);
        rest = before;
    }
}

/// Removes the element at this place, if there is one.
pub fn remove_at<T: Copy, const N: usize>(list: &mut Vec<T, N>, at: usize) {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn list(elements: &[u8]) -> Vec<u8, 4> {
        elements.iter().copied().collect()
    }

    #[test]
    fn an_element_is_removed_and_no_other() {
        for (at, left) in [
            (0, &[2, 3, 4][..]),
            (1, &[1, 3, 4]),
            (3, &[1, 2, 3]),
            (4, &[1, 2, 3, 4]),
            (9, &[1, 2, 3, 4]),
        ] {
            let mut list = list(&[1, 2, 3, 4]);
            remove_at(&mut list, at);
            assert_eq!(list, left);
        }
    }

    #[test]
    fn an_element_is_inserted_in_order_and_the_last_drops_out_of_a_full_list() {
        // By tens: equal elements stay in the order in which they came.
        let precedes = |one: &u8, other: &u8| one / 10 < other / 10;
        for (before, element, after) in [
            (&[][..], 9, &[9][..]),
            (&[10, 20, 30], 5, &[5, 10, 20, 30]),
            (&[10, 20, 30], 21, &[10, 20, 21, 30]),
            (&[10, 20, 30], 39, &[10, 20, 30, 39]),
            (&[10, 20, 30, 40], 15, &[10, 15, 20, 30]),
            (&[10, 20, 30, 40], 35, &[10, 20, 30, 35]),
            (&[10, 20, 30, 40], 41, &[10, 20, 30, 40]),
        ] {
            let mut list = list(before);
            insert_in_order(&mut list, element, precedes);
            assert_eq!(list, after);
        }
        let mut none: Vec<u8, 0> = Vec::new();
        insert_in_order(&mut none, 9, precedes);
        assert!(none.is_empty());
    }
}
