//! The stack that a function of the portable source needs beside that of C.

use std::collections::{HashMap, HashSet};

use anyhow::{Context, Result, ensure};
use regex::Regex;

use super::module::Function;

/// The bytes that each function needs, with those that it calls. Nothing is called through a pointer, so that the calls are all known.
#[derive(Debug)]
pub struct Stacks<'m> {
    functions: HashMap<&'m str, (u32, Vec<&'m str>)>,
}

impl<'m> Stacks<'m> {
    /// Reads frames and calls of the functions.
    ///
    /// # Errors
    /// If a function takes a frame in an unknown way.
    pub fn new(functions: &'m [Function]) -> Result<Self> {
        let call = Regex::new(r"\b(w2c_\w+)\(instance")?;
        let read = |function: &'m Function| {
            let lines = function.body.iter();
            let called = lines.flat_map(|line| call.captures_iter(line));
            let called = called.filter_map(|found| found.get(1)).map(|name| name.as_str());
            Ok((function.name.as_str(), (frame(function)?, called.collect())))
        };
        Ok(Self { functions: functions.iter().map(read).collect::<Result<_>>()? })
    }

    /// The bytes that a function needs.
    ///
    /// # Errors
    /// If it is not in the module, or if it calls itself, directly or not.
    pub fn of(&self, name: &str) -> Result<u32> {
        self.below(name, self.functions.len())
    }

    /// The functions that these functions call, directly or not, and themselves.
    pub fn reached<'n>(&self, from: impl Iterator<Item = &'n str>) -> HashSet<&'m str> {
        let mut reached = HashSet::new();
        let mut left: Vec<&str> =
            from.filter_map(|name| Some(*self.functions.get_key_value(name)?.0)).collect();
        while let Some(name) = left.pop() {
            if reached.insert(name) {
                left.extend(self.functions.get(name).iter().flat_map(|(_, called)| called));
            }
        }
        reached
    }

    fn below(&self, name: &str, levels: usize) -> Result<u32> {
        let (frame, called) = self.functions.get(name).with_context(|| format!("no {name}"))?;
        ensure!(levels > 0, "{name} calls itself");
        let mut deepest = 0;
        for called in called {
            deepest = deepest.max(self.below(called, levels - 1)?);
        }
        Ok(frame + deepest)
    }
}

/// The bytes by which a function moves the stack pointer: its first four statements, if it does.
fn frame(function: &Function) -> Result<u32> {
    let pointer = "w2c_i0 = instance->w2c___stack_pointer;";
    let mut lines = function.body.iter().map(|line| line.trim());
    if !lines.any(|line| line == pointer) {
        return Ok(0);
    }
    let size = lines.next().and_then(|line| line.strip_prefix("w2c_i1 = ")?.strip_suffix("u;"));
    let size = size.with_context(|| format!("{} has an unknown frame", function.name))?;
    let subtracts = lines.next() == Some("w2c_i0 -= w2c_i1;");
    ensure!(subtracts, "{} has an unknown frame", function.name);
    Ok(size.parse()?)
}
