//! Flash and RAM of the linked file, by crate.

use std::collections::BTreeMap;

use anyhow::{Context, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

use super::lines::{Lines, OTHER};
use super::memory;
use crate::elf;

/// What core, loop and drivers may take of the flash.
const FLASH_BAR: u64 = 32 * 1024;
/// The crates that they are.
const CORE: [&str; 4] = ["sonarfix", "sonarfix-hal", "libm", "nalgebra"];

/// A variable of this many bytes has a row of its own.
const LARGE: u64 = 64;

/// What one crate takes of the flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Flash {
    code: u64,
    constants: u64,
}

/// Prints both tables, and holds core, loop and drivers to the bar.
pub fn check(bytes: &[u8]) -> anyhow::Result<()> {
    let file = object::File::parse(bytes)?;
    print_flash(&file)?;
    print_ram(&file)
}

fn print_flash(file: &object::File) -> anyhow::Result<()> {
    let lines = Lines::read(file)?;
    let mut crates: BTreeMap<String, Flash> = BTreeMap::new();
    let text = file.section_by_name(".text").context("the program has no code")?;
    // Thumb instructions are made of half words. Constants among them count as code.
    for address in (text.address()..text.address() + text.size()).step_by(2) {
        crates.entry(lines.owner(address)).or_default().code += 2;
    }
    for (owner, bytes) in constants(file, &lines)? {
        crates.entry(owner).or_default().constants += bytes;
    }
    let mut rows: Vec<_> = crates.into_iter().collect();
    rows.sort_by_key(|(_, flash)| std::cmp::Reverse(flash.code + flash.constants));
    println!("\n| flash | code | constants |\n|---|---|---|");
    for (name, Flash { code, constants }) in &rows {
        println!("| {name} | {code} | {constants} |");
    }
    let sum = |rows: &[(String, Flash)]| {
        rows.iter().fold(Flash::default(), |sum, (_, flash)| Flash {
            code: sum.code + flash.code,
            constants: sum.constants + flash.constants,
        })
    };
    let all = sum(&rows);
    println!("| **all** | **{}** | **{}** |", all.code, all.constants);
    rows.retain(|(name, _)| CORE.contains(&name.as_str()));
    let core = sum(&rows);
    println!("| **core, loop and drivers** | **{}** | **{}** |", core.code, core.constants);
    let core = core.code + core.constants;
    println!("\nFlash: core, loop and drivers take {core} of {FLASH_BAR}");
    ensure!(core <= FLASH_BAR, "core, loop and drivers take more flash than they may");
    Ok(())
}

/// The constants, by crate: each belongs to the code that names it, or to the constant that does.
fn constants(file: &object::File, lines: &Lines) -> anyhow::Result<Vec<(String, u64)>> {
    let section = file.section_by_name(".rodata").context("the program has no constants")?;
    let objects = objects(file, &section);
    let around = |address: u64| {
        let (&start, &bytes) = objects.range(..=address).next_back()?;
        (address < start + bytes).then_some(start)
    };
    let mut owners: BTreeMap<u64, String> = BTreeMap::new();
    for (place, target) in elf::mentions(file, SectionKind::Text)? {
        if let Some(object) = around(target) {
            owners.entry(object).or_insert_with(|| lines.owner(place));
        }
    }
    let lists = elf::mentions(file, SectionKind::ReadOnlyData)?;
    // A constant that is named by one that is named by …: as often as it takes.
    loop {
        let known = owners.len();
        for &(place, target) in &lists {
            let owner = around(place).and_then(|object| owners.get(&object)).cloned();
            if let (Some(owner), Some(object)) = (owner, around(target)) {
                owners.entry(object).or_insert(owner);
            }
        }
        if owners.len() == known {
            break;
        }
    }
    let mut rest = section.size();
    let mut constants = Vec::new();
    for (object, bytes) in &objects {
        if let Some(owner) = owners.remove(object) {
            constants.push((owner, *bytes));
            rest -= bytes;
        }
    }
    constants.push((OTHER.to_owned(), rest));
    Ok(constants)
}

/// What lies in a section: addresses and bytes. Of two that overlap, the first counts.
fn objects(file: &object::File, section: &object::Section) -> BTreeMap<u64, u64> {
    let range = section.address()..section.address() + section.size();
    let is_there = |symbol: &object::Symbol| {
        symbol.kind() == SymbolKind::Data && range.contains(&symbol.address()) && symbol.size() > 0
    };
    let mut all: BTreeMap<u64, u64> = BTreeMap::new();
    for symbol in file.symbols().filter(is_there) {
        let bytes = all.entry(symbol.address()).or_default();
        *bytes = symbol.size().max(*bytes);
    }
    let mut end = 0;
    all.retain(|&start, bytes| {
        let is_next = start >= end;
        end = end.max(start + *bytes);
        is_next
    });
    all
}

fn print_ram(file: &object::File) -> anyhow::Result<()> {
    let mut rows = Vec::new();
    let mut all = 0;
    for section in memory::variables_of(file) {
        all += section.size();
        for (at, bytes) in objects(file, &section) {
            let symbol = file.symbols().find(|s| s.address() == at && s.size() == bytes);
            rows.push((elf::name(&symbol.context("a variable without a name")?)?, bytes));
        }
    }
    rows.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    println!("\n| variable | of | bytes |\n|---|---|---|");
    let mut rest = all;
    for (path, bytes) in rows.iter().filter(|(_, bytes)| *bytes >= LARGE) {
        let (owner, name) = path.split_once("::").unwrap_or((OTHER, path));
        let name = name.rsplit("::").next().unwrap_or(name);
        let name = name.trim_start_matches("__rtic_internal_");
        println!("| `{name}` | {} | {bytes} |", owner.replace('_', "-"));
        rest -= bytes;
    }
    println!("| smaller ones | | {rest} |");
    println!("| **all variables** | | **{all}** |");
    Ok(())
}
