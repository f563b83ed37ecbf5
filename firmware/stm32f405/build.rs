//! Gives the linker the board's memory map, which lies at the top of the repository.

fn main() -> Result<(), std::env::VarError> {
    // Read when it runs: the script may have been compiled in another folder with the same target folder.
    let top = format!("{}/../..", std::env::var("CARGO_MANIFEST_DIR")?);
    println!("cargo:rustc-link-search={top}");
    println!("cargo:rerun-if-changed={top}/memory.x");
    // The scripts of cortex-m-rt and defmt. The relocations stay in the linked program, so that `cargo xtask`
    // can read which function calls which.
    for argument in ["-Tlink.x", "-Tdefmt.x", "--emit-relocs"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    Ok(())
}
