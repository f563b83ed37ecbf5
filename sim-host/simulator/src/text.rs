//! Text in lines of a width.

/// A line in pieces of at most this many characters, broken between words, and within a word that is longer than a line.
/// Those after the first are indented.
#[must_use]
pub fn wrapped(line: &str, width: usize, indent: usize) -> Vec<String> {
    let mut text = String::new();
    let mut lines = Vec::new();
    let mut column = 0;
    let mut begin = |text: &mut String| {
        lines.push(std::mem::replace(text, " ".repeat(indent)));
        indent
    };
    for (number, word) in line.split(' ').enumerate() {
        let mut rest: Vec<char> = word.chars().collect();
        if number > 0 && column + 1 + rest.len() > width {
            column = begin(&mut text);
        } else if number > 0 {
            text.push(' ');
            column += 1;
        }
        while column + rest.len() > width && indent < width {
            text.extend(rest.drain(..(width - column).min(rest.len())));
            column = begin(&mut text);
        }
        column += rest.len();
        text.extend(rest);
    }
    lines.push(text);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_wrapped_between_words_and_loses_none() {
        let line = "error: a remedy at the end of a long line";
        let lines = wrapped(line, 20, 4);
        assert!(lines.iter().all(|line| line.chars().count() <= 20), "{lines:?}");
        assert!(lines.iter().skip(1).all(|line| line.starts_with("    ")), "{lines:?}");
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&lines.join(" ")), words(line));
        assert_eq!(wrapped("short", 20, 4), ["short"]);
        assert_eq!(wrapped("   1    x", 20, 8), ["   1    x"]);
    }

    #[test]
    fn a_word_that_is_longer_than_a_line_is_broken() {
        assert_eq!(wrapped("a /folder/file.csv", 10, 2), ["a", "  /folder/", "  file.csv"]);
        // There is no room beside the indent.
        assert_eq!(wrapped("a bc", 2, 4), ["a", "    bc"]);
    }
}
