//! The published crates: their packages, and their minimum supported Rust version.

use anyhow::{Context, ensure};

use crate::cargo;
use crate::workspace::{Package, Workspace};

/// Files that every package contains.
const FILES: [&str; 4] = ["Cargo.toml", "README.md", "LICENSE-MIT", "LICENSE-APACHE"];

/// Packages every published crate and builds each package from its own files only.
pub fn package() -> anyhow::Result<()> {
    let crates = crates()?;
    for Package { name, .. } in &crates {
        let list = cargo::command(&format!("package --list --allow-dirty --package {name}"));
        let list = cargo::printed(list)?;
        for file in FILES {
            ensure!(list.lines().any(|line| line == file), "the package {name} lacks {file}");
        }
    }
    // cargo takes a package of one name and version for unchanged, in its builds as in its unpacked sources.
    let target = cargo::target_folder().join("packages");
    if target.exists() {
        std::fs::remove_dir_all(&target).context("cannot remove the old packages")?;
    }
    remove_stale_sources(&crates)?;
    let packages = arguments(&crates);
    let mut command = cargo::command(&format!("package --quiet --allow-dirty {packages}"));
    command.env("CARGO_TARGET_DIR", target);
    cargo::check(command)
}

/// Removes the sources of these crates that an earlier `cargo package` has unpacked into cargo's home.
fn remove_stale_sources(crates: &[Package]) -> anyhow::Result<()> {
    let sources = cargo::home()?.join("registry/src");
    let Ok(registries) = std::fs::read_dir(&sources) else { return Ok(()) };
    for registry in registries {
        let registry = registry?;
        // The name of a registry is its host and a hash; a local one has no host.
        if !registry.file_name().to_string_lossy().starts_with('-') {
            continue;
        }
        for Package { name, version, .. } in crates {
            let unpacked = registry.path().join(format!("{name}-{version}"));
            if unpacked.exists() {
                std::fs::remove_dir_all(&unpacked)
                    .with_context(|| format!("cannot remove {}", unpacked.display()))?;
            }
        }
    }
    Ok(())
}

/// Checks every published crate with the oldest toolchain that it declares.
pub fn msrv() -> anyhow::Result<()> {
    for Package { name, rust_version, .. } in crates()? {
        let version = rust_version.with_context(|| format!("{name} has no `rust-version`"))?;
        for features in ["", "--all-features"] {
            let check = format!("+{version} check --package {name} {features}");
            let mut command = cargo::command(&check);
            // A toolchain in the environment would be used instead of the one in `+…`.
            command.env_remove("RUSTUP_TOOLCHAIN");
            command.env("CARGO_TARGET_DIR", cargo::target_folder().join("msrv"));
            cargo::check(command).with_context(|| {
                format!("is it installed? `rustup toolchain install {version} --profile minimal`")
            })?;
        }
    }
    Ok(())
}

fn crates() -> anyhow::Result<Vec<Package>> {
    let packages = Workspace::Main.packages()?;
    Ok(packages.into_iter().filter(Package::is_published).collect())
}

fn arguments(crates: &[Package]) -> String {
    let packages: Vec<String> =
        crates.iter().map(|package| format!("--package {}", package.name)).collect();
    packages.join(" ")
}
