//! The firmware of the further boards, whose chips QEMU does not emulate: it is linted, built, measured and searched for
//! panics. The table of all boards in the docs is that of this command.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use object::{Object, ObjectSection, SectionKind};

use super::{build, memory, panics, stack};
use crate::workspace::Workspace;
use crate::{board_page, cargo};
use sonarfix_boards::Board;

/// Largest difference between a figure of the docs and the measured one, as a part of it: flash contains source paths, whose
/// length depends on the checkout.
const TOLERANCE: f64 = 0.05;

/// The page with the table, and the start of the table's header.
const PAGE: &str = "docs/firmware.md";
const HEADER: &str = "| board | flash, bytes |";

/// What is done with the table.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Write the table into docs/firmware.md instead of comparing it.
    #[arg(long)]
    write: bool,
}

impl Args {
    /// Compare.
    pub const COMPARE: Self = Self { write: false };
}

/// Lints and builds the firmware of each further board, and checks the linked files; prints the table of all boards and
/// compares it with that of the docs.
pub fn check(reference: &[u8], args: &Args) -> anyhow::Result<()> {
    let firmware = Workspace::Firmware;
    let mut rows = Vec::new();
    for board in &sonarfix_boards::all()? {
        if board.package == build::NAME {
            rows.push(row(board, reference)?);
            continue;
        }
        let package = format!("--release --package {} --target {}", board.package, board.target);
        cargo::check(firmware.cargo(&format!("clippy {package} -- -D warnings")))?;
        let program = build::read(&build::of(board)?)?;
        panics::others(&program)?;
        rows.push(row(board, &program)?);
    }
    let table = format!(
        "{HEADER} variables in RAM, bytes | stack at most, bytes | lines of its own: code, comments | of its build files | shown by |\n\
         |---|---|---|---|---|---|---|\n{}\n",
        rows.join("\n")
    );
    println!("\n{table}");
    let page = cargo::root().join(PAGE);
    let text = fs::read_to_string(&page)?;
    let written = in_page(&text).context("docs/firmware.md has no table of boards")?;
    if args.write {
        fs::write(&page, text.replace(written, &table))?;
        return Ok(());
    }
    ensure!(
        are_alike(written, &table),
        "the table in {PAGE} differs by more than {:.0} %: run `cargo xtask boards --write`",
        100.0 * TOLERANCE
    );
    Ok(())
}

/// The table in the page.
fn in_page(text: &str) -> Option<&str> {
    let (before, rest) = text.split_once(HEADER)?;
    let length = rest.find("\n\n")? + 1;
    text.get(before.len()..before.len() + HEADER.len() + length)
}

/// Whether two tables differ by nothing but small differences of numbers.
fn are_alike(one: &str, other: &str) -> bool {
    let words = |text: &str| -> Vec<String> {
        text.split([' ', ',', '\n']).filter(|word| !word.is_empty()).map(str::to_owned).collect()
    };
    let is_alike = |(one, other): (&String, &String)| match (one.parse(), other.parse()) {
        (Ok(one), Ok(other)) => f64::abs(one - other) <= TOLERANCE * f64::max(one, other),
        _ => one == other,
    };
    let (one, other) = (words(one), words(other));
    one.len() == other.len() && one.iter().zip(&other).all(is_alike)
}

fn row(board: &Board, program: &[u8]) -> anyhow::Result<String> {
    let file = object::File::parse(program)?;
    let in_flash =
        |kind| matches!(kind, SectionKind::Text | SectionKind::ReadOnlyData | SectionKind::Data);
    let allocated = file.sections().filter(|section| section.address() > 0);
    let flash: u64 = allocated.filter(|s| in_flash(s.kind())).map(|section| section.size()).sum();
    let variables: u64 = memory::variables_of(&file).map(|section| section.size()).sum();
    let stack = if board.target.starts_with("thumb") {
        stack::bound(program)?.to_string()
    } else {
        let region = file.section_by_name(".stack").map_or(0, |section| section.size());
        format!("not bounded; has {region}")
    };
    let (own, build) = (lines_of(board)?, lines_of_build(board)?);
    let shown = if board_page::is_emulated(&board.name) {
        "building and emulation"
    } else {
        "building only"
    };
    Ok(format!(
        "| {} | {flash} | {variables} | {stack} | {}, {} | {build} | {shown} |",
        board.title, own.0, own.1
    ))
}

fn folder(board: &Board) -> PathBuf {
    Workspace::Firmware.folder().join(board.package.trim_start_matches("sonarfix-"))
}

/// Lines of code and of comments below the board's `src`.
fn lines_of(board: &Board) -> anyhow::Result<(usize, usize)> {
    let (mut code, mut comments) = (0, 0);
    // A board that takes the source of another has no folder for it.
    for entry in fs::read_dir(folder(board).join("src")).into_iter().flatten() {
        let lines = lines(&entry?.path())?;
        code += lines.0;
        comments += lines.1;
    }
    Ok((code, comments))
}

/// Lines of code of the files beside it.
fn lines_of_build(board: &Board) -> anyhow::Result<usize> {
    let beside = ["Cargo.toml", "build.rs", "partitions.csv"].map(|name| folder(board).join(name));
    let mut build = 0;
    for file in beside.into_iter().chain([cargo::root().join(&board.memory)]) {
        if file.exists() {
            build += lines(&file)?.0;
        }
    }
    Ok(build)
}

/// Lines of code and of comments in a file: Rust, TOML, a linker script, or the language of state machines.
fn lines(file: &Path) -> anyhow::Result<(usize, usize)> {
    let text = fs::read_to_string(file)?;
    let (mut code, mut comments) = (0, 0);
    let mut is_inside = false;
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let is_block = line.starts_with("/*");
        let is_comment = is_inside
            || is_block
            || line.starts_with("//")
            || line.starts_with(';')
            || (line.starts_with('#') && !line.starts_with("#[") && !line.starts_with("#!["));
        is_inside = (is_inside || is_block) && !line.ends_with("*/");
        *(if is_comment { &mut comments } else { &mut code }) += 1;
    }
    Ok((code, comments))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_found_and_small_differences_are_tolerated() {
        let table = format!("{HEADER} x |\n|---|---|\n| Pico | 1000 | 12, 0 | building |\n");
        let page = format!("text\n\n{table}\nmore\n\nmore\n");
        assert_eq!(in_page(&page), Some(table.as_str()));
        assert_eq!(in_page("text"), None);
        assert!(are_alike(&table, &table.replace("1000", "1040")));
        for (from, to) in [("1000", "1100"), ("12, 0", "12, 1"), ("building", "emulation")] {
            assert!(!are_alike(&table, &table.replace(from, to)), "{to}");
        }
    }

    #[test]
    fn comments_of_all_languages_are_not_counted_as_code() {
        let text = "/* two\n   lines */\nA : B\n  /* one */\n#[attribute]\n# toml\n// rust\n\n; pio\nx = 1\n";
        let file = std::env::temp_dir().join(format!("sonarfix-lines-{}", std::process::id()));
        fs::write(&file, text).unwrap();
        let counted = lines(&file);
        fs::remove_file(&file).unwrap();
        assert_eq!(counted.unwrap(), (3, 6));
    }
}
