//! Builds programs for emulated boards.

use std::path::PathBuf;

use crate::cargo;
use crate::workspace::Workspace;

/// The target that a program is built for, and the board that it runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Target {
    /// The name in tables.
    pub name: &'static str,
    /// The target of rustc.
    pub triple: &'static str,
    /// The board of QEMU that runs its instructions.
    pub board: &'static str,
    /// The profile of cargo, which chooses the optimisation level.
    pub profile: &'static str,
}

/// Cortex-M4 with an FPU, optimised for speed.
pub const M4F: Target = Target {
    name: "Cortex-M4F",
    triple: "thumbv7em-none-eabihf",
    board: "mps2-an386",
    profile: "release",
};
/// The same, optimised for size.
pub const M4F_SMALL: Target = Target { name: "Cortex-M4F at `s`", profile: "small", ..M4F };
/// The same optimised for speed, with fused multiply-add ([`FUSED`]).
pub const M4F_FUSED: Target = Target { name: "Cortex-M4F, fused", profile: "fused", ..M4F };
/// Configuration of cargo with which LLVM computes a sum of a number and a product by one instruction, which rounds once.
pub const FUSED: &str = r#"target.'cfg(all(target_arch = "arm", target_os = "none"))'.rustflags=["-C", "llvm-args=-fp-contract=fast"]"#;
/// Cortex-M3, in soft float.
pub const M3: Target = Target {
    name: "Cortex-M3",
    triple: "thumbv7m-none-eabi",
    board: "mps2-an385",
    profile: "release",
};
/// Cortex-M0+, in soft float. QEMU has no M0+ with enough memory and a counter; an emulated
/// Cortex-M3 runs the program, because its instruction set contains that of the M0+.
pub const M0PLUS: Target = Target { name: "Cortex-M0+", triple: "thumbv6m-none-eabi", ..M3 };
/// The same, optimised for size.
pub const M0PLUS_SMALL: Target = Target { name: "Cortex-M0+ at `s`", profile: "small", ..M0PLUS };

impl Target {
    /// Builds all programs of a package; then they are at [`Self::program`].
    pub fn build(&self, workspace: Workspace, arguments: &str) -> anyhow::Result<()> {
        let Self { triple, profile, .. } = self;
        let mut command = workspace.cargo(&format!(
            "build --package {arguments} --bins --target {triple} --profile {profile}"
        ));
        if *self == M4F_FUSED {
            command.args(["--config", FUSED]);
        }
        cargo::check(command)
    }

    /// Where a built program is.
    pub fn program(&self, workspace: Workspace, name: &str) -> PathBuf {
        workspace.target_folder().join(self.triple).join(self.profile).join(name)
    }
}
