//! The workspaces of the repository: where each is and where it is built.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;

use anyhow::Context;
use serde::Deserialize;

use crate::cargo;

/// A workspace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Workspace {
    /// The crates, the simulator, the tests and this program.
    Main,
    /// The C library.
    C,
    /// The firmware of the boards.
    Firmware,
    /// Programs for emulated boards.
    Emulated,
    /// The filter beside its peers.
    Bench,
    /// Fuzz targets.
    Fuzz,
    /// The Python package.
    Python,
    /// The ROS 2 node.
    Ros,
}

impl Workspace {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Main,
        Self::C,
        Self::Firmware,
        Self::Emulated,
        Self::Bench,
        Self::Fuzz,
        Self::Python,
        Self::Ros,
    ];

    /// The folder with its `Cargo.toml`.
    pub fn folder(self) -> PathBuf {
        cargo::root().join(self.path())
    }

    /// The same from the top of the repository.
    pub fn path(self) -> &'static str {
        match self {
            Self::Main => "",
            Self::C => "c",
            Self::Firmware => "firmware",
            Self::Emulated => "firmware/emulated",
            Self::Bench => "bench",
            Self::Fuzz => "fuzz",
            Self::Python => "python",
            Self::Ros => "ros",
        }
    }

    /// Where it is built. Each has a folder of its own below `target`, so that none waits for the lock of another.
    pub fn target_folder(self) -> PathBuf {
        cargo::target_folder().join(match self {
            Self::Main => "",
            Self::C => "c",
            Self::Firmware => "firmware",
            Self::Emulated => "emulated",
            Self::Bench => "bench",
            Self::Fuzz => "fuzz",
            Self::Python => "python",
            Self::Ros => "ros",
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

    /// Its own packages.
    pub fn packages(self) -> anyhow::Result<Vec<Package>> {
        #[derive(Deserialize)]
        struct Metadata {
            packages: Vec<Package>,
        }
        let json = cargo::printed(self.cargo("metadata --no-deps --format-version 1"))?;
        let metadata: Metadata =
            serde_json::from_str(&json).context("cannot read cargo's metadata")?;
        Ok(metadata.packages)
    }
}

/// A package, as cargo describes it.
#[derive(Debug, Deserialize)]
pub struct Package {
    pub name: String,
    pub version: String,
    pub rust_version: Option<String>,
    /// The registries that it may be published to; none if it may not be published.
    publish: Option<Vec<String>>,
    features: BTreeMap<String, Vec<String>>,
    pub targets: Vec<Target>,
}

impl Package {
    pub fn is_published(&self) -> bool {
        self.publish.as_ref().is_none_or(|to| !to.is_empty())
    }

    /// Its features without the set that is on by default.
    pub fn own_features(&self) -> impl Iterator<Item = &str> {
        self.features.keys().map(String::as_str).filter(|name| *name != "default")
    }
}

/// A library, program, test, example or benchmark: the root of a tree of modules.
#[derive(Debug, Deserialize)]
pub struct Target {
    pub src_path: PathBuf,
}
