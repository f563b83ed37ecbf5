//! `cargo xtask miri`: the core's unit tests and examples under Miri, which finds undefined
//! behaviour. It needs a nightly toolchain with the component `miri`; where there is none, that is
//! said aloud, and nothing fails. (The core forbids `unsafe`; what is looked at are its
//! dependencies, as far as it calls them.)

use std::process::{Command, Stdio};

use crate::cargo;

/// libm has inline assembly for x86, which Miri cannot run; for this target it has none.
const TARGET: &str = "armv7-unknown-linux-gnueabihf";

pub fn run() -> anyhow::Result<()> {
    if !is_there() {
        eprintln!(
            "miri: SKIPPED. It needs a nightly toolchain: \
             `rustup toolchain install nightly --profile minimal --component miri,rust-src`"
        );
        return Ok(());
    }
    for what in [["--lib", "--test=blocked"].as_slice(), &["--doc"]] {
        let mut command = Command::new("cargo");
        command.args(["+nightly", "miri", "test", "--package", "sonarfix", "--target", TARGET]);
        command.args(what).env("MIRIFLAGS", "-Zmiri-tree-borrows");
        // Its build is another compiler's: apart from all others.
        command.env("CARGO_TARGET_DIR", cargo::target_directory().join("miri"));
        cargo::check(command)?;
    }
    Ok(())
}

fn is_there() -> bool {
    let mut version = Command::new("cargo");
    version.args(["+nightly", "miri", "--version"]).stdout(Stdio::null()).stderr(Stdio::null());
    version.status().is_ok_and(|status| status.success())
}
