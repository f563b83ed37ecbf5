//! Standard output and error of the command. The macros of this module replace those of the standard
//! library, which panic if the stream is closed or full.
//!
//! - A closed standard output (`sonarfix … | head -2`) ends the command quietly.
//! - A full one ends it with an error message.
//! - What cannot be written to standard error is dropped.

use std::fmt::Arguments;
use std::fs::File;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::Path;
use std::process::exit;
use std::sync::atomic::{AtomicU8, Ordering};

use anyhow::Context;
use sonarfix_sim::text::wrapped;

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

/// As [`eprintln!`], if the command is to say more.
#[macro_export]
macro_rules! detail {
    ($($argument:tt)*) => { $crate::output::report_detail(format_args!($($argument)*)) };
}

/// How much goes to standard error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
pub enum Detail {
    /// Errors alone.
    Quiet,
    /// Progress and remarks, too.
    Usual,
    /// Also what else is done, as the files that are read and written.
    Verbose,
}

static DETAIL: AtomicU8 = AtomicU8::new(Detail::Usual as u8);

/// Chooses how much goes to standard error from now on.
pub fn choose(detail: Detail) {
    DETAIL.store(detail as u8, Ordering::Relaxed);
}

/// Whether this much goes to standard error.
#[must_use]
pub fn is_shown(detail: Detail) -> bool {
    DETAIL.load(Ordering::Relaxed) >= detail as u8
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
        report_error(format_args!("error: standard output: {error}"));
        exit(1);
    }
}

/// Writes a remark to standard error, unless the command is quiet.
pub fn report(text: Arguments) {
    if is_shown(Detail::Usual) {
        report_error(text);
    }
}

/// Writes a remark to standard error, if the command is to say more.
pub fn report_detail(text: Arguments) {
    if is_shown(Detail::Verbose) {
        report_error(text);
    }
}

/// Writes lines to standard error, also those of a quiet command: on a terminal wrapped between words, into a pipe as they are.
pub fn report_error(text: Arguments) {
    let error = io::stderr();
    let width = error.is_terminal().then(width);
    let mut error = error.lock();
    for line in text.to_string().lines() {
        let line = shortened(line);
        let line = width.map_or_else(|| line.clone(), |width| wrapped(&line, width, 4).join("\n"));
        let _ = writeln!(error, "{line}");
    }
}

/// Columns of the terminal behind standard error.
#[must_use]
pub fn width() -> usize {
    let columns = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let columns = columns.or_else(|| Some(console::Term::stderr().size_checked()?.1.into()));
    columns.filter(|columns| *columns >= 20).unwrap_or(USUAL_WIDTH)
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

/// Opens a file to read it.
///
/// # Errors
/// If it cannot be opened, with its name.
pub fn open(file: &Path) -> anyhow::Result<File> {
    let opened = File::open(file).with_context(|| file.display().to_string())?;
    detail!("read {}", file.display());
    Ok(opened)
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
