//! Gives the linker the regions of the flash, which lie beside this file.

fn main() {
    let here = env!("CARGO_MANIFEST_DIR");
    println!("cargo:rustc-link-search={here}");
    println!("cargo:rerun-if-changed={here}/flash.x");
    // The scripts of esp-hal, defmt and this folder. The relocations stay in the linked program, so that `cargo xtask`
    // can read which function calls which.
    for argument in ["-Tlinkall.x", "-Tdefmt.x", "-Tflash.x", "--emit-relocs"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
