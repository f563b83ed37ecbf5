//! The licences of what is linked.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;

use anyhow::Context;

use crate::cargo::{self, Dependency};
use crate::workspace::Workspace;

/// The licences of all that is linked into packages of a workspace: a list, and each text once.
pub fn of(workspace: Workspace, packages: &str) -> anyhow::Result<String> {
    let tree = format!("tree --locked {packages} --edges normal --prefix none --format {{p}}");
    let tree = cargo::printed(workspace.cargo(&tree))?;
    let linked: Vec<_> =
        tree.lines().filter_map(|line| line.split_once(" v")).map(|(name, _)| name).collect();
    let metadata = workspace.cargo("metadata --all-features --format-version 1 --locked");
    let mut packages = cargo::dependencies(metadata)?;
    packages.retain(|it| linked.contains(&it.name.as_str()));
    packages.sort_by(|a, b| (&a.name, &a.version).cmp(&(&b.name, &b.version)));
    let mut list =
        "The program contains these libraries, under the licences behind them.\n\n".to_owned();
    let mut texts = BTreeMap::<String, Vec<String>>::new();
    for Dependency { name, version, license, manifest_path, .. } in &packages {
        let licence = license.as_deref().unwrap_or("see its text");
        writeln!(list, "{name} {version}: {licence}")?;
        let folder = manifest_path.parent().context("a package without a folder")?;
        let mut files: Vec<_> = fs::read_dir(folder)?.filter_map(Result::ok).collect();
        files.sort_by_key(fs::DirEntry::file_name);
        for file in files {
            let file_name = file.file_name().to_string_lossy().to_uppercase();
            let is_licence = ["LICENSE", "LICENCE", "COPYING", "NOTICE"];
            if is_licence.iter().any(|start| file_name.starts_with(start)) && file.path().is_file()
            {
                let text = fs::read_to_string(file.path()).unwrap_or_default();
                texts.entry(text.trim().to_owned()).or_default().push(format!("{name} {version}"));
            }
        }
    }
    for (text, names) in texts {
        write!(list, "\n{}\n{}\n\n{text}\n", "-".repeat(78), names.join(", "))?;
    }
    Ok(list)
}
