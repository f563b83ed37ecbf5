//! The shipped firmware: that it cannot panic through our code, that it boots and obeys, how
//! large it is.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use addr2line::gimli;
use anyhow::{Context, bail, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

use crate::cargo;
use crate::elf::{self, Program};

const TARGET: &str = "thumbv7em-none-eabihf";
const NAME: &str = "sonarfix-stm32f405";
/// Where a call that ends in a panic leads.
const PANIC: &str = "core::panicking";
/// What core, loop and drivers may take of the flash.
const FLASH_BAR: u64 = 32 * 1024;
/// The crates that they are.
const CORE: [&str; 3] = ["sonarfix", "sonarfix_hal", "libm"];

/// Builds the firmware, checks the linked file, and runs it in an emulator.
pub fn test() -> anyhow::Result<()> {
    let program = build()?;
    check_panics(&program)?;
    let tests = "test --package sonarfix-app --test emulated -- --ignored --nocapture";
    let mut command = cargo::command(tests);
    command.env("SONARFIX_FIRMWARE", &program);
    cargo::check(command)
}

/// Flash and RAM of the linked file.
pub fn size() -> anyhow::Result<()> {
    let program = build()?;
    let bytes = std::fs::read(&program).with_context(|| program.display().to_string())?;
    let file = object::File::parse(&*bytes)?;
    let mut crates: BTreeMap<String, u64> = BTreeMap::new();
    for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text) {
        let name = format!("{:#}", rustc_demangle::demangle(symbol.name()?));
        *crates.entry(owner(&name)).or_default() += symbol.size();
    }
    let core: u64 = CORE.iter().filter_map(|name| crates.get(*name)).sum();
    let mut rows: Vec<_> = crates.into_iter().collect();
    rows.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    println!("| code of | bytes |\n|---|---|");
    for (name, bytes) in rows {
        println!("| `{name}` | {bytes} |");
    }
    println!("\n| section | bytes |\n|---|---|");
    let kinds = [SectionKind::Text, SectionKind::ReadOnlyData, SectionKind::Data];
    let kept = |kind| kinds.contains(&kind) || kind == SectionKind::UninitializedData;
    for section in file.sections().filter(|section| section.size() > 0 && kept(section.kind())) {
        if section.address() > 0 {
            println!("| `{}` | {} |", section.name()?, section.size());
        }
    }
    ensure!(core <= FLASH_BAR, "core, loop and drivers take {core} bytes of {FLASH_BAR}");
    println!("\ncore, loop and drivers: {core} bytes");
    Ok(())
}

/// The crate that a function belongs to; a method of a trait, to the type that has it.
fn owner(name: &str) -> String {
    let name = name.trim_start_matches(['<', '&', '(']).trim_start_matches("mut ");
    let end = name.find("::").unwrap_or(name.len());
    let first = name.get(..end).unwrap_or(name);
    let is_path = end < name.len() && !first.is_empty();
    if is_path { first.to_owned() } else { "(no path)".to_owned() }
}

/// Builds the firmware; gives the linked file.
fn build() -> anyhow::Result<PathBuf> {
    let found = Command::new("flip-link").arg("--version").output();
    ensure!(
        found.is_ok(),
        "flip-link is missing: install it with `cargo install flip-link --locked`"
    );
    let mut command = cargo::command("build --release");
    let target = target();
    command.current_dir(cargo::root().join("firmware")).env_remove("RUSTFLAGS");
    command.env("CARGO_TARGET_DIR", &target);
    cargo::check(command)?;
    Ok(target.join(TARGET).join("release").join(NAME))
}

/// Where the workspace `firmware` is built.
fn target() -> PathBuf {
    let ours = std::env::var_os("CARGO_TARGET_DIR");
    ours.map_or_else(|| cargo::root().join("target"), PathBuf::from).join("firmware")
}

/// No line of ours panics. Lines of other people's crates that do are counted by crate.
fn check_panics(program: &Path) -> anyhow::Result<()> {
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
