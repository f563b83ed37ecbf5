//! `cargo xtask circles`: finds circles of imports between the modules of a crate.
//!
//! A module depends on another if a path in it, in a `use` or in code, leads to an item of the other. A path is
//! followed through re-exports to the module that defines the item. What counts:
//! - a child module that uses an item of its parent depends on the parent, also through `use super::*`;
//! - a parent depends on a child if it uses an item of it. `mod child;` alone, and a `pub use` or
//!   `pub(…) use` of a child's items that the parent's own code does not use, are declarations and do not count;
//! - inline modules, unit tests among them, are modules of their own.
//!
//! Methods are not followed, since their calls name no path: an `impl` block in a child module is a
//! dependency of the child on the type's module, and none of the type's module on the child. Names in attributes and in
//! documentation do not count.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde::Deserialize;

use crate::cargo;
use crate::workspace::Workspace;

mod components;
mod names;
mod resolve;
mod tree;

use components::Component;
use tree::Crate;

/// Checks every target of every package; prints each circle with the imports that close it.
pub fn check() -> anyhow::Result<()> {
    let mut circles = 0;
    let mut modules = 0;
    for workspace in Workspace::ALL {
        for target in targets(workspace)? {
            let tree = Crate::read(&target.src_path)?;
            modules += tree.modules.len();
            let edges = resolve::edges(&tree);
            for component in components::circles(tree.modules.len(), &edges) {
                circles += 1;
                print(&target, &tree, &component);
            }
        }
    }
    if circles > 0 {
        bail!("circles of imports: {circles}");
    }
    eprintln!("no circle of imports between {modules} modules");
    Ok(())
}

/// A library, program, test, example or benchmark: the root of a tree of modules.
#[derive(Debug, Deserialize)]
struct Target {
    name: String,
    kind: Vec<String>,
    src_path: PathBuf,
}

/// The targets of a workspace's own packages.
fn targets(workspace: Workspace) -> anyhow::Result<Vec<Target>> {
    #[derive(Deserialize)]
    struct Metadata {
        packages: Vec<Package>,
    }
    #[derive(Deserialize)]
    struct Package {
        targets: Vec<Target>,
    }
    let json = cargo::printed(workspace.cargo("metadata --no-deps --format-version 1"))?;
    let metadata: Metadata = serde_json::from_str(&json).context("cannot read cargo's metadata")?;
    Ok(metadata.packages.into_iter().flat_map(|package| package.targets).collect())
}

/// Prints a circle: its modules, then each import between two of them.
fn print(target: &Target, tree: &Crate, component: &Component) {
    let path = |id: usize| tree.modules.get(id).map_or("", |module| &module.path);
    let modules: Vec<&str> = component.modules.iter().map(|&id| path(id)).collect();
    println!("{} ({}): {}", target.name, target.kind.join(", "), modules.join(", "));
    for edge in &component.edges {
        let file = tree.modules.get(edge.from).map(|module| module.file.as_path());
        let file = file.unwrap_or(Path::new(""));
        let file = file.strip_prefix(cargo::root()).unwrap_or(file).display();
        println!("  {} → {}: {file}:{} `{}`", path(edge.from), path(edge.to), edge.line, edge.name);
    }
}
