//! The instructions of the most expensive call of a function on an emulated microcontroller, by the functions that it calls.
//!
//! QEMU logs the address of every instruction that it executes (`-singlestep -d exec,nochain`). An instruction at the start of a
//! function after one of another function is a call; one in a function on the stack of calls is the return to it.

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};

use crate::cargo;
use crate::elf::Program;

/// Arguments of QEMU for a log that [`most_expensive`] reads; the path of the log follows.
pub const LOGGED: [&str; 4] = ["-singlestep", "-d", "exec,nochain", "-D"];

/// A function in the tree of calls.
#[derive(Debug, Clone)]
pub struct Node {
    /// Index of the name in [`Profile::names`].
    pub function: usize,
    /// The caller; the root is its own.
    pub caller: usize,
    /// Instructions of the function itself.
    pub own: u64,
    /// Number of its calls.
    pub calls: u64,
}

/// The most expensive call.
#[derive(Debug, Clone, Default)]
pub struct Profile {
    /// Names of the program's functions.
    pub names: Vec<String>,
    /// The tree of calls; the first is the root, a caller precedes the functions that it calls.
    pub nodes: Vec<Node>,
}

impl Profile {
    /// Instructions of the call.
    pub fn instructions(&self) -> u64 {
        self.nodes.iter().map(|node| node.own).sum()
    }

    /// The functions that the one at `at` calls.
    pub fn called(&self, at: usize) -> impl Iterator<Item = usize> {
        // The first is the root, its own caller.
        let callees = self.nodes.iter().enumerate().skip(1);
        callees.filter(move |(_, node)| node.caller == at).map(|(n, _)| n)
    }

    /// Instructions of a function and of those that it calls.
    pub fn inclusive(&self, at: usize) -> u64 {
        let own = self.nodes.get(at).map_or(0, |node| node.own);
        own + self.called(at).map(|called| self.inclusive(called)).sum::<u64>()
    }

    /// The names from a function up to the root.
    pub fn stack(&self, at: usize) -> impl Iterator<Item = &str> {
        let mut next = Some(at);
        std::iter::from_fn(move || {
            let node = self.nodes.get(next?)?;
            next = (Some(node.caller) != next).then_some(node.caller);
            self.names.get(node.function).map(String::as_str)
        })
    }
}

/// A named pipe for a log, removed at the end.
pub struct Pipe(PathBuf);

impl Pipe {
    /// Creates it in the target folder.
    pub fn create(name: &str) -> anyhow::Result<Self> {
        let path = cargo::target_folder().join(name);
        if path.exists() {
            std::fs::remove_file(&path)?;
        }
        let mut make = Command::new("mkfifo");
        make.arg(&path);
        cargo::output(make)?;
        Ok(Self(path))
    }

    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Pipe {
    fn drop(&mut self) {
        // Nothing is lost if it stays.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Reads a log to its end: the most expensive call of the function `root`. Calls in which one of the functions `skipped` is
/// called do not count.
pub fn most_expensive(
    log: &Path,
    program: &Program,
    root: &str,
    skipped: &[&str],
) -> anyhow::Result<Profile> {
    let mut functions = Functions::of(program);
    let root = program.address_of(root).with_context(|| format!("there is no function {root}"))?;
    let skipped: Vec<usize> =
        skipped.iter().filter_map(|name| functions.index_at(program.address_of(name)?)).collect();
    let mut call: Option<Call> = None;
    let (mut most, mut best) = (0, Vec::new());
    let mut log = BufReader::with_capacity(1 << 20, File::open(log)?);
    let mut line = Vec::new();
    loop {
        line.clear();
        if log.read_until(b'\n', &mut line)? == 0 {
            break;
        }
        let Some(at) = address(&line) else { continue };
        let Some(function) = functions.index_of(at) else { continue };
        let is_start = functions.is_start(at, function);
        let mut has_ended = false;
        match &mut call {
            Some(call) => has_ended = !call.step(function, is_start),
            None if at == root => call = Some(Call::begun(function)),
            None => {}
        }
        if has_ended && let Some(call) = call.take() {
            let instructions = call.nodes.iter().map(|node| node.own).sum();
            let counts = !call.nodes.iter().any(|node| skipped.contains(&node.function));
            if counts && instructions > most {
                (most, best) = (instructions, call.nodes);
            }
        }
    }
    ensure!(most > 0, "the log has no call");
    Ok(Profile { names: std::mem::take(&mut functions.names), nodes: best })
}

/// The address in `Trace 0: 0x7f… [00000000/0000abcd/…] name`.
fn address(line: &[u8]) -> Option<u64> {
    let line = line.strip_prefix(b"Trace ")?;
    let bracket = line.iter().position(|&byte| byte == b'[')?;
    let rest = line.get(bracket..)?;
    let slash = rest.iter().position(|&byte| byte == b'/')?;
    let digits = rest.get(slash + 1..)?.first_chunk::<8>()?;
    digits
        .iter()
        .try_fold(0, |sum, &digit| Some(16 * sum + u64::from(char::from(digit).to_digit(16)?)))
}

/// A call that is being read.
struct Call {
    nodes: Vec<Node>,
    /// The function that is executed.
    at: usize,
}

impl Call {
    fn begun(function: usize) -> Self {
        Self { nodes: vec![Node { function, caller: 0, own: 1, calls: 1 }], at: 0 }
    }

    /// Counts an instruction; false if the call has returned before it.
    fn step(&mut self, function: usize, is_start: bool) -> bool {
        if !self.is_in(self.at, function) && is_start {
            self.enter(function);
        }
        while !self.is_in(self.at, function) {
            let caller = self.nodes.get(self.at).map_or(0, |node| node.caller);
            if self.at == 0 {
                return false;
            }
            self.at = caller;
        }
        if let Some(here) = self.nodes.get_mut(self.at) {
            here.own += 1;
        }
        true
    }

    fn is_in(&self, at: usize, function: usize) -> bool {
        self.nodes.get(at).is_some_and(|node| node.function == function)
    }

    fn enter(&mut self, function: usize) {
        let caller = self.at;
        let is_it = |node: &Node| node.caller == caller && node.function == function;
        // The first is the root, which nobody calls.
        let known = self.nodes.iter().skip(1).position(is_it).map(|place| place + 1);
        self.at = known.unwrap_or(self.nodes.len());
        match self.nodes.get_mut(self.at) {
            Some(node) => node.calls += 1,
            None => self.nodes.push(Node { function, caller, own: 0, calls: 1 }),
        }
    }
}

/// The functions of a program, by address.
struct Functions {
    names: Vec<String>,
    starts: Vec<u64>,
    /// Index of the function of each half word of the program, plus one.
    index: Vec<u32>,
}

impl Functions {
    fn of(program: &Program) -> Self {
        let mut functions = Self { names: Vec::new(), starts: Vec::new(), index: Vec::new() };
        for (start, function) in program.functions() {
            functions.names.push(function.name().to_owned());
            functions.starts.push(start);
            let (from, to) = (half_word(start), half_word(start + function.bytes));
            if functions.index.len() < to {
                functions.index.resize(to, 0);
            }
            let number = u32::try_from(functions.names.len()).unwrap_or(0);
            if let Some(places) = functions.index.get_mut(from..to) {
                places.fill(number);
            }
        }
        functions
    }

    fn index_of(&self, address: u64) -> Option<usize> {
        let number = *self.index.get(half_word(address))?;
        (number as usize).checked_sub(1)
    }

    fn index_at(&self, start: u64) -> Option<usize> {
        self.index_of(start).filter(|&function| self.is_start(start, function))
    }

    fn is_start(&self, address: u64, function: usize) -> bool {
        self.starts.get(function) == Some(&address)
    }
}

fn half_word(address: u64) -> usize {
    usize::try_from(address / 2).unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_address_of_a_log_line_is_read() {
        let line = b"Trace 0: 0x7f1c38000100 [00000000/00000ae4/00000110/ff000000] main\n";
        assert_eq!(address(line), Some(0xae4));
        assert_eq!(address(b"qemu: hello\n"), None);
        assert_eq!(address(b"Trace 0: 0x7f [00/"), None);
    }

    /// A calls B twice, B calls C, and A returns.
    #[test]
    fn calls_and_returns_make_a_tree() {
        let mut call = Call::begun(0);
        for (function, is_start) in [
            (0, false),
            (1, true),
            (2, true),
            (2, false),
            (1, false),
            (0, false),
            (1, true),
            (0, false),
        ] {
            assert!(call.step(function, is_start));
        }
        assert!(!call.step(7, false));
        let own: Vec<_> = call.nodes.iter().map(|n| (n.function, n.own, n.calls)).collect();
        assert_eq!(own, [(0, 4, 1), (1, 3, 2), (2, 2, 1)]);
    }
}
