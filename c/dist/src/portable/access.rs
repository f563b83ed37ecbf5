//! Which accesses to memory are aligned. wasm2c does not tell; the module's code does.

use std::collections::VecDeque;

use anyhow::{Context, Result, bail};
use regex::Regex;

/// The loads and stores of a module, in its order.
#[derive(Debug)]
pub struct Accesses(VecDeque<Access>);

#[derive(Debug)]
struct Access {
    /// As in C: `i32_load8_u`.
    instruction: String,
    offset: u32,
    is_aligned: bool,
}

impl Accesses {
    /// Reads what `wasm-objdump --disassemble` prints.
    ///
    /// # Errors
    /// If a line of it cannot be read.
    pub fn parse(disassembly: &str) -> Result<Self> {
        let line = Regex::new(r"\| *([if]\d\d\.(?:load|store)\w*) (\d) (\d+)$")?;
        let accesses = disassembly.lines().filter_map(|text| line.captures(text));
        accesses
            .map(|found| {
                let instruction = found[1].replace('.', "_");
                let exponent: u32 = found[2].parse()?;
                let is_aligned = exponent >= least_exponent(&instruction);
                Ok(Access { instruction, offset: found[3].parse()?, is_aligned })
            })
            .collect::<Result<_>>()
            .map(Self)
    }

    /// Whether the next access, which is this one in C, is aligned.
    ///
    /// # Errors
    /// If the next access is another one: the source is not of this module.
    pub fn next_is_aligned(&mut self, instruction: &str, offset: u32) -> Result<bool> {
        let next = self.0.pop_front().context("the source has more accesses than the module")?;
        if next.instruction != instruction || next.offset != offset {
            bail!("{instruction} at {offset} in the source is {next:?} in the module");
        }
        Ok(next.is_aligned)
    }

    /// Whether all accesses have been asked for.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// The power of two to which an access must be aligned: its size, but at most a word of four bytes.
fn least_exponent(instruction: &str) -> u32 {
    match instruction.split_once("_load").or_else(|| instruction.split_once("_store")) {
        Some((_, size)) if size.starts_with('8') => 0,
        Some((_, size)) if size.starts_with("16") => 1,
        _ => 2,
    }
}
