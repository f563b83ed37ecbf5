//! The second board's firmware, whose chip QEMU does not have: that it builds, without warnings, and
//! that it cannot panic through our code.

use crate::{cargo, firmware};

const TARGET: &str = "thumbv8m.main-none-eabihf";
const NAME: &str = "sonarfix-pico2";

/// Lints and builds the firmware, and checks the linked file.
pub fn check() -> anyhow::Result<()> {
    let package = format!("--release --package {NAME} --target {TARGET}");
    cargo::check(firmware::in_firmware(&format!("clippy {package} -- -D warnings")))?;
    cargo::check(firmware::in_firmware(&format!("build {package}")))?;
    let program = firmware::target().join(TARGET).join("release").join(NAME);
    firmware::panics::others(&firmware::read(&program)?).map(drop)
}
