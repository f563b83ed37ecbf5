//! Removal from a list.

/// Removes an element and moves those behind it; nothing if there is no such element. [`heapless::Vec::remove`] can panic.
pub(super) fn remove_at<T: Copy, const N: usize>(list: &mut heapless::Vec<T, N>, at: usize) {
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

    #[test]
    fn an_element_is_removed_and_no_other() {
        let list: heapless::Vec<u8, 4> = [1, 2, 3, 4].into_iter().collect();
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
