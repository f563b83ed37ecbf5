//! Reads the call graph of a linked program, the size of each function, and its use of the stack.
//!
//! The programs are linked with `--emit-relocs`, so that every reference to a function or a constant is still listed, in a call
//! or as an address. The code of a set of functions is everything that can be reached from it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::Path;

use anyhow::{Context, ensure};
use object::elf::{
    R_ARM_ABS32, R_ARM_THM_JUMP19, R_ARM_THM_JUMP24, R_ARM_THM_MOVW_ABS_NC, R_ARM_THM_PC22,
    SHF_ALLOC,
};
use object::{
    Object, ObjectSection, ObjectSymbol, Relocation, RelocationFlags, RelocationTarget, Section,
    SectionFlags, SectionKind, SymbolKind,
};

use crate::thumb::{self, Stack};

/// The functions of a program, and the data that refers to them.
#[derive(Debug, Default)]
pub struct Program {
    /// By address.
    functions: BTreeMap<u64, Function>,
    /// By address: tables of functions, and all other constants and variables.
    data: BTreeMap<u64, BTreeSet<u64>>,
}

#[derive(Debug, Default)]
pub struct Function {
    /// More than one if the linker has merged identical functions.
    pub names: Vec<String>,
    pub bytes: u64,
    pub stack: Stack,
    /// Addresses of the functions that it calls directly.
    pub calls: BTreeSet<u64>,
    /// Addresses of functions and data that it refers to otherwise.
    pub takes: BTreeSet<u64>,
}

/// The functions that can be reached from a set of functions.
#[derive(Debug)]
pub struct Reach<'a> {
    program: &'a Program,
    /// Addresses, each with the predecessor on the path.
    from: BTreeMap<u64, Option<u64>>,
}

impl Program {
    /// Reads a linked program.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let whose = || path.display().to_string();
        let bytes = fs::read(path).with_context(whose)?;
        Self::parse(&bytes).with_context(whose)
    }

    /// Parses the bytes of a linked program.
    pub fn parse(bytes: &[u8]) -> anyhow::Result<Self> {
        let file = object::File::parse(bytes)?;
        let mut program = Self::default();
        for symbol in file.symbols() {
            if symbol.kind() == SymbolKind::Text {
                let function = program.functions.entry(address(symbol.address())).or_default();
                function.bytes = function.bytes.max(symbol.size());
                function.names.push(name(&symbol)?);
            } else if symbol.kind() == SymbolKind::Data {
                program.data.entry(symbol.address()).or_default();
            }
        }
        program.read_code(&file)?;
        let mut relocations = 0;
        for section in file.sections().filter(is_linked) {
            for (place, relocation) in section.relocations() {
                let Some(target) = target(&file, &section, place, &relocation)? else { continue };
                if section.kind() == SectionKind::Text {
                    program.mention(place, target, is_call(&relocation));
                    relocations += 1;
                } else {
                    program.list(place, target);
                }
            }
        }
        ensure!(relocations > 0, "it was linked without `--emit-relocs`");
        Ok(program)
    }

    /// Reads the stack use of each function, and the calls without a relocation: those of a function to itself, which the
    /// assembler resolves. The mapping symbols `$t` and `$d` separate code from data.
    fn read_code(&mut self, file: &object::File) -> anyhow::Result<()> {
        let mut marks: BTreeMap<u64, Option<bool>> = BTreeMap::new();
        for symbol in file.symbols() {
            match symbol.name()? {
                "$t" => _ = marks.insert(symbol.address(), Some(true)),
                "$d" => _ = marks.insert(symbol.address(), Some(false)),
                _ => {}
            }
        }
        let functions: BTreeSet<u64> = self.functions.keys().copied().collect();
        for &start in &functions {
            marks.entry(start).or_default();
        }
        for section in file.sections().filter(|section| section.kind() == SectionKind::Text) {
            let (start, code) = (section.address(), section.data()?);
            let end = start + section.size();
            let mut is_code = true;
            let starts: Vec<_> = marks.range(start..end).collect();
            for (n, &(&from, mark)) in starts.iter().enumerate() {
                is_code = mark.unwrap_or(is_code);
                let to = starts.get(n + 1).map_or(end, |&(&next, _)| next);
                let offset = |at: u64| usize::try_from(at.wrapping_sub(start));
                let stretch = code.get(offset(from)?..offset(to)?).unwrap_or_default();
                if let Some((_, function)) = self.functions.range_mut(..=from).next_back()
                    && is_code
                {
                    let word = |at| {
                        let bytes = code.get(offset(at).ok()?..)?.first_chunk()?;
                        Some(u32::from_le_bytes(*bytes))
                    };
                    function.stack = function.stack.and(Stack::of(stretch, from, word));
                    let calls = thumb::calls(stretch, from);
                    function.calls.extend(calls.filter(|to| functions.contains(to)));
                }
            }
        }
        Ok(())
    }

    /// Records a reference from the function around `place` to `target`.
    fn mention(&mut self, place: u64, target: u64, is_call: bool) {
        if let Some((_, function)) = self.functions.range_mut(..=place).next_back() {
            let mentions = if is_call { &mut function.calls } else { &mut function.takes };
            mentions.insert(target);
        }
    }

    /// Records a reference from the data around `place` to `target`.
    fn list(&mut self, place: u64, target: u64) {
        if let Some((_, names)) = self.data.range_mut(..=place).next_back() {
            names.insert(target);
        }
    }

    /// The function at an address.
    pub fn function(&self, at: u64) -> Option<&Function> {
        self.functions.get(&at)
    }

    /// All functions, by address.
    pub fn functions(&self) -> impl Iterator<Item = (u64, &Function)> {
        self.functions.iter().map(|(&at, function)| (at, function))
    }

    /// Address of the function with this name.
    pub fn address_of(&self, name: &str) -> Option<u64> {
        self.functions().find(|(_, f)| f.names.iter().any(|n| n == name)).map(|(at, _)| at)
    }

    /// The functions that can be called through this address: the one at it, or those in the data around it, or in data
    /// that this data refers to.
    pub fn callable_through(&self, address: u64) -> BTreeSet<u64> {
        let mut seen = BTreeSet::from([address]);
        let mut next = vec![address];
        while let Some(at) = next.pop() {
            if self.functions.contains_key(&at) {
                continue;
            }
            let data = self.data.range(..=at).next_back();
            let listed = data.into_iter().flat_map(|(_, listed)| listed).copied();
            next.extend(listed.filter(|&listed| seen.insert(listed)));
        }
        seen.retain(|at| self.functions.contains_key(at));
        seen
    }

    /// All functions that can be reached from those with these names.
    pub fn reach(&self, roots: &[&str]) -> anyhow::Result<Reach<'_>> {
        let names = roots;
        let is_root = |f: &Function| f.names.iter().any(|n| names.contains(&n.as_str()));
        let roots = self.functions.iter().filter(|(_, function)| is_root(function));
        let mut from: BTreeMap<_, _> = roots.map(|(&root, _)| (root, None)).collect();
        ensure!(!from.is_empty(), "no function has one of the names {names:?}");
        let mut next: VecDeque<u64> = from.keys().copied().collect();
        while let Some(at) = next.pop_front() {
            for mention in self.mentions(at) {
                from.entry(mention).or_insert_with(|| {
                    next.push_back(mention);
                    Some(at)
                });
            }
        }
        Ok(Reach { program: self, from })
    }

    /// The functions that the one at `at` refers to.
    fn mentions(&self, at: u64) -> impl Iterator<Item = u64> {
        let function = self.functions.get(&at);
        let named = function.into_iter().flat_map(|f| f.calls.iter().chain(&f.takes)).copied();
        named.filter(|named| self.functions.contains_key(named))
    }

    /// Names of the functions that refer to one whose name contains `part`.
    pub fn callers_of(&self, part: &str) -> impl Iterator<Item = &str> {
        let is_it = |function: &Function| function.names.iter().any(|name| name.contains(part));
        let wanted: BTreeSet<u64> =
            self.functions.iter().filter(|(_, f)| is_it(f)).map(|(&at, _)| at).collect();
        let names_it = move |at: u64| self.mentions(at).any(|named| wanted.contains(&named));
        let callers = self.functions().filter(move |&(at, _)| names_it(at));
        callers.flat_map(|(_, function)| &function.names).map(String::as_str)
    }

    /// Names of all functions.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.functions.values().flat_map(|function| &function.names).map(String::as_str)
    }
}

#[cfg(test)]
impl Program {
    /// A program of these functions and data.
    pub fn made_of(functions: Vec<(u64, Function)>, data: Vec<(u64, Vec<u64>)>) -> Self {
        let data = data.into_iter().map(|(at, listed)| (at, listed.into_iter().collect()));
        Self { functions: functions.into_iter().collect(), data: data.collect() }
    }
}

impl Function {
    /// The first of its names.
    pub fn name(&self) -> &str {
        self.names.first().map_or("(no name)", String::as_str)
    }
}

impl Reach<'_> {
    /// Bytes of the functions.
    pub fn bytes(&self) -> u64 {
        self.from.keys().filter_map(|at| self.program.functions.get(at)).map(|f| f.bytes).sum()
    }

    /// The path to a function, `a → b → c`, if it can be reached.
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

/// Every reference in code or in data, with its target.
pub fn mentions(file: &object::File, in_code: bool) -> anyhow::Result<Vec<(u64, u64)>> {
    let mut mentions = Vec::new();
    let is_asked = |section: &Section| (section.kind() == SectionKind::Text) == in_code;
    for section in file.sections().filter(is_linked).filter(is_asked) {
        for (place, relocation) in section.relocations() {
            let target = target(file, &section, place, &relocation)?;
            mentions.extend(target.map(|target| (place, target)));
        }
    }
    Ok(mentions)
}

/// Whether a section is loaded: part of the program, not debug information.
fn is_linked(section: &Section) -> bool {
    let SectionFlags::Elf { sh_flags } = section.flags() else { return false };
    sh_flags & u64::from(SHF_ALLOC) != 0
}

/// The target of a relocation: a function, or a place in data.
fn target(
    file: &object::File,
    section: &Section,
    place: u64,
    relocation: &Relocation,
) -> anyhow::Result<Option<u64>> {
    let RelocationTarget::Symbol(target) = relocation.target() else { return Ok(None) };
    let symbol = file.symbol_by_index(target)?;
    let RelocationFlags::Elf { r_type } = relocation.flags() else { return Ok(None) };
    let word = || -> anyhow::Result<u64> {
        let bytes = section.data_range(place, 4)?.and_then(|bytes| bytes.first_chunk());
        Ok(u32::from_le_bytes(*bytes.context("a relocation of nothing")?).into())
    };
    let found = match symbol.kind() {
        SymbolKind::Text | SymbolKind::Data => Some(symbol.address()),
        // A target without a symbol is given by its section; the linked word contains the offset.
        SymbolKind::Section if r_type == R_ARM_ABS32 => Some(word()?),
        SymbolKind::Section if r_type == R_ARM_THM_MOVW_ABS_NC => {
            let low = u64::from(thumb::moved(word()?));
            let from = symbol.address();
            Some(from + (low.wrapping_sub(from) & 0xffff))
        }
        _ => None,
    };
    let named = symbol.section_index().map(|index| file.section_by_index(index)).transpose()?;
    let is_code = named.is_some_and(|section| section.kind() == SectionKind::Text);
    Ok(found.map(|found| if is_code { address(found) } else { found }))
}

/// Whether a relocation belongs to a call or a branch.
fn is_call(relocation: &Relocation) -> bool {
    let RelocationFlags::Elf { r_type } = relocation.flags() else { return false };
    [R_ARM_THM_PC22, R_ARM_THM_JUMP19, R_ARM_THM_JUMP24].contains(&r_type)
}

/// The demangled name of a symbol.
pub fn name<'a>(symbol: &impl ObjectSymbol<'a>) -> anyhow::Result<String> {
    Ok(format!("{:#}", rustc_demangle::demangle(symbol.name()?)))
}

/// The lowest bit of a function's address marks Thumb code.
fn address(value: u64) -> u64 {
    value & !1
}
