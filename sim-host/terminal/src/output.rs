//! Standard output and error of the command. The macros of this module replace those of the standard
//! library, which panic if the stream is closed or full.
//!
//! - A closed standard output (`sonarfix … | head -2`) ends the command quietly.
//! - A full one ends it with an error message.
//! - What cannot be written to standard error is dropped.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::Path;
use std::process::exit;

use anyhow::Context;

/// As the standard library's, without panic.
#[macro_export]
macro_rules! println {
    ($($argument:tt)*) => { $crate::output::print(format_args!("{}\n", format_args!($($argument)*))) };
}

/// As the standard library's, without panic.
#[macro_export]
macro_rules! print {
    ($($argument:tt)*) => { $crate::output::print(format_args!($($argument)*)) };
}

/// As the standard library's, without panic.
#[macro_export]
macro_rules! eprintln {
    ($($argument:tt)*) => { $crate::output::report(format_args!($($argument)*)) };
}

/// The longest line of an error message, characters. Files that are no text have lines of any length, and messages quote
/// them; every other message is shorter.
const LONGEST_LINE: usize = 4_000;

/// Columns of a terminal of unknown width.
const USUAL_WIDTH: usize = 80;

/// Writes to standard output; ends the command if that fails.
pub fn print(text: Arguments) {
    let mut out = io::stdout().lock();
    if let Err(error) = out.write_fmt(text).and_then(|()| out.flush()) {
        if error.kind() == ErrorKind::BrokenPipe {
            exit(0);
        }
        report(format_args!("error: standard output: {error}"));
        exit(1);
    }
}

/// Writes lines to standard error: on a terminal wrapped between words, into a pipe as they are.
pub fn report(text: Arguments) {
    let error = io::stderr();
    let width = error.is_terminal().then(width);
    let mut error = error.lock();
    for line in text.to_string().lines() {
        let line = shortened(line);
        let line = width.map_or_else(|| line.clone(), |width| wrapped(&line, width));
        let _ = writeln!(error, "{line}");
    }
}

/// Columns of the terminal.
fn width() -> usize {
    let columns = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let columns = columns.or_else(|| Some(console::Term::stderr().size_checked()?.1.into()));
    columns.filter(|columns| *columns >= 20).unwrap_or(USUAL_WIDTH)
}

/// A line in pieces of at most this many characters, broken between words; those after the first are indented.
fn wrapped(line: &str, width: usize) -> String {
    let mut text = String::new();
    let mut column = 0;
    for word in line.split(' ') {
        let length = word.chars().count();
        let separator = match column {
            0 => "",
            _ if column + 1 + length > width => "\n    ",
            _ => " ",
        };
        column = if separator.len() > 1 { 4 } else { column + separator.len() } + length;
        text += separator;
        text += word;
    }
    text
}

/// Checks that a file can be written, before the work whose result it is to hold; its contents stay.
///
/// # Errors
/// If it cannot be, with the option that names it.
pub fn check_file(option: &str, file: &Path) -> anyhow::Result<()> {
    let created = sonarfix_files::Output::create(file);
    created.with_context(|| format!("{option}: cannot write {}", file.display()))?;
    Ok(())
}

/// Makes a folder, before the work whose results it is to hold.
///
/// # Errors
/// If it cannot be made, with the option that names it.
pub fn check_folder(option: &str, folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{option} {}", folder.display()))
}

/// A line as it is printed: what it quotes of a file may be long, and may have characters that control a terminal.
fn shortened(line: &str) -> String {
    let line: String =
        line.chars().map(|it| if it.is_control() { '\u{fffd}' } else { it }).collect();
    match line.char_indices().nth(LONGEST_LINE) {
        Some((end, _)) => format!("{} …", line.get(..end).unwrap_or_default()),
        None => line,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_wrapped_between_words_and_loses_none() {
        let line = "error: a remedy at the end of a long line";
        let lines = wrapped(line, 20);
        assert!(lines.lines().all(|line| line.chars().count() <= 20), "{lines}");
        assert_eq!(lines.split_whitespace().collect::<Vec<_>>().join(" "), line);
        assert_eq!(wrapped("short", 20), "short");
    }
}
