//! Flash and RAM of the linked file, by crate.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use anyhow::{Context, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

use super::lines::{Lines, OTHER};
use super::memory;
use crate::elf;

/// Largest flash size of core, loop and drivers with everything linked, bytes. A commit that raises it says what a user gets
/// for it.
const FLASH_BAR: u64 = 96 * 1024;
/// Their crates.
const CORE: [&str; 5] = ["sonarfix", "sonarfix-search", "sonarfix-hal", "libm", "nalgebra"];
/// Smallest size of a crate or a variable with its own row, bytes.
const LARGE_CRATE: u64 = 500;
const LARGE_VARIABLE: u64 = 64;

/// Size in flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Flash {
    code: u64,
    constants: u64,
}

impl Flash {
    fn bytes(self) -> u64 {
        self.code + self.constants
    }

    fn sum<'a>(all: impl IntoIterator<Item = &'a (String, Self)>) -> Self {
        all.into_iter().fold(Self::default(), |sum, (_, flash)| Self {
            code: sum.code + flash.code,
            constants: sum.constants + flash.constants,
        })
    }
}

/// Prints both tables, and checks the size of core, loop and drivers.
pub fn check(bytes: &[u8]) -> anyhow::Result<()> {
    println!("\n{}", tables(bytes)?);
    let (core, _) = by_crate(&object::File::parse(bytes)?)?;
    let bytes = Flash::sum(&core).bytes();
    ensure!(bytes <= FLASH_BAR, "core, loop and drivers exceed their limit of flash");
    Ok(())
}

/// Flash by crate, and variables.
pub fn tables(bytes: &[u8]) -> anyhow::Result<String> {
    let file = object::File::parse(bytes)?;
    Ok(format!("{}\n{}", flash(&file)?, ram(&file)?))
}

fn flash(file: &object::File) -> anyhow::Result<String> {
    let (core, others) = by_crate(file)?;
    let mut text = "| flash | code | constants |\n|---|---|---|\n".to_owned();
    let mut row = |name: &str, Flash { code, constants }| {
        // Writing to a string does not fail, here and below.
        let _ = writeln!(text, "| {name} | {code} | {constants} |");
    };
    for (name, flash) in &core {
        row(name, *flash);
    }
    let sum = Flash::sum(&core);
    let bytes = sum.bytes();
    row(&format!("**core, loop and drivers: {bytes}** (bar: {FLASH_BAR})"), sum);
    let (large, small): (Vec<_>, Vec<_>) =
        others.into_iter().partition(|(_, flash)| flash.bytes() >= LARGE_CRATE);
    for (name, flash) in &large {
        row(name, *flash);
    }
    row(&format!("{} smaller crates", small.len()), Flash::sum(&small));
    let size = |name| file.section_by_name(name).map_or(0, |section| section.size());
    let rest = Flash { code: 0, constants: size(".vector_table") + size(".data") };
    row("interrupt vectors, first values of variables", rest);
    let mut all = Flash::sum(core.iter().chain(&large).chain(&small));
    all.constants += rest.constants;
    row("**all**", all);
    Ok(text)
}

/// Crates by their size in flash, largest first.
type Crates = Vec<(String, Flash)>;

/// The crates of core, loop and drivers, and the others.
fn by_crate(file: &object::File) -> anyhow::Result<(Crates, Crates)> {
    let lines = Lines::read(file)?;
    let mut crates: BTreeMap<String, Flash> = BTreeMap::new();
    let text = file.section_by_name(".text").context("the program has no code")?;
    // Thumb instructions consist of half words. Constants between them count as code.
    for address in (text.address()..text.address() + text.size()).step_by(2) {
        crates.entry(lines.owner(address)).or_default().code += 2;
    }
    for (owner, bytes) in constants(file, &lines)? {
        crates.entry(owner).or_default().constants += bytes;
    }
    let mut crates: Crates = crates.into_iter().collect();
    crates.sort_by_key(|(_, flash)| std::cmp::Reverse(flash.bytes()));
    Ok(crates.into_iter().partition(|(name, _)| CORE.contains(&name.as_str())))
}

/// The constants by crate. Each belongs to the code or to the constant that refers to it.
fn constants(file: &object::File, lines: &Lines) -> anyhow::Result<Vec<(String, u64)>> {
    let section = file.section_by_name(".rodata").context("the program has no constants")?;
    let objects = objects(file, &section);
    let around = |address: u64| {
        let (&start, &bytes) = objects.range(..=address).next_back()?;
        (address < start + bytes).then_some(start)
    };
    let mut owners: BTreeMap<u64, String> = BTreeMap::new();
    for (place, target) in elf::mentions(file, true)? {
        if let Some(object) = around(target) {
            owners.entry(object).or_insert_with(|| lines.owner(place));
        }
    }
    let lists = elf::mentions(file, false)?;
    // Constants that are referred to by constants, transitively.
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

/// The objects in a section: addresses and bytes. Of two that overlap, the first counts.
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

fn ram(file: &object::File) -> anyhow::Result<String> {
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
    let mut text = "| variable in RAM | of | bytes |\n|---|---|---|\n".to_owned();
    let mut rest = all;
    for (path, bytes) in rows.iter().filter(|(_, bytes)| *bytes >= LARGE_VARIABLE) {
        let (owner, name) = path.split_once("::").unwrap_or((OTHER, path));
        let name = name.rsplit("::").next().unwrap_or(name);
        // RTIC's prefixes of the names of a task's resources.
        let rtic = ["__rtic_internal_local_resource_", "__rtic_internal_local_init_"];
        let name = rtic.iter().find_map(|prefix| name.strip_prefix(prefix)).unwrap_or(name);
        let _ = writeln!(text, "| `{name}` | {} | {bytes} |", owner.replace('_', "-"));
        rest -= bytes;
    }
    let _ = writeln!(text, "| smaller ones | | {rest} |");
    let _ = writeln!(text, "| **all variables** | | **{all}** |");
    Ok(text)
}
