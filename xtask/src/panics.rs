//! No panic in a linked program: the crates of the robot promise it, the linker knows.
//!
//! What can panic calls a function of `core::panicking`, and that the handler `rust_begin_unwind`.
//! If neither is in a program that was linked from the crates, no path leads there. The programs and
//! the board beneath them have no panic of their own.

use anyhow::bail;

use crate::elf::Program;
use crate::program::{M0PLUS, M4F, M4F_SMALL, Target};

/// Names that only a program that can panic holds.
const SIGNS: [&str; 2] = ["core::panicking", "rust_begin_unwind"];

pub fn check() -> anyhow::Result<()> {
    for target in [M4F, M4F_SMALL, M0PLUS] {
        target.build("bench-probe", "")?;
        for name in ["filter", "localizer"] {
            check_program(&target, name)?;
        }
    }
    eprintln!("no panic is linked");
    Ok(())
}

fn check_program(target: &Target, name: &str) -> anyhow::Result<()> {
    let program = Program::read(&target.program(name))?;
    let is_sign = |symbol: &&str| SIGNS.iter().any(|sign| symbol.contains(sign));
    // Where every program starts.
    let reach = program.reach("Reset")?;
    let found: Vec<String> = program
        .names()
        .filter(is_sign)
        .map(|panic| reach.path_to(panic).unwrap_or_else(|| panic.to_owned()))
        .collect();
    if !found.is_empty() {
        bail!("{name} on {} can panic:\n  {}", target.name, found.join("\n  "));
    }
    Ok(())
}
