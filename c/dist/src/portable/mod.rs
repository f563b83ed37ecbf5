//! The portable C source of the library: Rust, translated to WebAssembly, translated to C.
//!
//! wasm2c means its output for a memory of its own, a sandbox. A library is called with pointers of its caller, so that the source
//! made here has no memory: an address of the module is an address of the machine, which therefore has pointers of 32 bits. The
//! module's constants are an array of the source, and its stack is an array in each function of the header. There is no global, and
//! nothing is allocated.
//!
//! The constants' addresses are numbers in the module. The module is linked twice, with the constants at two places. Both must give
//! the same source, which shows that every such number, and no other, was found.

mod access;
mod build;
mod emit;
mod module;
mod stack;

use std::path::Path;

use anyhow::{Result, ensure};

use crate::header::Prototype;
use access::Accesses;
use module::Module;

/// Where the constants are linked: two places that no other number of the library is near.
const BASES: [u32; 2] = [0x5a5a_0000, 0x6a41_0000];

/// The portable source of the library with these features.
///
/// # Errors
/// If a tool is missing or fails, or if its output is not as expected.
pub fn source(workspace: &Path, features: &str, prototypes: &[Prototype]) -> Result<String> {
    let [one, other] = BASES.map(|base| at(workspace, features, prototypes, base));
    let (one, other) = (one?, other?);
    ensure!(one == other, "a number of the library looks like the address of a constant");
    Ok(one)
}

fn at(workspace: &Path, features: &str, prototypes: &[Prototype], base: u32) -> Result<String> {
    let translation = build::translate(workspace, features, base)?;
    let module = Module::parse(&translation.source)?;
    let accesses = Accesses::parse(&translation.disassembly)?;
    emit::emit(&module, accesses, prototypes, base)
}
