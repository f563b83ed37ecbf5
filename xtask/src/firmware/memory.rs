//! Checks the layout of the memory: the stack is below all variables, and there is no heap.

use std::collections::BTreeSet;

use anyhow::{Context, bail, ensure};
use object::elf::SHF_WRITE;
use object::{Object, ObjectSection, SectionFlags, SectionKind};

use crate::elf;

/// Parts of the names of an allocator's functions.
const ALLOCATORS: [&str; 4] = ["__rust_alloc", "__rg_alloc", "alloc::alloc", "alloc::raw_vec"];

/// Checks that nothing allocates and that the stack is below all variables, so that its overflow reaches the end of the
/// memory, which is a fault, and not a variable.
pub fn check(bytes: &[u8]) -> anyhow::Result<()> {
    let file = object::File::parse(bytes)?;
    for symbol in file.symbols() {
        let name = elf::name(&symbol)?;
        if ALLOCATORS.iter().any(|part| name.contains(part)) || name.starts_with("alloc::") {
            bail!("{name} is linked: the program allocates");
        }
    }
    let (top, lowest) = (stack_top(&file)?, lowest_variable(&file)?);
    ensure!(top <= lowest, "the stack begins at {top:#x}, above variables at {lowest:#x}");
    eprintln!("no allocator; the stack begins at {top:#x}, variables at {lowest:#x}");
    Ok(())
}

/// Bytes of RAM from the stack's top to the end of all variables.
pub fn variables(bytes: &[u8]) -> anyhow::Result<u64> {
    let file = object::File::parse(bytes)?;
    let top = stack_top(&file)?;
    let end = variables_of(&file).map(|section| section.address() + section.size()).max();
    Ok(end.context("the program has no variables")? - top)
}

/// Bytes of RAM below the stack's top.
pub fn room_of_stack(bytes: &[u8]) -> anyhow::Result<u64> {
    /// Where every Cortex-M has its RAM.
    const RAM: u64 = 0x2000_0000;
    Ok(stack_top(&object::File::parse(bytes)?)?.saturating_sub(RAM))
}

/// Addresses of the functions in the vector table.
pub fn handlers(bytes: &[u8]) -> anyhow::Result<BTreeSet<u64>> {
    let file = object::File::parse(bytes)?;
    let words = vector_table(&file)?;
    // The first word is the top of the stack; unused ones are zero; the lowest bit marks Thumb code.
    Ok(words.into_iter().skip(1).filter(|&word| word != 0).map(|word| word & !1).collect())
}

/// The top of the stack, from the first word of the vector table.
fn stack_top(file: &object::File) -> anyhow::Result<u64> {
    vector_table(file)?.first().copied().context("the vector table is empty")
}

fn vector_table(file: &object::File) -> anyhow::Result<Vec<u64>> {
    let table = file.section_by_name(".vector_table").context("the program has no vectors")?;
    let (words, _) = table.data()?.as_chunks::<4>();
    Ok(words.iter().map(|word| u64::from(u32::from_le_bytes(*word))).collect())
}

fn lowest_variable(file: &object::File) -> anyhow::Result<u64> {
    let lowest = variables_of(file).map(|section| section.address()).min();
    lowest.context("the program has no variables")
}

/// The sections of variables in RAM, which can be written; without the section of the stack, which some linker scripts have.
pub fn variables_of<'f, 'd>(
    file: &'f object::File<'d>,
) -> impl Iterator<Item = object::Section<'d, 'f>> {
    file.sections().filter(|section| {
        let SectionFlags::Elf { sh_flags } = section.flags() else { return false };
        matches!(section.kind(), SectionKind::Data | SectionKind::UninitializedData)
            && sh_flags & u64::from(SHF_WRITE) != 0
            && section.name() != Ok(".stack")
            && section.size() > 0
    })
}
