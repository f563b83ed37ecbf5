//! The code that a program for a Cortex-M4F links of the library.

use anyhow::{Context, bail, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind};

use super::Core;

/// The compositions, and the largest code of `one_fix.c` with each, bytes.
const LIMITS: [(&str, u64); 2] = [("small", 35_500), ("full", 66 * 1024)];

/// Links `one_fix.c` with both libraries for the first core.
pub fn check(cores: &[Core]) -> anyhow::Result<()> {
    let core = cores.first().context("there is no core")?;
    for (composition, limit) in LIMITS {
        let library = core.build(composition)?;
        let sources = "examples/one_fix.c tests/cores/one_fix_core.c tests/cores/core.c";
        let program = core.link(&library, "", sources)?;
        let bytes = std::fs::read(&program)?;
        let file = object::File::parse(bytes.as_slice())?;
        let code = code(&file);
        println!("one_fix.c on a {} with the {composition} library: {code} bytes", core.name);
        ensure!(code <= limit, "more than {limit} bytes");
        check_panics(&file)?;
    }
    Ok(())
}

/// Code and constants.
fn code(file: &object::File) -> u64 {
    let kinds = [SectionKind::Text, SectionKind::ReadOnlyData];
    file.sections()
        .filter(|section| kinds.contains(&section.kind()))
        .map(|section| section.size())
        .sum()
}

fn check_panics(file: &object::File) -> anyhow::Result<()> {
    for symbol in file.symbols() {
        let name = symbol.name().unwrap_or_default();
        if name.contains("panicking") || name.contains("rust_begin_unwind") {
            bail!("the program links a panic: {name}");
        }
    }
    Ok(())
}
