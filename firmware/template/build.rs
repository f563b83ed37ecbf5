//! Gives the linker the board's memory map, which lies beside this file.

fn main() -> Result<(), std::env::VarError> {
    println!("cargo:rustc-link-search={}", std::env::var("CARGO_MANIFEST_DIR")?);
    println!("cargo:rerun-if-changed=memory.x");
    for argument in ["-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    Ok(())
}
