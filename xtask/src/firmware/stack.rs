//! The deepest that the stack can be: of all paths through the calls of the linked program, from
//! its start and from each interrupt.
//!
//! - **Frames** are what a function's instructions lower the stack by.
//! - **Calls** are what the linker had to fill in. A call by register may lead to any function
//!   whose address somebody has taken who can be reached.
//! - **Recursion** is an error.
//! - **Interrupts** are taken to come all at once, one in another, each once, whatever their
//!   priorities, and each on top of a core that saves its floating-point registers.
//! - **Panics** are cut off: nothing runs after one but the message, and the stack below it is
//!   that of a program that has ended. So is a fault's handler.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, bail, ensure};

use super::memory;
use super::panics::PANIC;
use crate::elf::{Function, Program};

/// Where the program starts.
const START: &str = "Reset";
/// Handlers from which nothing goes on.
const ENDS: [&str; 3] = [START, "HardFault", "DefaultHandler"];
/// What the core saves when an interrupt comes: 26 words with the floating-point registers, and one
/// to a multiple of eight bytes (`ARMv7-M Architecture Reference Manual`, B1.5.7).
const EXCEPTION: u64 = 4 * 27;
/// All RAM, without the map, which stays in flash.
const BAR: u64 = 8 * 1024;
/// Printing: its functions are taken by address, for panics' messages, and called by one another
/// only. As long as nobody else calls one of them, none of them is called.
const FORMATTING: &str = "core::fmt::";

/// Prints the deepest paths, and holds the RAM to the bar; gives how deep it is in all.
pub fn check(bytes: &[u8]) -> anyhow::Result<u64> {
    let program = Program::parse(bytes)?;
    let roots = roots(&program, bytes)?;
    let mut depths = Depths::of(&program, &roots)?;
    let mut all = 0;
    println!("\n| stack at its deepest, down from | bytes |\n|---|---|");
    for root in roots {
        let name = depths.name(root);
        let saved = if name == START { 0 } else { EXCEPTION };
        let depth = saved + depths.depth(root)?;
        println!("| **`{name}`** | **{depth}** |");
        if saved > 0 {
            println!("| saved by the core | {saved} |");
        }
        for (name, bytes) in depths.deepest_path(root).into_iter().filter(|(_, bytes)| *bytes > 0) {
            println!("| `{name}` | {bytes} |");
        }
        all += depth;
    }
    let variables = memory::variables(bytes)?;
    println!("| **all stack, one in another** | **{all}** |");
    println!("| all variables | {variables} |");
    println!("| **all RAM** (bar: {BAR}) | **{}** |", variables + all);
    ensure!(variables + all <= BAR, "more RAM than there may be");
    Ok(all)
}

/// The start, and the handlers of all interrupts.
fn roots(program: &Program, bytes: &[u8]) -> anyhow::Result<Vec<u64>> {
    let start = program.address_of(START).context("the program has no start")?;
    let mut roots = vec![start];
    for at in memory::handlers(bytes)? {
        let handler = program.function(at).context("a handler that is no function")?;
        if !handler.names.iter().any(|name| ENDS.contains(&name.as_str())) {
            roots.push(at);
        }
    }
    Ok(roots)
}

/// How deep the stack is below each function.
struct Depths<'a> {
    program: &'a Program,
    /// What a call by register may lead to.
    taken: BTreeSet<u64>,
    /// By address: how deep, and through whom.
    known: BTreeMap<u64, (u64, Option<u64>)>,
    /// Whose depth is being looked for, each called by the one before.
    under_way: Vec<u64>,
}

impl<'a> Depths<'a> {
    fn of(program: &'a Program, roots: &[u64]) -> anyhow::Result<Self> {
        let (taken, known, under_way) = Default::default();
        let mut depths = Self { program, taken, known, under_way };
        // What is called by register may take further addresses.
        loop {
            let reached = depths.reached(roots);
            let taken = depths.taken_by(&reached);
            if taken == depths.taken {
                depths.check(&reached)?;
                return Ok(depths);
            }
            depths.taken = taken;
        }
    }

    /// All functions that can be called.
    fn reached(&self, roots: &[u64]) -> BTreeSet<u64> {
        let mut reached: BTreeSet<u64> = roots.iter().copied().collect();
        let mut next = roots.to_vec();
        while let Some(at) = next.pop() {
            next.extend(self.called_by(at).into_iter().filter(|&called| reached.insert(called)));
        }
        reached
    }

    /// What a function may call, but for panics.
    fn called_by(&self, at: u64) -> BTreeSet<u64> {
        let Some(function) = self.program.function(at) else { return BTreeSet::new() };
        let mut called = function.calls.clone();
        if function.stack.calls_by_register {
            called.extend(&self.taken);
        }
        called.retain(|&called| !self.name(called).contains(PANIC));
        called
    }

    /// The functions whose address one of these takes, but for those that only print.
    fn taken_by(&self, reached: &BTreeSet<u64>) -> BTreeSet<u64> {
        let functions = reached.iter().filter_map(|&at| self.program.function(at));
        let addresses = functions.flat_map(|function| &function.takes);
        let mut taken: BTreeSet<u64> =
            addresses.flat_map(|&address| self.program.callable_through(address)).collect();
        taken.retain(|&at| !self.name(at).contains(FORMATTING));
        taken
    }

    /// Nobody prints, and every frame is known.
    fn check(&self, reached: &BTreeSet<u64>) -> anyhow::Result<()> {
        for &at in reached {
            let name = self.name(at);
            ensure!(!name.contains(FORMATTING), "{name} is called, and not only by panics");
            let is_unbounded = self.program.function(at).is_some_and(|f| f.stack.is_unbounded);
            ensure!(!is_unbounded, "{name} lowers the stack by what nobody knows beforehand");
        }
        Ok(())
    }

    fn depth(&mut self, at: u64) -> anyhow::Result<u64> {
        if let Some((depth, _)) = self.known.get(&at) {
            return Ok(*depth);
        }
        if self.under_way.contains(&at) {
            let names: Vec<&str> = self.under_way.iter().map(|&at| self.name(at)).collect();
            bail!("recursion: {} → {}", names.join(" → "), self.name(at));
        }
        self.under_way.push(at);
        let (mut below, mut through) = (0, None);
        for called in self.called_by(at) {
            let depth = self.depth(called)?;
            if depth > below {
                (below, through) = (depth, Some(called));
            }
        }
        self.under_way.pop();
        let depth = self.frame(at) + below;
        self.known.insert(at, (depth, through));
        Ok(depth)
    }

    /// The functions of the deepest path down from one of which the depth is known, each with its
    /// frame.
    fn deepest_path(&self, from: u64) -> Vec<(&'a str, u64)> {
        let through = |at: &u64| self.known.get(at).and_then(|(_, through)| *through);
        let path = std::iter::successors(Some(from), through);
        path.map(|at| (self.name(at), self.frame(at))).collect()
    }

    fn frame(&self, at: u64) -> u64 {
        self.program.function(at).map_or(0, |function| function.stack.bytes)
    }

    fn name(&self, at: u64) -> &'a str {
        self.program.function(at).map_or("(no function)", Function::name)
    }
}
