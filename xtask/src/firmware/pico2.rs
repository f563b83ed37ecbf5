//! The firmware of the second board, a chip that QEMU does not emulate: it is linted, built and searched for panics.

use super::{build, panics};
use crate::cargo;
use crate::workspace::Workspace;

const TARGET: &str = "thumbv8m.main-none-eabihf";
const NAME: &str = "sonarfix-pico2";

/// Lints and builds the firmware, and checks the linked file.
pub fn check() -> anyhow::Result<()> {
    let package = format!("--release --package {NAME} --target {TARGET}");
    let firmware = Workspace::Firmware;
    cargo::check(firmware.cargo(&format!("clippy {package} -- -D warnings")))?;
    cargo::check(firmware.cargo(&format!("build {package}")))?;
    let program = firmware.target_folder().join(TARGET).join("release").join(NAME);
    panics::others(&build::read(&program)?).map(drop)
}
