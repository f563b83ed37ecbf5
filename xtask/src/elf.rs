//! Reads from a linked program which function calls which, and how large each is.
//!
//! The programs of `bench` are linked with `--emit-relocs`: every place that names another function,
//! be it a call or an address, is still listed. What a set of functions needs to run is what can be
//! reached from it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::Path;

use anyhow::{Context, ensure};
use object::{Object, ObjectSection, ObjectSymbol, RelocationTarget, SectionKind, SymbolKind};

/// The functions of a program.
#[derive(Debug, Default)]
pub struct Program {
    /// By address.
    functions: BTreeMap<u64, Function>,
}

#[derive(Debug, Default)]
struct Function {
    /// More than one where functions were found to be the same.
    names: Vec<String>,
    bytes: u64,
    /// Addresses of the functions that it names.
    mentions: BTreeSet<u64>,
}

/// What can be reached from a set of functions.
#[derive(Debug)]
pub struct Reach<'a> {
    program: &'a Program,
    /// Addresses, each with the one that it was reached from.
    from: BTreeMap<u64, Option<u64>>,
}

impl Program {
    /// Reads a linked program.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let whose = || path.display().to_string();
        let bytes = fs::read(path).with_context(whose)?;
        Self::parse(&bytes).with_context(whose)
    }

    fn parse(bytes: &[u8]) -> anyhow::Result<Self> {
        let file = object::File::parse(bytes)?;
        let mut program = Self::default();
        for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text) {
            let name = format!("{:#}", rustc_demangle::demangle(symbol.name()?));
            let function = program.functions.entry(address(symbol.address())).or_default();
            function.bytes = function.bytes.max(symbol.size());
            function.names.push(name);
        }
        let mut relocations = 0;
        for section in file.sections().filter(|section| section.kind() == SectionKind::Text) {
            for (place, relocation) in section.relocations() {
                relocations += 1;
                let RelocationTarget::Symbol(target) = relocation.target() else { continue };
                let target = file.symbol_by_index(target)?;
                if target.kind() == SymbolKind::Text {
                    program.mention(place, address(target.address()));
                }
            }
        }
        ensure!(relocations > 0, "it was linked without `--emit-relocs`");
        Ok(program)
    }

    /// Notes that the function around `place` names the one at `target`.
    fn mention(&mut self, place: u64, target: u64) {
        if let Some((_, function)) = self.functions.range_mut(..=place).next_back() {
            function.mentions.insert(target);
        }
    }

    /// What can be reached from the functions with these names.
    pub fn reach(&self, roots: &[&str]) -> anyhow::Result<Reach<'_>> {
        let names = roots;
        let is_root = |f: &Function| f.names.iter().any(|n| names.contains(&n.as_str()));
        let roots = self.functions.iter().filter(|(_, function)| is_root(function));
        let mut from: BTreeMap<_, _> = roots.map(|(&root, _)| (root, None)).collect();
        ensure!(!from.is_empty(), "no function is called any of {names:?}");
        let mut next: VecDeque<u64> = from.keys().copied().collect();
        while let Some(at) = next.pop_front() {
            for &mention in self.functions.get(&at).into_iter().flat_map(|f| &f.mentions) {
                from.entry(mention).or_insert_with(|| {
                    next.push_back(mention);
                    Some(at)
                });
            }
        }
        Ok(Reach { program: self, from })
    }

    /// Names of the functions that name one whose own name contains `part`.
    pub fn callers_of(&self, part: &str) -> impl Iterator<Item = &str> {
        let is_it = |function: &Function| function.names.iter().any(|name| name.contains(part));
        let wanted: BTreeSet<u64> =
            self.functions.iter().filter(|(_, f)| is_it(f)).map(|(&at, _)| at).collect();
        let callers = self.functions.values().filter(move |f| !f.mentions.is_disjoint(&wanted));
        callers.flat_map(|function| &function.names).map(String::as_str)
    }

    /// Names of all functions.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.functions.values().flat_map(|function| &function.names).map(String::as_str)
    }
}

impl Reach<'_> {
    /// Bytes of the functions.
    pub fn bytes(&self) -> u64 {
        self.from.keys().filter_map(|at| self.program.functions.get(at)).map(|f| f.bytes).sum()
    }

    /// How a function is reached, `a → b → c`, if it is.
    pub fn path_to(&self, name: &str) -> Option<String> {
        let names = |at: u64| self.program.functions.get(&at).map(|function| &function.names);
        let is_it = |at: u64| names(at).is_some_and(|names| names.iter().any(|n| n == name));
        let mut at = Some(self.from.keys().copied().find(|&at| is_it(at))?);
        let mut path = Vec::new();
        while let Some(here) = at {
            path.extend(names(here)?.first().map(String::as_str));
            at = self.from.get(&here).copied().flatten();
        }
        path.reverse();
        Some(path.join(" → "))
    }
}

/// Every place that names a function, with that function's name.
pub fn calls(path: &Path) -> anyhow::Result<Vec<(u64, String)>> {
    let bytes = fs::read(path).with_context(|| path.display().to_string())?;
    let file = object::File::parse(&*bytes)?;
    let mut calls = Vec::new();
    for section in file.sections().filter(|section| section.kind() == SectionKind::Text) {
        for (place, relocation) in section.relocations() {
            let RelocationTarget::Symbol(target) = relocation.target() else { continue };
            let target = file.symbol_by_index(target)?;
            if target.kind() == SymbolKind::Text {
                calls.push((place, format!("{:#}", rustc_demangle::demangle(target.name()?))));
            }
        }
    }
    Ok(calls)
}

/// The lowest bit of a function's address says that it is in Thumb code.
fn address(value: u64) -> u64 {
    value & !1
}
