//! Suggests a known key or word for an unknown one.

/// The key that is nearest to an unknown one, if a typing error is plausible: at most one edit per three letters.
pub(crate) fn nearest<'k>(unknown: &str, keys: &[&'k str]) -> Option<&'k str> {
    let far = unknown.chars().count().div_ceil(3);
    // Parts are labelled as in `HC-SR04`.
    let plain = unknown.to_lowercase().replace(['-', ' '], "_");
    let near = keys.iter().map(|key| (edit_distance(&plain, key), *key));
    near.filter(|(distance, _)| *distance <= far).min().map(|(_, key)| key)
}

/// The known words for a message, and the one that was probably meant: `"on" or "off"; did you mean "off"?`.
pub(crate) fn alternatives(unknown: &str, known: &[&str]) -> String {
    let quoted: Vec<String> = known.iter().map(|word| format!("\"{word}\"")).collect();
    let list = match quoted.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => quoted.concat(),
    };
    match nearest(unknown, known) {
        Some(meant) => format!("{list}; did you mean \"{meant}\"?"),
        None => list,
    }
}

/// The number of insertions, deletions and replacements of letters between two words (Levenshtein distance).
fn edit_distance(one: &str, other: &str) -> usize {
    let other: Vec<char> = other.chars().collect();
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (done, letter) in one.chars().enumerate() {
        let mut diagonal = done;
        let mut left = done + 1;
        let mut next = vec![left];
        for (above, known) in row.iter().skip(1).zip(&other) {
            left = (above + 1).min(left + 1).min(diagonal + usize::from(letter != *known));
            diagonal = *above;
            next.push(left);
        }
        row = next;
    }
    row.last().copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_levenshtein() {
        let cases = [
            ("", "", 0),
            ("", "abc", 3),
            ("kitten", "sitting", 3),
            ("abc", "acb", 2),
            ("ab", "a", 1),
        ];
        for (one, other, distance) in cases {
            assert_eq!(edit_distance(one, other), distance, "{one} {other}");
            assert_eq!(edit_distance(other, one), distance, "{other} {one}");
        }
    }

    #[test]
    fn only_a_near_key_is_suggested() {
        let keys = ["servo_timing", "servo", "cone"];
        assert_eq!(nearest("srvo", &keys), Some("servo"));
        assert_eq!(nearest("servo_timeing", &keys), Some("servo_timing"));
        assert_eq!(nearest("height", &keys), None);
    }
}
