//! Gives the linker the board's memory map, which lies beside this file.

fn main() {
    let here = env!("CARGO_MANIFEST_DIR");
    println!("cargo:rustc-check-cfg=cfg(rp2040)");
    println!("cargo:rustc-cfg=rp2040");
    println!("cargo:rustc-link-search={here}");
    println!("cargo:rerun-if-changed={here}/memory.x");
    // The scripts of cortex-m-rt and defmt. The relocations stay in the linked program, so that `cargo xtask`
    // can read which function calls which.
    for argument in ["-Tlink.x", "-Tdefmt.x", "--emit-relocs"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
