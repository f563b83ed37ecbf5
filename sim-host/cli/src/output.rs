//! Standard output and error of the command. The macros of this module replace those of the standard
//! library, which panic if the stream is closed or full.
//!
//! - A closed standard output (`sonarfix … | head -2`) ends the command quietly.
//! - A full one ends it with an error message.
//! - What cannot be written to standard error is dropped.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};
use std::process::exit;

/// As the standard library's, without panic.
macro_rules! println {
    ($($argument:tt)*) => { $crate::output::print(format_args!("{}\n", format_args!($($argument)*))) };
}

/// As the standard library's, without panic.
macro_rules! print {
    ($($argument:tt)*) => { $crate::output::print(format_args!($($argument)*)) };
}

/// As the standard library's, without panic.
macro_rules! eprintln {
    ($($argument:tt)*) => { $crate::output::report(format_args!($($argument)*)) };
}

/// The longest line of an error message, characters: one line of a screen or two. Files that are no
/// text have lines of any length, and messages quote them.
const LONGEST_LINE: usize = 160;

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

/// Writes lines to standard error, each shortened to one that a screen holds.
pub fn report(text: Arguments) {
    let mut error = io::stderr().lock();
    for line in text.to_string().lines() {
        let _ = writeln!(error, "{}", shortened(line));
    }
}

fn shortened(line: &str) -> String {
    match line.char_indices().nth(LONGEST_LINE) {
        Some((end, _)) => format!("{} …", line.get(..end).unwrap_or_default()),
        None => line.to_owned(),
    }
}
