//! Gives the linker the memory map of the board, and the program what differs between the boards that it is built for.

fn main() -> Result<(), std::env::VarError> {
    // Of each package the folder of its memory map, and its names in `cfg`.
    let (folder, names): (&str, &[&str]) = match env!("CARGO_PKG_NAME") {
        "sonarfix-pico" => ("pico", &["rp2040"]),
        "sonarfix-xrp" => ("pico", &["rp2040", "xrp"]),
        "sonarfix-xrp-rp2350" => ("pico2", &["xrp"]),
        _ => ("pico2", &[]),
    };
    println!("cargo:rustc-check-cfg=cfg(rp2040, xrp)");
    for name in names {
        println!("cargo:rustc-cfg={name}");
    }
    // Read when it runs: the script may have been compiled in another folder with the same target folder.
    let memory = format!("{}/..", std::env::var("CARGO_MANIFEST_DIR")?);
    println!("cargo:rustc-link-search={memory}/{folder}");
    println!("cargo:rerun-if-changed={memory}/{folder}/memory.x");
    // The scripts of cortex-m-rt and defmt. The relocations stay in the linked program, so that `cargo xtask`
    // can read which function calls which.
    for argument in ["-Tlink.x", "-Tdefmt.x", "--emit-relocs"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    Ok(())
}
