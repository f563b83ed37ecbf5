//! Hands the linker the board's memory map, which lies at the top of the repository.

fn main() {
    let top = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    println!("cargo:rustc-link-search={top}");
    println!("cargo:rerun-if-changed={top}/memory.x");
}
