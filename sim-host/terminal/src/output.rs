//! Standard output and error of the command. The macros of this module replace those of the standard
//! library, which panic if the stream is closed or full.
//!
//! - A closed standard output (`sonarfix … | head -2`) ends the command quietly.
//! - A full one ends it with an error message.
//! - What cannot be written to standard error is dropped.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};
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

fn shortened(line: &str) -> String {
    match line.char_indices().nth(LONGEST_LINE) {
        Some((end, _)) => format!("{} …", line.get(..end).unwrap_or_default()),
        None => line.to_owned(),
    }
}
