//! That the frames read from a program's instructions are those that its compiler meant.
//!
//! A stable compiler does not say how large it makes a frame. Told to be a nightly one it does, in
//! a section of its own; with it the program's code is another, so it is not the one that ships.

use anyhow::{Context, bail, ensure};
use object::{Object, ObjectSection};

use crate::elf::Program;

/// What makes the compiler write the section.
pub const FLAG: &str = "-Zemit-stack-sizes";

/// Compares the frame of every function in the section.
pub fn check(bytes: &[u8]) -> anyhow::Result<()> {
    let program = Program::parse(bytes)?;
    let file = object::File::parse(bytes)?;
    let section = file.section_by_name(".stack_sizes").context("it holds no stack sizes")?;
    let mut rest = section.data()?;
    let (mut equal, mut other) = (0, Vec::new());
    while let Some((address, after)) = rest.split_first_chunk::<4>() {
        let (said, after) = uleb128(after).context("the stack sizes are cut off")?;
        rest = after;
        let address = u64::from(u32::from_le_bytes(*address)) & !1;
        let function = program.function(address).context("a stack size of no function")?;
        let read = function.stack.bytes;
        if read == said {
            equal += 1;
        } else {
            other.push(format!("{}: {read} read, {said} said", function.name()));
        }
    }
    println!("frames read from instructions as the compiler says: {equal}");
    ensure!(equal > 0, "the compiler said nothing of any function");
    if !other.is_empty() {
        bail!("frames that are not what the compiler says:\n  {}", other.join("\n  "));
    }
    Ok(())
}

/// A number of seven bits a byte, the lowest first; and what follows it.
fn uleb128(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let last = bytes.iter().position(|byte| byte & 0x80 == 0)?;
    let (number, rest) = bytes.split_at_checked(last + 1)?;
    let number = number.iter().rev().fold(0, |sum, byte| sum << 7 | u64::from(byte & 0x7f));
    Some((number, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_one_byte_and_more() {
        assert_eq!(uleb128(&[0x08, 0xff]), Some((8, &[0xff][..])));
        assert_eq!(uleb128(&[0xe5, 0x8e, 0x26]), Some((624_485, &[][..])));
        assert_eq!(uleb128(&[0x80]), None);
    }
}
