//! Short lists: an element is inserted or removed by exchanges of neighbours. `Vec::insert` and `remove` of `heapless` move a whole
//! range of memory, by a function of 1.5 KB, and contain a panic.
//!
//! # Non-finite policy
//! Elements are moved as they are.

use core::mem::{swap, take};

use heapless::Vec;

/// Inserts an element at a place from 0 to the length of a list, which is not full; otherwise nothing is inserted.
pub fn insert_at<T, const N: usize>(list: &mut Vec<T, N>, at: usize, element: T) {
    if list.push(element).is_err() {
        return;
    }
    let mut rest = list.get_mut(at..).unwrap_or_default();
    while let Some((last, before)) = take(&mut rest).split_last_mut() {
        if let Some(previous) = before.last_mut() {
            swap(previous, last);
        }
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
    fn an_element_is_inserted_at_its_place_unless_the_list_is_full() {
        for (before, at, after) in [
            (&[][..], 0, &[9][..]),
            (&[1, 2, 3], 0, &[9, 1, 2, 3]),
            (&[1, 2, 3], 2, &[1, 2, 9, 3]),
            (&[1, 2, 3], 3, &[1, 2, 3, 9]),
            (&[1, 2, 3, 4], 1, &[1, 2, 3, 4]),
        ] {
            let mut list = list(before);
            insert_at(&mut list, at, 9);
            assert_eq!(list, after);
        }
    }
}
