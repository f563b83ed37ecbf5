//! The deepest stack: the maximum over all paths through the call graph of the linked program, from its start and from
//! each interrupt.
//!
//! - **Frames** are the bytes by which a function's instructions lower the stack.
//! - **Calls** are the relocations, and the calls of a function to itself. A call through a register may reach any function
//!   whose address is taken by reachable code, except for handlers, which the core calls, and those in [`ONLY_BY`].
//! - **Recursion** is an error.
//! - **Interrupts** are assumed to nest, each once, whatever their priorities, and each with a full floating-point context.
//! - **Panics** and fault handlers are excluded: the program has ended.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, bail, ensure};

use super::memory;
use super::panics::PANIC;
use crate::elf::{Function, Program};

/// The entry point.
const START: &str = "Reset";
/// Handlers that do not return; that of the voltage detector restarts the chip.
const ENDS: [&str; 4] = [START, "HardFault", "DefaultHandler", "PVD"];
/// The exception frame: 26 words with the floating-point registers, and one for alignment to eight bytes (`ARMv7-M
/// Architecture Reference Manual`, B1.5.7). A core without floating-point unit saves less.
const EXCEPTION: u64 = 4 * 27;
/// Functions whose address is taken, and the only ones that call them through a register, by parts of their names: an executor
/// polls its tasks, and nothing else does; the USB device, which a task runs, tells its handlers what has happened.
const ONLY_BY: [(&str, &[&str]); 2] = [
    (TASK, &["embassy_executor::platform::"]),
    ("as embassy_usb::Handler>::", &["embassy_usb::UsbDevice", "embassy_usb::Inner", TASK]),
];
const TASK: &str = "embassy_executor::raw::TaskStorage<F>::poll";
/// Limit of all RAM with everything linked, bytes. A commit that raises it says what a user gets for it. The map stays in
/// flash.
const BAR: u64 = 21_248;
/// Formatting functions. Panic messages take their addresses, and they call each other. As long as no other function calls
/// one of them, none is called.
const FORMATTING: &str = "core::fmt::";

/// The deepest path from a root.
struct Deepest {
    root: String,
    /// With what the core saves.
    depth: u64,
    saved: u64,
    /// The functions on it, each with its frame.
    path: Vec<(String, u64)>,
}

/// Prints the deepest paths, and checks the RAM of the reference board; returns the total depth.
pub fn check(bytes: &[u8]) -> anyhow::Result<u64> {
    let all = print(bytes)?;
    let ram = memory::variables(bytes)? + all;
    println!("| **all RAM** (bar: {BAR}) | **{ram}** |");
    ensure!(ram <= BAR, "the RAM exceeds its limit");
    Ok(all)
}

/// Prints the deepest paths of a program for a Cortex-M; returns the total depth.
pub fn print(bytes: &[u8]) -> anyhow::Result<u64> {
    let deepest = deepest(bytes)?;
    println!("\n| stack at its deepest, down from | bytes |\n|---|---|");
    for Deepest { root, depth, saved, path } in &deepest {
        println!("| **`{root}`** | **{depth}** |");
        if *saved > 0 {
            println!("| saved by the core | {saved} |");
        }
        for (name, bytes) in path.iter().filter(|(_, bytes)| *bytes > 0) {
            println!("| `{name}` | {bytes} |");
        }
    }
    let all = total(&deepest);
    println!("| **all stack, one in another** | **{all}** |");
    println!("| all variables | {} |", memory::variables(bytes)?);
    Ok(all)
}

/// The total depth of the stack of a program for a Cortex-M, which must fit below the variables.
pub fn bound(bytes: &[u8]) -> anyhow::Result<u64> {
    let all = total(&deepest(bytes)?);
    let room = memory::room_of_stack(bytes)?;
    ensure!(all <= room, "the stack may take {all} bytes and has {room}");
    Ok(all)
}

fn total(deepest: &[Deepest]) -> u64 {
    deepest.iter().map(|deepest| deepest.depth).sum()
}

fn deepest(bytes: &[u8]) -> anyhow::Result<Vec<Deepest>> {
    let program = Program::parse(bytes)?;
    let handlers = memory::handlers(bytes)?;
    let roots = roots(&program, &handlers)?;
    let mut depths = Depths::of(&program, &roots, handlers)?;
    let deepest = |root| {
        let name = depths.name(root);
        let saved = if name == START { 0 } else { EXCEPTION };
        let depth = saved + depths.depth(root)?;
        let path = depths.deepest_path(root).into_iter();
        let path = path.map(|(name, bytes)| (name.to_owned(), bytes)).collect();
        Ok(Deepest { root: name.to_owned(), depth, saved, path })
    };
    roots.iter().copied().map(deepest).collect()
}

/// The start, and the handlers of all interrupts.
fn roots(program: &Program, handlers: &BTreeSet<u64>) -> anyhow::Result<Vec<u64>> {
    let start = program.address_of(START).context("the program has no start")?;
    let mut roots = vec![start];
    for &at in handlers {
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
    /// The handlers in the vector table, which no function calls.
    handlers: BTreeSet<u64>,
    /// The possible targets of a call through a register.
    taken: BTreeSet<u64>,
    /// By address: the depth, and the next function on the deepest path.
    known: BTreeMap<u64, (u64, Option<u64>)>,
    /// The functions on the current path, each called by the one before.
    under_way: Vec<u64>,
}

impl<'a> Depths<'a> {
    fn of(program: &'a Program, roots: &[u64], handlers: BTreeSet<u64>) -> anyhow::Result<Self> {
        let (taken, known, under_way) = Default::default();
        let mut depths = Self { program, handlers, taken, known, under_way };
        // Functions that are called through a register may take further addresses.
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

    /// The functions that a function may call, without panics.
    fn called_by(&self, at: u64) -> BTreeSet<u64> {
        let Some(function) = self.program.function(at) else { return BTreeSet::new() };
        let mut called = function.calls.clone();
        if function.stack.calls_by_register {
            let may_call = |taken: &u64| {
                let rule = ONLY_BY.iter().find(|(part, _)| self.name(*taken).contains(part));
                let calls = |caller: &&str| function.name().contains(*caller);
                rule.is_none_or(|(_, callers)| callers.iter().any(calls))
            };
            called.extend(self.taken.iter().copied().filter(may_call));
        }
        called.retain(|&called| !self.name(called).contains(PANIC));
        called
    }

    /// The functions whose address one of these takes, without formatting functions.
    fn taken_by(&self, reached: &BTreeSet<u64>) -> BTreeSet<u64> {
        let functions = reached.iter().filter_map(|&at| self.program.function(at));
        let addresses = functions.flat_map(|function| &function.takes);
        let mut taken: BTreeSet<u64> =
            addresses.flat_map(|&address| self.program.callable_through(address)).collect();
        taken.retain(|at| !self.name(*at).contains(FORMATTING) && !self.handlers.contains(at));
        taken
    }

    /// Checks that no formatting function is called and that every frame is known.
    fn check(&self, reached: &BTreeSet<u64>) -> anyhow::Result<()> {
        for &at in reached {
            let name = self.name(at);
            ensure!(!name.contains(FORMATTING), "{name} is called outside of panics");
            let is_unbounded = self.program.function(at).is_some_and(|f| f.stack.is_unbounded);
            ensure!(!is_unbounded, "{name} lowers the stack by an unknown amount");
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

    /// The functions of the deepest path from a function, each with its frame.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thumb::Stack;

    /// A function with this frame, which calls and takes what is at these addresses.
    fn function(name: &str, bytes: u64, calls: &[u64], takes: &[u64]) -> Function {
        Function {
            names: vec![name.to_owned()],
            stack: Stack { bytes, ..Stack::default() },
            calls: calls.iter().copied().collect(),
            takes: takes.iter().copied().collect(),
            ..Function::default()
        }
    }

    fn by_register(mut function: Function) -> Function {
        function.stack.calls_by_register = true;
        function
    }

    fn depth(functions: Vec<(u64, Function)>, data: Vec<(u64, Vec<u64>)>) -> anyhow::Result<u64> {
        let program = Program::made_of(functions, data);
        Depths::of(&program, &[1], BTreeSet::from([9]))?.depth(1)
    }

    #[test]
    fn the_deepest_path_counts_and_not_the_longest() {
        let functions = vec![
            (1, function("start", 8, &[2, 4], &[])),
            (2, function("a", 16, &[3], &[])),
            (3, function("b", 16, &[], &[])),
            (4, function("c", 100, &[], &[])),
        ];
        assert_eq!(depth(functions, Vec::new()).unwrap(), 108);
    }

    #[test]
    fn an_indirect_call_leads_to_the_entries_of_a_table() {
        let functions = |start| vec![(1, start), (2, function("listed", 50, &[], &[]))];
        // A table at 20 refers to another at 30, which contains the function.
        let data = || vec![(20, vec![30]), (30, vec![2])];
        let taken = function("start", 8, &[], &[20]);
        assert_eq!(depth(functions(by_register(taken)), data()).unwrap(), 58);
        let not_taken = function("start", 8, &[], &[]);
        assert_eq!(depth(functions(by_register(not_taken)), data()).unwrap(), 8);
        let not_called = function("start", 8, &[], &[20]);
        assert_eq!(depth(functions(not_called), data()).unwrap(), 8);
    }

    #[test]
    fn recursion_by_any_call_is_an_error() {
        let itself = vec![(1, function("start", 8, &[1], &[]))];
        let one_another =
            vec![(1, function("start", 8, &[2], &[])), (2, function("a", 8, &[1], &[]))];
        let by_pointer = vec![(1, by_register(function("start", 8, &[], &[1])))];
        for functions in [itself, one_another, by_pointer] {
            let error = depth(functions, Vec::new()).unwrap_err().to_string();
            assert!(error.contains("recursion: start → "), "{error}");
        }
    }

    #[test]
    fn handlers_and_tasks_are_called_by_core_and_executor_only() {
        let handler = vec![
            (1, by_register(function("start", 8, &[], &[9]))),
            (9, function("handler", 50, &[], &[])),
        ];
        assert_eq!(depth(handler, Vec::new()).unwrap(), 8);
        let tasks = |executor| {
            let (task, log) = ("embassy_executor::raw::TaskStorage<F>::poll", "log");
            let run = by_register(function(executor, 8, &[], &[2]));
            let (task, log) = (function(task, 50, &[3], &[]), function(log, 4, &[], &[]));
            vec![(1, run), (2, task), (3, by_register(log))]
        };
        let executor = "embassy_executor::platform::thread::Executor::run";
        assert_eq!(depth(tasks(executor), Vec::new()).unwrap(), 62);
        assert_eq!(depth(tasks("another"), Vec::new()).unwrap(), 8);
    }

    #[test]
    fn panics_are_cut_off_and_printing_is_not_expected_elsewhere() {
        let that_calls = |calls: &[u64]| {
            let panic = function("core::panicking::panic_fmt", 500, &[3], &[]);
            let print = function("core::fmt::write", 500, &[], &[]);
            vec![(1, function("start", 8, calls, &[3])), (2, panic), (3, print)]
        };
        assert_eq!(depth(that_calls(&[2]), Vec::new()).unwrap(), 8);
        let error = depth(that_calls(&[2, 3]), Vec::new()).unwrap_err().to_string();
        assert!(error.contains("core::fmt::write is called"), "{error}");
    }

    #[test]
    fn an_unknown_frame_is_an_error() {
        let mut start = function("start", 8, &[], &[]);
        start.stack.is_unbounded = true;
        assert!(depth(vec![(1, start)], Vec::new()).is_err());
    }
}
