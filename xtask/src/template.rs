//! The template of a further board: it is instantiated as by `cargo generate`, built, and built again without each of its
//! parts, which must be a compile error that names the trait.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, ensure};

use crate::cargo;
use crate::workspace::Workspace;

/// The files of the template with placeholders or without.
const FILES: [&str; 6] =
    ["Cargo.toml", ".cargo/config.toml", "build.rs", "memory.x", "src/main.rs", "src/parts.rs"];

/// The traits of the parts, and the types that implement them.
const PARTS: [(&str, &str); 6] = [
    ("Link", "Serial"),
    ("Counter", "Encoder"),
    ("SetDutyCycle", "Pulses"),
    ("OutputPin", "Trigger"),
    ("ReadNorFlash", "Flash"),
    ("NorFlash", "Flash"),
];

/// Instantiates and builds it, and removes each part in turn.
pub fn check() -> anyhow::Result<()> {
    let folder = cargo::target_folder().join("template");
    instantiate(&folder)?;
    cargo::check(in_folder(&folder, "build --release"))?;
    let parts = folder.join("src/parts.rs");
    let whole = fs::read_to_string(&parts)?;
    for (part, of) in PARTS {
        fs::write(&parts, without(&whole, part, of)?)?;
        let output = in_folder(&folder, "check --release").output()?;
        let errors = String::from_utf8_lossy(&output.stderr);
        ensure!(!output.status.success(), "it compiles without {part} for {of}");
        let named = errors.lines().find(|line| line.starts_with("error") && line.contains(part));
        let named = named.with_context(|| format!("no error names {part}:\n{errors}"))?;
        println!("without {part}: {named}");
    }
    fs::write(&parts, whole)?;
    Ok(())
}

/// Writes the template's files with its placeholders replaced, as `cargo generate` does, and the firmware's versions of
/// all dependencies.
fn instantiate(folder: &Path) -> anyhow::Result<()> {
    let firmware = Workspace::Firmware.folder();
    for file in FILES {
        let text = fs::read_to_string(firmware.join("template").join(file)).context(file)?;
        let text = text
            .replace("{{project-name}}", "my-board")
            .replace("{{sonarfix}}", &cargo::root().display().to_string());
        ensure!(!text.contains("{{"), "{file}: an unknown placeholder");
        let to = folder.join(file);
        fs::create_dir_all(to.parent().context(file)?)?;
        fs::write(&to, text)?;
    }
    fs::copy(firmware.join("Cargo.lock"), folder.join("Cargo.lock"))?;
    Ok(())
}

/// A cargo command in the folder, which shares its built dependencies with the firmware.
fn in_folder(folder: &Path, arguments: &str) -> Command {
    let mut command = Workspace::Firmware.cargo(arguments);
    command.current_dir(folder);
    command
}

/// A source without the implementation of a trait.
fn without(source: &str, part: &str, of: &str) -> anyhow::Result<String> {
    let head = format!("\nimpl {part} for {of} {{\n");
    let (before, rest) = source.split_once(&head).with_context(|| format!("no{head}"))?;
    let (_, after) = rest.split_once("\n}\n").context("no end of the implementation")?;
    Ok(format!("{before}\n{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_implementation_is_removed_with_its_functions() {
        let source = "struct A;\n\nimpl B for A {\n    fn b() {\n    }\n}\n\nstruct C;\n";
        assert_eq!(without(source, "B", "A").unwrap(), "struct A;\n\n\nstruct C;\n");
        assert!(without(source, "D", "A").is_err());
    }
}
