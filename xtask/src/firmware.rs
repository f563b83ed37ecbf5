//! The shipped firmware: that it cannot panic through our code, that it boots and obeys, how
//! large it is.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use addr2line::gimli;
use anyhow::{Context, bail, ensure};
use object::{Object, ObjectSection};

use crate::cargo;
use crate::elf::{self, Program};
use crate::pico;

const TARGET: &str = "thumbv7em-none-eabihf";
const NAME: &str = "sonarfix-stm32f405";
/// Where a call that ends in a panic leads.
const PANIC: &str = "core::panicking";
/// What core, loop and drivers may take of the flash.
const FLASH_BAR: u64 = 32 * 1024;
/// The crates that they are.
const CORE: [&str; 4] = ["sonarfix", "sonarfix-hal", "libm-0.2.16", "nalgebra-0.35.0"];

/// Builds the firmware, checks the linked file, and runs it in an emulator.
pub fn test() -> anyhow::Result<()> {
    for check in ["fmt --all --check", "clippy --release -- -D warnings"] {
        cargo::check(in_firmware(check))?;
    }
    let program = build()?;
    check_panics(&program)?;
    size()?;
    let tests = "test --package sonarfix-app --test emulated -- --ignored --nocapture";
    let mut command = cargo::command(tests);
    command.env("SONARFIX_FIRMWARE", &program);
    cargo::check(command)?;
    pico::check()
}

/// Flash and RAM of the linked file, by crate: an instruction belongs to the line that it was made
/// from, inlined or not; one of the standard library to whoever called it.
pub fn size() -> anyhow::Result<()> {
    let program = build()?;
    let bytes = std::fs::read(&program).with_context(|| program.display().to_string())?;
    let file = object::File::parse(&*bytes)?;
    let lines = lines(&file)?;
    let text = file.section_by_name(".text").context("the program has no code")?;
    let mut crates: BTreeMap<String, u64> = BTreeMap::new();
    // Thumb instructions are made of half words.
    for address in (text.address()..text.address() + text.size()).step_by(2) {
        let line = line(&lines, address).ok().flatten();
        *crates.entry(line.as_deref().map_or(OTHER, owner).to_owned()).or_default() += 2;
    }
    let core: u64 = CORE.iter().filter_map(|name| crates.get(*name)).sum();
    let mut rows: Vec<_> = crates.into_iter().collect();
    rows.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    println!("| code of | bytes |\n|---|---|");
    for (name, bytes) in rows {
        println!("| {name} | {bytes} |");
    }
    println!("\n| section | bytes |\n|---|---|");
    for section in file.sections().filter(|section| section.address() > 0 && section.size() > 0) {
        println!("| `{}` | {} |", section.name()?, section.size());
    }
    println!("\ncore, loop, drivers: {core} bytes of code, of {FLASH_BAR}");
    ensure!(core <= FLASH_BAR, "core, loop and drivers take more flash than they may");
    Ok(())
}

/// Code of which the debug information knows no line, or only the standard library's.
const OTHER: &str = "(compiler and standard library)";

/// The crate in whose source a line is.
fn owner(line: &str) -> &str {
    let after = |mark: &str, skip: usize| {
        line.split_once(mark).and_then(|(_, path)| path.split('/').nth(skip))
    };
    after("/registry/src/", 1)
        .or_else(|| after("/crates/", 0))
        .or_else(|| after("/firmware/", 0))
        .unwrap_or(OTHER)
}

/// Builds the firmware; gives the linked file.
fn build() -> anyhow::Result<PathBuf> {
    let found = Command::new("flip-link").arg("--version").output();
    ensure!(
        found.is_ok(),
        "flip-link is missing: install it with `cargo install flip-link --locked`"
    );
    cargo::check(in_firmware("build --release"))?;
    Ok(target().join(TARGET).join("release").join(NAME))
}

/// A cargo in the workspace `firmware`, whose own configuration holds what its linker needs.
pub fn in_firmware(arguments: &str) -> Command {
    let mut command = cargo::command(arguments);
    command.current_dir(cargo::root().join("firmware")).env_remove("RUSTFLAGS");
    command.env("CARGO_TARGET_DIR", target());
    command
}

/// Where the workspace `firmware` is built.
pub fn target() -> PathBuf {
    cargo::target_directory().join("firmware")
}

/// No line of ours panics. Lines of other people's crates that do are counted by crate.
pub fn check_panics(program: &Path) -> anyhow::Result<()> {
    let mut theirs: BTreeMap<String, u32> = BTreeMap::new();
    let mut ours = Vec::new();
    for site in panic_sites(program)? {
        match site.split_once("/registry/src/") {
            Some((_, path)) => {
                let name = path.split('/').nth(1).unwrap_or(path);
                *theirs.entry(name.to_owned()).or_default() += 1;
            }
            None => ours.push(site),
        }
    }
    eprintln!("lines that can panic, by crate: {theirs:?}");
    if !ours.is_empty() {
        bail!("these lines of ours can panic:\n  {}", ours.join("\n  "));
    }
    Ok(())
}

/// Where a panic is called from, `file:line` each: the innermost line that is not the standard
/// library's, inlined or not.
fn panic_sites(path: &Path) -> anyhow::Result<Vec<String>> {
    let program = Program::read(path)?;
    let is_core = |name: &&str| name.starts_with("core::");
    let helpers: BTreeSet<&str> = program.callers_of(PANIC).filter(is_core).collect();
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let lines = lines(&object::File::parse(&*bytes)?)?;
    let mut sites = Vec::new();
    for (place, target) in elf::calls(path)? {
        if target.contains(PANIC) || helpers.contains(target.as_str()) {
            sites.extend(line(&lines, place)?);
        }
    }
    Ok(sites)
}

type Section<'a> = gimli::EndianSlice<'a, gimli::LittleEndian>;
type Lines<'a> = addr2line::Context<Section<'a>>;

/// The debug information as it lies in the file: it is linked, whatever relocations are left in it.
fn lines<'a>(file: &object::File<'a>) -> anyhow::Result<Lines<'a>> {
    let dwarf = gimli::Dwarf::load(|id| {
        let section = file.section_by_name(id.name()).and_then(|section| section.data().ok());
        Ok::<_, gimli::Error>(Section::new(section.unwrap_or_default(), gimli::LittleEndian))
    })?;
    Ok(Lines::from_dwarf(dwarf)?)
}

/// The line at an address; none if it is the standard library's own.
fn line(lines: &Lines, address: u64) -> anyhow::Result<Option<String>> {
    let mut frames = lines.find_frames(address).skip_all_loads()?;
    let mut found = 0;
    while let Some(frame) = frames.next()? {
        let Some(location) = frame.location else { continue };
        let file = location.file.unwrap_or_default();
        found += 1;
        if !file.contains("/library/core/") {
            return Ok(Some(format!("{file}:{}", location.line.unwrap_or_default())));
        }
    }
    ensure!(found > 0, "the debug information knows no line at {address:#x}");
    Ok(None)
}
