//! Compiles two functions of CMSIS-DSP, whose source is in the folder that `CMSIS_DSP` names.

use std::env;
use std::path::PathBuf;

fn main() {
    println!("cargo::rerun-if-env-changed=CMSIS_DSP");
    let folder = env::var_os("CMSIS_DSP").map(PathBuf::from);
    let folder = folder.expect("`.cargo/config.toml` sets it");
    let is_there = folder.join("Source").exists();
    assert!(is_there, "cargo xtask peers downloads the source to {}", folder.display());
    let mut build = cc::Build::new();
    build.include(folder.join("Include")).include(folder.join("PrivateInclude"));
    // The library's own choice (`option(LOOPUNROLL … ON)`), and no dependency on CMSIS-Core.
    build.define("ARM_MATH_LOOPUNROLL", None).define("__GNUC_PYTHON__", None).warnings(false);
    // The same choice as rustc's for the other programs.
    let flags = env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    let is_fused = flags.contains("fp-contract=fast");
    build.flag(if is_fused { "-ffp-contract=fast" } else { "-ffp-contract=off" });
    for name in ["arm_mat_mult_f32", "arm_mat_trans_f32"] {
        build.file(folder.join(format!("Source/MatrixFunctions/{name}.c")));
    }
    build.compile("cmsisdsp");
}
