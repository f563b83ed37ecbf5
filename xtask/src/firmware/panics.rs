//! Which lines can panic: none of ours, and of others' no more than are known.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{bail, ensure};

use super::lines::{self, Lines};
use crate::elf::{self, Program};

/// Where a call that ends in a panic leads.
pub const PANIC: &str = "core::panicking";

/// Lines of other people's crates that can panic, by crate: a crate or a line more fails.
const KNOWN: [(&str, usize); 3] = [("sequential-storage", 41), ("defmt-rtt", 2), ("heapless", 1)];

/// No line of ours panics, and none of others' that is not known to.
pub fn check(program: &[u8]) -> anyhow::Result<()> {
    let mut theirs: BTreeMap<String, usize> = BTreeMap::new();
    let mut ours = Vec::new();
    for site in sites(program)? {
        if site.contains("/registry/src/") {
            *theirs.entry(lines::owner(&site).to_owned()).or_default() += 1;
        } else {
            ours.push(site);
        }
    }
    eprintln!("lines that can panic, by crate: {theirs:?}");
    if !ours.is_empty() {
        bail!("these lines of ours can panic:\n  {}", ours.join("\n  "));
    }
    let known = |name: &str| KNOWN.iter().find(|(k, _)| *k == name).map_or(0, |&(_, lines)| lines);
    for (name, lines) in theirs {
        ensure!(lines <= known(&name), "{lines} lines of {name} can panic, {} known", known(&name));
    }
    Ok(())
}

/// Where a panic is called from, `file:line` each.
fn sites(bytes: &[u8]) -> anyhow::Result<Vec<String>> {
    let program = Program::parse(bytes)?;
    let file = object::File::parse(bytes)?;
    let is_core = |name: &&str| name.starts_with("core::");
    let helpers: BTreeSet<&str> = program.callers_of(PANIC).filter(is_core).collect();
    let panics = |name: &String| name.contains(PANIC) || helpers.contains(name.as_str());
    let lines = Lines::read(&file)?;
    let mut sites = Vec::new();
    for (place, target) in elf::mentions(&file, object::SectionKind::Text)? {
        if program.function(target).is_some_and(|function| function.names.iter().any(panics)) {
            sites.extend(lines.at(place)?);
        }
    }
    Ok(sites)
}
