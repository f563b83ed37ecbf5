//! The workspaces of the repository: where each is and where it is built.

use std::path::PathBuf;
use std::process::Command;

use crate::cargo;

/// A workspace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Workspace {
    /// The crates, the simulator, the tests and this program.
    Main,
    /// The firmware of the boards.
    Firmware,
    /// Programs for emulated boards.
    Emulated,
    /// The filter beside its peers.
    Bench,
    /// Fuzz targets.
    Fuzz,
}

impl Workspace {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Main, Self::Firmware, Self::Emulated, Self::Bench, Self::Fuzz];

    /// The folder with its `Cargo.toml`.
    pub fn folder(self) -> PathBuf {
        cargo::root().join(match self {
            Self::Main => "",
            Self::Firmware => "firmware",
            Self::Emulated => "firmware/emulated",
            Self::Bench => "bench",
            Self::Fuzz => "fuzz",
        })
    }

    /// Where it is built. Each has a folder of its own below `target`, so that none waits for the lock of another.
    pub fn target_folder(self) -> PathBuf {
        cargo::target_folder().join(match self {
            Self::Main => "",
            Self::Firmware => "firmware",
            Self::Emulated => "emulated",
            Self::Bench => "bench",
            Self::Fuzz => "fuzz",
        })
    }

    /// A cargo command that runs in its folder, with the flags of its own `.cargo/config.toml` only.
    pub fn cargo(self, arguments: &str) -> Command {
        let mut command = cargo::command(arguments);
        command.current_dir(self.folder());
        if self != Self::Main {
            command.env_remove("RUSTFLAGS").env("CARGO_TARGET_DIR", self.target_folder());
        }
        command
    }
}
