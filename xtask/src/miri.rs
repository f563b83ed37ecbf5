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
            "miri: SKIPPED, nothing was looked at. It needs a nightly toolchain: \
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

/// Whether Miri and the library it interprets can be had, without fetching another toolchain: on some
/// machines that would fail, or hang.
fn is_there() -> bool {
    // Makes the library from its sources, `rust-src`, if that has not been done.
    let mut setup = Command::new("cargo");
    setup.args(["+nightly", "miri", "setup", "--target", TARGET]).env("RUSTUP_AUTO_INSTALL", "0");
    setup.stdin(Stdio::null()).stdout(Stdio::null());
    setup.status().is_ok_and(|status| status.success())
}
