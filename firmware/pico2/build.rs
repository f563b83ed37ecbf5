//! Hands the linker the board's memory map, which lies beside this file.

fn main() {
    let here = env!("CARGO_MANIFEST_DIR");
    println!("cargo:rustc-link-search={here}");
    println!("cargo:rerun-if-changed={here}/memory.x");
}
