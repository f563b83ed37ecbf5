//! The rules that Arduino's library manager and arduino-lint publish (Library specification 1.5, library manager FAQ), as far as they
//! can be broken here.

use std::path::Path;

use anyhow::{Context, Result, ensure};

/// Fields that `library.properties` must have.
const FIELDS: [&str; 9] = [
    "name",
    "version",
    "author",
    "maintainer",
    "sentence",
    "paragraph",
    "category",
    "url",
    "architectures",
];

/// Checks the package.
///
/// # Errors
/// By the first rule that is broken.
pub fn check(package: &Path) -> Result<()> {
    let properties = std::fs::read_to_string(package.join("library.properties"))?;
    let field = |name: &str| {
        let line = properties.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix('='));
        line.filter(|value| !value.is_empty()).with_context(|| format!("no field {name}"))
    };
    for name in FIELDS {
        field(name)?;
    }
    let name = field("name")?;
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | ' ' | '.' | '-');
    ensure!(name.len() < 64 && name.chars().all(allowed), "the name {name} is not allowed");
    ensure!(!name.to_lowercase().contains("arduino"), "the name belongs to Arduino");
    ensure!(field("version")?.split('.').count() == 3, "the version is not semantic");
    ensure!(field("category")? == "Device Control", "an unknown category");
    ensure!(field("sentence")?.len() < 160, "the sentence is too long");
    let header = package.join("src").join(field("includes")?);
    ensure!(header.exists(), "there is no {}", header.display());
    for line in std::fs::read_to_string(package.join("keywords.txt"))?.lines() {
        ensure!(line.split('\t').count() == 2, "keywords.txt needs one tab: {line}");
    }
    examples(&package.join("examples"))
}

/// A sketch has the name of its folder.
fn examples(folder: &Path) -> Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let sketch = entry.path().join(format!("{name}.ino"));
            ensure!(sketch.exists(), "there is no {}", sketch.display());
        }
    }
    Ok(())
}
