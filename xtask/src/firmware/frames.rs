//! Compares the stack frames read from a program's instructions with those reported by the compiler.
//!
//! Only a nightly compiler reports them, in a separate section; `RUSTC_BOOTSTRAP` enables this on a stable one. The resulting program differs
//! from the one that ships.

use anyhow::{Context, bail, ensure};
use object::{Object, ObjectSection};

use crate::elf::Program;

/// The flag for the section.
pub const FLAG: &str = "-Zemit-stack-sizes";

/// Compares the frame of every function in the section.
pub fn check(bytes: &[u8]) -> anyhow::Result<()> {
    let program = Program::parse(bytes)?;
    let file = object::File::parse(bytes)?;
    let section = file.section_by_name(".stack_sizes").context("it holds no stack sizes")?;
    let mut rest = section.data()?;
    let (mut equal, mut other) = (0, Vec::new());
    while let Some((address, after)) = rest.split_first_chunk::<4>() {
        let (reported, after) = uleb128(after).context("the stack sizes are cut off")?;
        rest = after;
        let address = u64::from(u32::from_le_bytes(*address)) & !1;
        let function = program.function(address).context("a stack size of no function")?;
        let read = function.stack.bytes;
        if read == reported {
            equal += 1;
        } else {
            other.push(format!("{}: {read} read, {reported} reported", function.name()));
        }
    }
    println!("frames equal to those of the compiler: {equal}");
    ensure!(equal > 0, "the compiler reported no frame");
    if !other.is_empty() {
        bail!("frames that differ from those of the compiler:\n  {}", other.join("\n  "));
    }
    Ok(())
}

/// Reads a number in ULEB128; returns it and the bytes after it.
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
