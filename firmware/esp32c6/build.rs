//! Gives the linker the regions of the flash, which lie beside this file.

fn main() -> Result<(), std::env::VarError> {
    // Read when it runs: the script may have been compiled in another folder with the same target folder.
    let here = std::env::var("CARGO_MANIFEST_DIR")?;
    println!("cargo:rustc-link-search={here}");
    println!("cargo:rerun-if-changed={here}/flash.x");
    // The scripts of esp-hal, defmt and this folder. The relocations stay in the linked program, so that `cargo xtask`
    // can read which function calls which.
    for argument in ["-Tlinkall.x", "-Tdefmt.x", "-Tflash.x", "--emit-relocs"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    Ok(())
}
