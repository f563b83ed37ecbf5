//! Finds the source lines that can panic: none of the project, and only known ones of dependencies.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{bail, ensure};

use super::lines::{self, Lines};
use crate::elf::{self, Program};

/// The module of the functions that panic.
pub const PANIC: &str = "core::panicking";

/// Lines of dependencies that can panic: the crate, the function, the number of lines. `docs/firmware.md` explains why none is
/// reached. A change must be reviewed and committed.
const KNOWN: [(&str, &str, usize); 1] = [("defmt-rtt", "panic_fmt", 2)];

/// A line that can panic.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Site {
    /// `file:line`
    line: String,
    /// The panicking function of the standard library.
    how: String,
}

/// Checks that no line of the project can panic, and exactly the known ones of dependencies.
pub fn check(program: &[u8]) -> anyhow::Result<()> {
    let theirs = others(program)?;
    let counts = counts(&theirs);
    ensure!(
        counts == KNOWN,
        "the lines that can panic differ from the known ones:{}",
        listed(&theirs)
    );
    Ok(())
}

/// Checks that no line of the project can panic; prints and returns those of dependencies, counted by crate.
pub fn others(program: &[u8]) -> anyhow::Result<Vec<Site>> {
    let (theirs, ours): (Vec<_>, Vec<_>) =
        sites(program)?.into_iter().partition(|site| site.line.contains("/registry/src/"));
    if !ours.is_empty() {
        bail!("lines of the project can panic:{}", listed(&ours));
    }
    println!("\n| lines that can panic, of | how | |\n|---|---|---|");
    for (name, how, lines) in counts(&theirs) {
        println!("| {name} | `{how}` | {lines} |");
    }
    Ok(theirs)
}

fn counts(sites: &[Site]) -> Vec<(&str, &str, usize)> {
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for Site { line, how } in sites {
        *counts.entry((lines::owner(line), how)).or_default() += 1;
    }
    counts.into_iter().map(|((name, how), lines)| (name, how, lines)).collect()
}

fn listed(sites: &[Site]) -> String {
    sites.iter().fold(String::new(), |text, Site { line, how }| format!("{text}\n  {line}: {how}"))
}

/// The calls of panicking functions.
fn sites(bytes: &[u8]) -> anyhow::Result<BTreeSet<Site>> {
    let program = Program::parse(bytes)?;
    let file = object::File::parse(bytes)?;
    // The code that drops a value is named after `core` and comes from the crate of the value: its own lines are found.
    let is_drop = |name: &&str| name.starts_with("core::ptr::drop_in_place");
    let is_core = |name: &&str| name.starts_with("core::") && !is_drop(name);
    let helpers: BTreeSet<&str> = program.callers_of(PANIC).filter(is_core).collect();
    let panics = |name: &&String| name.contains(PANIC) || helpers.contains(name.as_str());
    let lines = Lines::read(&file)?;
    let mut sites = BTreeSet::new();
    for (place, target) in elf::mentions(&file, true)? {
        let Some(function) = program.function(target) else { continue };
        let Some(name) = function.names.iter().find(panics) else { continue };
        if let Some(line) = lines.at(place)? {
            let how = name.rsplit("::").next().unwrap_or(name).to_owned();
            sites.insert(Site { line, how });
        }
    }
    Ok(sites)
}
