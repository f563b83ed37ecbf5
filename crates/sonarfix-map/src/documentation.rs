//! Explains keys in texts: in `docs/formats.md`, and in the comments of new robot files.

use crate::{robot_file, scenario};

/// The tables of keys in `docs/formats.md`, by the names of their markers.
#[must_use]
pub fn documentation() -> Vec<(&'static str, String)> {
    [robot_file::rows(), scenario::rows()].concat()
}

/// The text of a robot file with the explanation of its key at each value that has no comment, or a comment that ends in a
/// colon.
#[must_use]
pub fn with_comments(text: &str) -> String {
    let notes = robot_file::notes();
    let mut section = "robot";
    let mut commented = String::new();
    for line in text.lines() {
        if let Some(header) = line.strip_prefix('[') {
            section = header.trim_matches(['[', ']']);
        }
        let (value, comment) = line.split_once('#').unwrap_or((line, " "));
        let key = value.split_once(" = ").map_or("", |(key, _)| key);
        let note = notes.get(&format!("{section}.{key}"));
        let note = note.filter(|_| comment == " " || comment.ends_with(':'));
        commented += &note.map_or_else(
            || line.to_owned(),
            |note| {
                let note = format!("#{} {note}", comment.trim_end());
                let value = value.trim_end();
                if value.len() < 37 {
                    format!("{value:36} {note}")
                } else {
                    format!("{note}\n{value}")
                }
            },
        );
        commented.push('\n');
    }
    commented
}
