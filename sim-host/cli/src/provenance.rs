//! Where a report comes from: version, command, hashes of the files.

use std::fmt::Write;
use std::path::Path;

use sha2::{Digest, Sha256};
use sonarfix_report::Table;

/// The table of a report. A path that cannot be read as a file has no row.
pub fn table(files: &[&Path]) -> Table {
    let version = concat!("sonarfix ", env!("CARGO_PKG_VERSION"));
    let mut rows = vec![row("version", version), row("command", &command(std::env::args()))];
    rows.extend(files.iter().filter_map(|file| {
        let content = std::fs::read(file).ok()?;
        Some(row(&file.display().to_string(), &format!("SHA-256 {}", hash(&content))))
    }));
    Table {
        title: "Provenance".into(),
        columns: vec!["what".into(), "value".into()],
        rows,
        ..Table::default()
    }
}

/// The files of a scenario: itself, and the map and the robot file that it names.
pub fn of_scenario(scenario: &Path) -> Table {
    let text = std::fs::read_to_string(scenario).unwrap_or_default();
    let root = text.parse::<toml::Table>().unwrap_or_default();
    let named = ["map", "robot"].into_iter().filter_map(|key| root.get(key)?.as_str());
    let named: Vec<_> = named.map(|name| scenario.with_file_name(name)).collect();
    let files: Vec<&Path> =
        std::iter::once(scenario).chain(named.iter().map(AsRef::as_ref)).collect();
    table(&files)
}

fn row(name: &str, value: &str) -> Vec<String> {
    vec![name.to_owned(), value.to_owned()]
}

/// The command as a shell takes it.
fn command(arguments: impl Iterator<Item = String>) -> String {
    let mut arguments = arguments;
    let program = arguments.next().unwrap_or_default();
    let name = Path::new(&program)
        .file_name()
        .map_or(program.as_str().into(), |name| name.to_string_lossy());
    let is_plain = |letter: char| letter.is_alphanumeric() || "-_./=,:+@%".contains(letter);
    let quoted = arguments.map(|argument| {
        if !argument.is_empty() && argument.chars().all(is_plain) {
            argument
        } else {
            format!("'{}'", argument.replace('\'', r"'\''"))
        }
    });
    std::iter::once(name.into_owned()).chain(quoted).collect::<Vec<_>>().join(" ")
}

fn hash(content: &[u8]) -> String {
    let mut text = String::new();
    for byte in Sha256::digest(content) {
        // Writing to a string does not fail.
        let _ = write!(text, "{byte:02x}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The vector of FIPS 180-2, appendix B.1.
    #[test]
    fn a_hash_is_that_of_sha256sum() {
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(hash(b"abc"), expected);
    }

    #[test]
    fn a_command_can_be_repeated() {
        let arguments = ["/usr/bin/sonarfix", "run", "a b.toml", "it's", "--runs", "3", ""];
        let command = command(arguments.into_iter().map(str::to_owned));
        assert_eq!(command, r"sonarfix run 'a b.toml' 'it'\''s' --runs 3 ''");
    }

    #[test]
    fn a_scenario_has_the_files_that_it_names() {
        let dir = tempfile::tempdir().unwrap();
        let scenario = dir.path().join("s.toml");
        std::fs::write(&scenario, "map = \"m.toml\"\nrobot = \"none.toml\"").unwrap();
        std::fs::write(dir.path().join("m.toml"), "").unwrap();
        let rows = of_scenario(&scenario).rows;
        let names: Vec<_> = rows.iter().map(|row| row[0].rsplit('/').next().unwrap()).collect();
        assert_eq!(names, ["version", "command", "s.toml", "m.toml"]);
    }
}
