//! Lines of positions in a text.

/// The line of a position in a text; lines count from 1.
pub(crate) fn line(text: &str, at: usize) -> usize {
    text.bytes().take(at).filter(|&byte| byte == b'\n').count() + 1
}

/// The line of each position in a text, both in ascending order; lines count from 1.
pub(crate) fn lines(text: &str, places: &[usize]) -> Vec<usize> {
    let mut line = 1;
    let mut from = 0;
    let mut line_at = |&place: &usize| {
        line += text.get(from..place).unwrap_or_default().matches('\n').count();
        from = place.max(from);
        line
    };
    places.iter().map(&mut line_at).collect()
}
