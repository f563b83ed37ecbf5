//! `cargo xtask miri`: runs the core's unit tests and examples under Miri, which finds undefined behaviour.
//!
//! It needs a nightly toolchain with the component `miri`; without it, it prints that it was skipped and does not fail. The
//! core forbids `unsafe`, so Miri checks the parts of its dependencies that it calls.

use std::process::{Command, Stdio};

use crate::cargo;
use crate::ci;

/// libm has inline assembly for x86, which Miri cannot run; for this target it has none.
const TARGET: &str = "armv7-unknown-linux-gnueabihf";

pub fn run() -> anyhow::Result<()> {
    if !is_there() {
        ci::skip(
            "miri needs a nightly toolchain: \
             `rustup toolchain install nightly --profile minimal --component miri,rust-src`",
        );
        return Ok(());
    }
    for what in [["--lib", "--test=blocked"].as_slice(), &["--doc"]] {
        let mut command = Command::new("cargo");
        command.args(["+nightly", "miri", "test", "--package", "sonarfix", "--target", TARGET]);
        command.args(what).env("MIRIFLAGS", "-Zmiri-tree-borrows");
        // Another compiler: a separate folder for its builds.
        command.env("CARGO_TARGET_DIR", cargo::target_folder().join("miri"));
        cargo::check(command)?;
    }
    Ok(())
}

/// Whether Miri and its standard library are installed. No toolchain is downloaded: on some machines that fails or hangs.
fn is_there() -> bool {
    // Builds the standard library from `rust-src` if necessary.
    let mut setup = Command::new("cargo");
    setup.args(["+nightly", "miri", "setup", "--target", TARGET]).env("RUSTUP_AUTO_INSTALL", "0");
    setup.stdin(Stdio::null()).stdout(Stdio::null());
    setup.status().is_ok_and(|status| status.success())
}
