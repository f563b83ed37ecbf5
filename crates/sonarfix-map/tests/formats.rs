//! The examples of `docs/formats.md` are valid, and it explains every key in them.

use std::collections::BTreeSet;
use std::path::Path;

use sonarfix_map::{FileError, Floor, Scenario, documentation, robot_file};

// Read at run time, because the page is outside of the crate and not in its package.
const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/formats.md");

/// The TOML examples of a page: the kind of file and the text of each.
fn examples(page: &str) -> Vec<(&str, &str)> {
    let blocks = page.split("```toml ").skip(1);
    blocks.filter_map(|block| block.split("```").next()?.split_once('\n')).collect()
}

fn read(kind: &str, text: &str) -> Result<(), FileError> {
    match kind {
        "map" => Floor::parse(text, kind).map(drop),
        "robot" => robot_file::parse(text, kind).map(drop),
        _ => Scenario::parse(text, kind, Path::new("")).map(drop),
    }
}

#[test]
fn every_example_is_read() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let examples = examples(&page);
    let kinds: Vec<_> = examples.iter().map(|(kind, _)| *kind).collect();
    assert_eq!(kinds, ["map", "robot", "scenario"]);
    for (kind, text) in examples {
        assert_eq!(read(kind, text), Ok(()));
    }
}

#[test]
fn every_key_is_explained() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let key = |line: &'_ str| {
        let (key, _) = line.split_once(" = ")?;
        Some(key.trim_start_matches(['{', ' ']).to_owned())
    };
    let text: String = examples(&page).into_iter().map(|(_, text)| text).collect();
    let keys: BTreeSet<_> = text.lines().filter_map(key).collect();
    assert!(keys.len() > 35, "{keys:?}");
    let rows: Vec<_> = page.lines().filter(|line| line.starts_with("| `")).collect();
    let is_explained = |key: &String| {
        let name = format!("`{key}`");
        let explains =
            |row: &&str| row.split(" | ").next().is_some_and(|cell| cell.contains(&name));
        key == "format" || rows.iter().any(explains)
    };
    let missing: Vec<_> = keys.iter().filter(|key| !is_explained(key)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

/// The page with the tables of the code between its markers; `None` if it lacks a marker.
fn with_tables(page: &str) -> Option<String> {
    const END: &str = "<!-- end of keys -->";
    documentation().iter().try_fold(page.to_owned(), |page, (name, table)| {
        let marker = format!("<!-- keys {name} -->\n");
        let (before, rest) = page.split_once(&marker)?;
        let (_, after) = rest.split_once(END)?;
        Some(format!("{before}{marker}{table}{END}{after}"))
    })
}

/// With `SONARFIX_WRITE_DOCS=1` the test writes the page instead.
#[test]
fn the_page_has_the_tables_of_the_code() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let written = with_tables(&page).unwrap();
    if std::env::var_os("SONARFIX_WRITE_DOCS").is_some() {
        std::fs::write(PAGE, written).unwrap();
        return;
    }
    assert_eq!(page, written, "write it: SONARFIX_WRITE_DOCS=1 cargo test -p sonarfix-map formats");
}
