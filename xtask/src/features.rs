//! Combinations of the features of the core.

use crate::cargo;
use crate::workspace::{Package, Workspace};

/// Checks no feature, each alone, each two, all, and all but one; tests what there is without any.
pub fn check() -> anyhow::Result<()> {
    cargo::install("cargo-hack", "0.6.46")?;
    cargo::run("hack check --package sonarfix --feature-powerset --depth 2")?;
    let packages = Workspace::Main.packages()?;
    let core = packages.iter().find(|package| package.name == "sonarfix");
    let features: Vec<&str> = core.into_iter().flat_map(Package::own_features).collect();
    for left_out in &features {
        let rest: Vec<&str> = features.iter().copied().filter(|it| it != left_out).collect();
        let check = "check --package sonarfix --no-default-features --features";
        cargo::run(&format!("{check} {}", rest.join(",")))?;
    }
    // The other tests are of parts that are not there. The tests of the workspace run with all features.
    cargo::run("test --package sonarfix --no-default-features --test blocked --example paper_robot")
}
