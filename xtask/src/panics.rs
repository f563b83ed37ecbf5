//! Searches linked programs for panics. The robot's crates must contain none.
//!
//! Code that can panic calls a function of `core::panicking`, which calls the handler `rust_begin_unwind`. If a
//! program that is linked from the crates contains neither, no path leads to a panic. The programs themselves
//! and the board support contain no panic.

use anyhow::bail;

use crate::elf::Program;
use crate::program::{M0PLUS, M4F, M4F_SMALL, Target};
use crate::workspace::Workspace;

/// Names of functions that only a program that can panic contains.
const PANIC_FUNCTIONS: [&str; 2] = ["core::panicking", "rust_begin_unwind"];

pub fn check() -> anyhow::Result<()> {
    for target in [M4F, M4F_SMALL, M0PLUS] {
        target.build(Workspace::Emulated, "emulated-probe")?;
        for name in ["filter", "localizer"] {
            check_program(&target, name)?;
        }
    }
    eprintln!("no panic is linked");
    Ok(())
}

fn check_program(target: &Target, name: &str) -> anyhow::Result<()> {
    let program = Program::read(&target.program(Workspace::Emulated, name))?;
    let can_panic =
        |symbol: &&str| PANIC_FUNCTIONS.iter().any(|function| symbol.contains(function));
    // The entry point of every program.
    let reach = program.reach(&["Reset"])?;
    let found: Vec<String> = program
        .names()
        .filter(can_panic)
        .map(|panic| reach.path_to(panic).unwrap_or_else(|| panic.to_owned()))
        .collect();
    if !found.is_empty() {
        bail!("{name} on {} can panic:\n  {}", target.name, found.join("\n  "));
    }
    Ok(())
}
